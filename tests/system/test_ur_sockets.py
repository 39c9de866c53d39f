"""Programs that connect to their client and are steered by it: whatever becomes of the client, the arm stops."""

import itertools
import math
import socket
import struct

from tests.conformance.wire import Wire
from tests.system.waiting import eventually

from tvist_plant.description import load

from .test_ur_lockstep import begin_step, dashboard, lockstep, replayed, running, take_clock

HOME = (-1.60, -1.727, -2.203, -0.808, 1.595, -0.031)
FAR = (-0.10, *HOME[1:5], 1.469)
LIMITS = load("ur5e").limits
PROGRAM = """def driver():
  global q = get_target_joint_positions()
  global going = True
  thread follow():
    while going:
      servoj(q, t=0.002, lookahead_time=0.03, gain=2000)
    end
    stopj(4)
  end
  if not socket_open("{host}", {port}, "driver"):
    textmsg("nobody listens")
    halt
  end
  got = socket_read_binary_integer(6, "driver", 0)
  h = run follow()
  while going:
    if got[0] == 6:
      q = [got[1], got[2], got[3], got[4], got[5], got[6]] / 1000000
      socket_send_int(1, "driver")
      got = socket_read_binary_integer(6, "driver", 0.1)
    else:
      going = False
    end
  end
  join h
  textmsg("the client has gone")
end
"""


def steer(stream, postures):
    """Send joint positions, and read what is answered."""
    for posture in postures:
        stream.sendall(struct.pack(">6i", *(round(1e6 * angle) for angle in posture)))
        stream.recv(4, socket.MSG_WAITALL)


def cut(stream):
    """Reset the connection."""
    stream.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    stream.close()


MANNERS = {
    "ends": lambda stream: stream.shutdown(socket.SHUT_RDWR),
    "is cut": cut,
    "is silent": lambda _: None,
    "is torn": lambda stream: stream.sendall(b"\1\2\3\4\5"),
    "asks for absurd joints": lambda stream: stream.sendall(struct.pack(">6i", *[2**31 - 1] * 6)),
    "jumps far away at once": lambda stream: steer(stream, [FAR] * 300),
}


def test_whatever_becomes_of_the_client_the_arm_stops_inside_its_limits_and_a_replay_is_equal(tmp_path):
    path = tmp_path / "run.mcap"
    with lockstep(51, path, start=",".join(map(str, HOME))) as (served, host), Wire(served.endpoint) as wire:
        wire.listen("event", "state")
        for manner, becomes in MANNERS.items():
            seen = len(wire.received["event"])
            with socket.create_server((host, 0)) as server, Wire(served.endpoint) as stepper:
                clock = take_clock(stepper)
                stepper.step(clock, 1)
                begin_step(stepper, clock, 100_000)  # until this client goes
                with socket.create_connection((host, 30002)) as script:
                    script.sendall(PROGRAM.format(host=host, port=server.getsockname()[1]).encode())
                    stream, _ = server.accept()
                with stream:
                    steer(stream, ([a + 0.2 * math.sin(0.01 * n) for a in HOME] for n in range(150)))
                    becomes(stream)
                    stopped = wire.wait("event", lambda one: one["kind"] == "program_stopped", since=seen)
                    wire.until(stopped["tick"] + 260)
            eventually(lambda: wire.info()["stepper"] is None)
            events = wire.received["event"][seen:]
            said = [event["why"] for event in events if event["kind"] == "text"]
            errors = [event["why"] for event in events if event["kind"] == "warning" and event.get("line")]
            absurd = manner == "asks for absurd joints"
            assert (said, bool(errors)) == ([] if absurd else ["the client has gone"], absurd), (
                manner,
                events,
            )
            assert not errors or "2147.48" in errors[0]
        assert served.end() == 0
    content = replayed(path)
    assert sum(entry.change == "opened" for entry in content.journal) == len(MANNERS)
    for state in content.states:
        for used, limits in ((state.target_qd, LIMITS.velocity), (state.target_qdd, LIMITS.acceleration)):
            assert all(abs(one) <= 1.0001 * most for one, most in zip(used, limits, strict=True))
    of = {state.tick: state for state in content.states}
    ends = [event.tick for event in content.events if event.kind == "program_stopped"]
    assert len(ends) == len(MANNERS)
    assert all(max(map(abs, of[end + 250].target_qd)) == 0.0 for end in ends)


ECHO = """def echo():
  socket_open("{host}", {port})
  global n = 0
  while n < 40:
    got = socket_read_binary_integer(1, timeout=0.004)
    if got[0] == 1:
      n = n + 1
      socket_send_int(got[1])
    else:
      write_output_integer_register(0, read_output_integer_register(0) + 1)
    end
  end
end
"""


def test_in_lockstep_a_step_waits_for_what_a_program_reads_until_its_client_is_silent(tmp_path):
    """The client answers in each tick: no time-out of two ticks is met until it is silent."""
    path = tmp_path / "run.mcap"
    with (
        lockstep(52, path) as (served, host),
        Wire(served.endpoint) as stepper,
        Wire(served.endpoint) as other,
        socket.create_server((host, 0)) as server,
        socket.create_connection((host, 30001)) as script,
    ):
        clock = take_clock(stepper)
        other.listen("io")
        stepper.step(clock, 1)
        begin_step(stepper, clock, 100_000)
        script.sendall(ECHO.format(host=host, port=server.getsockname()[1]).encode())
        stream, _ = server.accept()
        with stream:
            for number in range(20):
                stream.sendall(struct.pack(">i", number))
                assert stream.recv(4, socket.MSG_WAITALL) == struct.pack(">i", number)
            other.wait("io", lambda io: io["output_int_register"][0] > 0)
        assert served.end() == 0
    journal = [entry for entry in replayed(path).journal if entry.kind == "socket"]
    ticks = [entry.tick for entry in journal if entry.change == "received"]
    assert len(ticks) == 20
    assert {after - before for before, after in itertools.pairwise(ticks)} == {1}
    assert all(entry.tick > ticks[-1] for entry in journal if entry.change == "expired")


def test_external_control_runs_the_text_of_the_client_and_the_program_goes_on_after_it(tmp_path):
    (tmp_path / "cell.urp").write_text(
        "<URProgram><children><MainProgram runOnlyOnce='true'><children>"
        "<Contributed strategyClass='com.fzi.externalcontrol.ExternalControlNode'/>"
        "<Script><cachedContents>textmsg(&quot;handed back&quot;)</cachedContents></Script>"
        "</children></MainProgram></children></URProgram>"
    )
    text = b'# HEADER_BEGIN\nglobal a = 7\n# HEADER_END\ntextmsg("a=", a)\n# NODE_CONTROL_LOOP_ENDS\n'
    with (
        lockstep(53, tmp_path / "run.mcap", "--programs", str(tmp_path)) as (served, host),
        Wire(served.endpoint) as wire,
        socket.create_server((host, 50002)) as server,
        dashboard(host, source=host) as interface,
    ):
        wire.listen("event")
        clock = take_clock(wire)
        wire.step(clock, 1)
        running(interface)
        begin_step(wire, clock, 100_000)
        assert interface.ask("load cell.urp") == "Loading program: cell.urp"
        interface.send(b"play\n")
        stream, _ = server.accept()
        with stream:
            assert stream.recv(100) == b"request_program\n"
            stream.sendall(text)
            assert interface.line() == "Starting program"
        wire.wait("event", lambda event: event["kind"] == "program_stopped")
        said = [event["why"] for event in wire.received["event"] if event["kind"] == "text"]
        assert said == ["a=7", "handed back"]
