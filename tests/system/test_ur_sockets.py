"""Programs that follow set-points of a client over a socket; whatever happens to the client, the arm stops."""

import itertools
import signal
import socket
import struct
import sys
from pathlib import Path

import pytest
from tests import forked
from tests.conformance.served import PATIENCE, Served
from tests.conformance.wire import Wire
from tests.places import own_address

from tvist_plant.description import load

from .test_ur_lockstep import lockstep, replayed

HOST = own_address(51)
LIMITS = load("ur5e").limits
DRIVER = Path(__file__).with_name("ur_driver.py")


@pytest.mark.realtime
@pytest.mark.parametrize(
    "faults", [("torn", "absurd"), pytest.param(("jumping", "cut", "frozen"), marks=pytest.mark.nightly)]
)
def test_arm_stops_within_its_limits_after_each_fault_of_the_client(faults, tmp_path):
    path = tmp_path / "run.mcap"
    with Served("--ur-address", HOST, "--record", str(path)) as served:
        with Wire(served.endpoint) as wire:
            wire.listen("event", "state")
            for fault in faults:
                seen = len(wire.received["event"])
                driver = forked.Popen([sys.executable, DRIVER, HOST, fault])
                wire.wait("event", lambda event: event["kind"] == "program_stopped", since=seen)
                driver.send_signal(signal.SIGKILL)
                driver.wait(PATIENCE)
                assert_told(fault, wire.received["event"][seen:])
                wire.next("state", lambda state: max(map(abs, state["target_qd"])) == 0.0)
        assert served.end() == 0
    content = replayed(path)
    assert sum(entry.change == "opened" for entry in content.journal) == len(faults)
    for state in content.states:
        for moved, limits in ((state.target_qd, LIMITS.velocity), (state.target_qdd, LIMITS.acceleration)):
            assert all(abs(q) <= 1.0001 * most for q, most in zip(moved, limits, strict=True))
    ends = [event.tick for event in content.events if event.kind == "program_stopped"]
    begins = [event.tick for event in content.events if event.kind == "program_started"]
    speeds = {state.tick: max(map(abs, state.target_qd)) for state in content.states}
    last = content.states[-1].tick
    for end, following in zip(ends, [*begins[1:], last], strict=True):
        rest = next(tick for tick in range(end, last) if speeds[tick] == 0.0)
        assert rest <= end + 150
        assert not any(speeds[tick] for tick in range(rest, following))


def assert_told(fault, events):
    said = [event["why"] for event in events if event["kind"] == "text"]
    errors = [event["why"] for event in events if event["kind"] == "warning" and event.get("line")]
    expected = [] if fault == "absurd" else ["the client has gone"]
    assert said == expected, (fault, events)
    assert bool(errors) == (fault == "absurd"), (fault, events)
    assert not errors or "2147.48" in errors[0]


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


def test_step_in_lockstep_waits_for_a_socket_until_its_client_is_silent(tmp_path):
    """The client answers in each tick, so that the program's time-out of two ticks occurs only at its end."""
    path = tmp_path / "run.mcap"
    with (
        lockstep(52, path, {"tvist_server.gateways.sockets.PATIENCE": 2.5}) as (served, host),
        Wire(served.endpoint) as stepper,
        Wire(served.endpoint) as other,
        socket.create_server((host, 0)) as server,
        socket.create_connection((host, 30001)) as script,
    ):
        clock = stepper.take("clock", "stepper")
        other.listen("io")
        stepper.step(clock, 1)
        stepper.begin("simulation.step", token=clock, ticks=100_000)
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
