"""Every UR interface in lockstep: one client holds the clock and steps, and clients of a UR robot live by its steps."""

import socket
import struct
from contextlib import ExitStack, contextmanager

import msgpack
import pytest
from tests.conformance.served import PATIENCE, Served
from tests.conformance.wire import Wire
from tests.places import own_address
from tests.server.ur import decoders, rtde_client

from tvist_controller.programs.compiling import PAPER, built_in
from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_plant.description import load

BOOTED, TICK = 40.0, 0.002
FAR = [0.6, -2.9, 0.3, -1.4, 0.2, 0.4]
REALTIME_BYTES = 1220
READ = ("timestamp", "target_q", "shaped_q", "actual_q", "actual_tool_accelerometer", "runtime_state")


def timestamps(ticks):
    return [BOOTED + tick * TICK for tick in ticks]


class Connection:
    """A connection to one of a robot's ports."""

    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port), PATIENCE)
        self._bytes = b""

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def take(self, size):
        while len(self._bytes) < size:
            more = self.socket.recv(65536)
            assert more, "the robot closed the connection"
            self._bytes += more
        taken, self._bytes = self._bytes[:size], self._bytes[size:]
        return taken

    def package(self, head):
        """The next package, which begins with its length: of 16 or of 32 bits."""
        length = self.take(struct.calcsize(head))
        return length + self.take(struct.unpack(head, length)[0] - len(length))

    def ask(self, line):
        """A line of the dashboard, and its answer."""
        self.send(f"{line}\n".encode())
        return self.line()

    def line(self):
        said = b""
        while not said.endswith(b"\n"):
            said += self.take(1)
        return said.decode().strip()


def dashboard(host):
    interface = Connection(host, 29999)
    assert interface.line().startswith("Connected")
    return interface


def rtde(host):
    """A client of RTDE that has started its outputs at 500 Hz."""
    interface = Connection(host, 30004)
    for request, letter in (
        (rtde_client.version(), "V"),
        (rtde_client.outputs(READ), "O"),
        (rtde_client.package("S"), "S"),
    ):
        interface.send(request)
        ((answered, payload),) = rtde_client.packages(interface.package(">H"))
        assert (answered, payload[:1]) == (letter, b"\x01")
    return interface


def samples(interface, count):
    return [rtde_client.decoded(interface.package(">H"), READ) for _ in range(count)]


def robot_states(interface, until):
    """Time [s] and measured angles of the robot states, to the first one at a time or after it."""
    found = []
    while not found or found[-1][0] < until:
        ((kind, body),) = decoders.split(interface.package(">i"))
        if kind == 16:
            of = dict(decoders.parts(body))
            (time,) = struct.unpack_from(">Q", of[0])
            found.append((time / 1e6, [struct.unpack_from(">d", of[1], joint * 41)[0] for joint in range(6)]))
    return found


@contextmanager
def lockstep(last, path):
    with Served(
        "--clock",
        "lockstep",
        "--profile",
        "real",
        "--start",
        "Q1",
        "--ur-address",
        own_address(last),
        "--record",
        str(path),
    ) as served:
        yield served, own_address(last)


def take_clock(wire):
    wire.announce("stepper")
    taken = wire.command("take_clock", client="stepper")
    assert taken["type"] == "accepted", taken
    return taken["token"]


def begin_step(wire, token, ticks):
    """A step that is under way; its answers come into what this returns."""
    payload = msgpack.packb({"type": "simulation.step", "token": token, "ticks": ticks})
    return wire.session.get(wire.key("command"), payload=payload, timeout=PATIENCE)


def running(interface):
    """Wait until the interface knows that the arm may move: the first state is on its way to it."""
    while interface.ask("robotmode") != "Robotmode: RUNNING":
        pass


def replayed(path):
    """A recording's journal, whose replay is equal to the last bit."""
    content = read(path)
    assert content.complete
    assert replay_file(content).first_difference is None
    return content


def told(state, name):
    """A state's value under the name that UR's interfaces have for it."""
    if name == "target_q":
        return state["unshaped_q"] or state["target_q"]
    return state[name.replace("shaped", "target")]


def test_rtde_and_the_real_time_interface_have_every_tick_once_in_order_as_zenoh_tells_it(tmp_path):
    ticks = 1500
    with lockstep(1, tmp_path / "run.mcap") as (served, host):
        with (
            Wire(served.endpoint) as stepper,
            Wire(served.endpoint) as mover,
            rtde(host) as receive,
            Connection(host, 30003) as realtime,
            Connection(host, 30013) as read_only,
        ):
            clock = take_clock(stepper)
            token = mover.command("take_control", client="mover")["token"]
            assert mover.command("move_j", token=token, q=FAR)["type"] == "accepted"
            stepper.listen("state")
            for number in (1, 2, 497, 1000):
                stepper.step(clock, number)
            states = {state["tick"]: state for state in stepper.received["state"]}
            assert sorted(states) == list(range(1, ticks + 1))
            received = samples(receive, ticks)
            assert [sample["timestamp"] for sample in received] == timestamps(range(1, ticks + 1))
            for tick, sample in enumerate(received, 1):
                for name in READ[1:]:
                    assert sample[name] == told(states[tick], name), (tick, name)
            for interface in (realtime, read_only):
                times = []
                while not times or times[-1] < timestamps([ticks])[0]:
                    package = struct.unpack(">i152d", interface.take(REALTIME_BYTES))
                    # While no time passes the last tick is told again, once a second.
                    if not times or package[1] != times[-1]:
                        times.append(package[1])
                        assert list(package[2:8]) == told(states[len(times)], "target_q")
                assert times == timestamps(range(1, ticks + 1))
        assert served.end() == 0
    replayed(tmp_path / "run.mcap")


@pytest.mark.parametrize("port", [30001, 30002, 30011, 30012])
def test_primary_and_secondary_tell_the_time_of_the_ticks_ten_times_a_second(port, ur_lockstep):
    wire, clock, host, first = ur_lockstep
    with Connection(host, port) as interface:
        assert decoders.message(interface.package(">i")).values["name"] == "URControl"
        wire.step(clock, 1000)
        last = wire.received["state"][-1]["tick"]
        of = {round(state["timestamp"], 3): state for state in wire.received["state"]}
        found = robot_states(interface, BOOTED + last // 50 * 50 * TICK)
        times = [round(time - BOOTED, 3) for time, _ in found]
        # At once where the last tick is told again while no time passes, then at every fiftieth tick.
        begun = round(times[0] / TICK)
        assert first <= begun
        assert times[1:] == [round(tick * TICK, 3) for tick in range((begun // 50 + 1) * 50, last + 1, 50)]
        assert all(angles == of[time]["actual_q"] for time, (_, angles) in zip(times, found, strict=True))


@pytest.fixture(scope="module")
def ur_lockstep(tmp_path_factory):
    """A stepper's session, its token, and the address of a robot that moves."""
    with ExitStack() as stack:
        path = tmp_path_factory.mktemp("recorded") / "run.mcap"
        served, host = stack.enter_context(lockstep(2, path))
        wire, mover = (stack.enter_context(Wire(served.endpoint)) for _ in range(2))
        wire.listen("state")
        clock, token = take_clock(wire), mover.command("take_control", client="mover")["token"]
        assert mover.command("move_j", token=token, q=FAR, velocity=0.2)["type"] == "accepted"
        yield wire, clock, host, wire.step(clock, 10)["tick"]


def test_a_program_of_the_dashboard_reaches_its_end_within_one_step_of_another_client(tmp_path):
    moves = built_in(load("ur5e"))[PAPER].count("movej(")
    with (
        lockstep(3, tmp_path / "run.mcap") as (served, host),
        Wire(served.endpoint) as stepper,
        dashboard(host) as interface,
    ):
        clock = take_clock(stepper)
        stepper.listen("event")
        assert interface.ask("robotmode") == "Robotmode: NO_CONTROLLER"
        stepper.step(clock, 1)
        running(interface)
        assert interface.ask(f"load {PAPER}") == f"Loading program: {PAPER}"
        assert interface.ask("play") == "Starting program"
        assert stepper.info()["control"].startswith("ur-")
        begin_step(stepper, clock, 100_000)
        done = 0
        for _ in range(moves):
            event = stepper.wait("event", lambda event: event["kind"] == "motion_done", since=done)
            done = stepper.received["event"].index(event) + 1
        while interface.ask("running") != "Program running: false":
            pass
        assert served.end() == 0
    told = [entry for entry in replayed(tmp_path / "run.mcap").journal if entry.kind == "command"]
    assert [entry.tick for entry in told if entry.message["type"] == "simulation.step"] == [1, 2]
    assert [entry.tick for entry in told if entry.message["type"] == "program.play"] == [2]
    assert "move_j" not in {
        entry.message["type"] for entry in told
    }  # a replay makes the program's moves again
    started = [event["tick"] for event in stepper.received["event"] if event["kind"] == "motion_started"]
    assert started[0] == 2
    assert len(set(started)) == moves


def test_the_dashboard_pauses_resumes_and_stops_within_a_step(tmp_path):
    with (
        lockstep(4, tmp_path / "run.mcap") as (served, host),
        Wire(served.endpoint) as stepper,
        Wire(served.endpoint) as other,
        dashboard(host) as interface,
    ):
        clock = take_clock(stepper)
        other.listen("state", "event")
        stepper.step(clock, 1)
        running(interface)
        assert interface.ask(f"load {PAPER}") == f"Loading program: {PAPER}"
        answers = begin_step(stepper, clock, 100_000)
        other.until(10)  # what is asked now is asked within the step
        assert interface.ask("play") == "Starting program"
        other.wait("event", lambda event: event["kind"] == "motion_started")
        assert interface.ask("pause") == "Pausing program"
        assert interface.ask("programState") == f"PAUSED {PAPER}"
        assert interface.ask("play") == "Starting program"
        assert interface.ask("programState") == f"PLAYING {PAPER}"
        assert interface.ask("stop") == "Stopped"
        assert interface.ask("programState") == f"STOPPED {PAPER}"
        assert answers.try_recv() is None
        assert served.end() == 0
    content = replayed(tmp_path / "run.mcap")
    told = [(entry.tick, entry.message["type"]) for entry in content.journal if entry.kind == "command"]
    within = [kind for tick, kind in told if 2 < tick < 100_000]
    asked = [kind for kind in within if kind.startswith("program.")]
    assert asked == [f"program.{command}" for command in ("play", "pause", "play", "stop")]
    assert "simulation.step" not in within


def test_the_going_of_the_stepping_client_ends_its_step_and_another_one_s_takes_the_program_to_its_end(
    tmp_path,
):
    with lockstep(5, tmp_path / "run.mcap") as (served, host):
        with Wire(served.endpoint) as other, dashboard(host) as interface:
            other.listen("state", "event")
            with Wire(served.endpoint) as stepper:
                clock = take_clock(stepper)
                stepper.step(clock, 1)
                running(interface)
                assert interface.ask("load Q2.urp") == "Loading program: Q2.urp"
                assert interface.ask("play") == "Starting program"
                begin_step(stepper, clock, 100_000)
                other.until(100)
            while (info := other.info())["stepper"] is not None:
                pass
            assert info["control"].startswith("ur-")
            assert other.info()["tick"] == info["tick"] < 100_000
            clock = other.command("take_clock", client="other")["token"]
            other.step(clock, 3000)
            other.wait("event", lambda event: event["kind"] == "motion_done")
        assert served.end() == 0
    journal = replayed(tmp_path / "run.mcap").journal
    assert next(entry.client for entry in journal if entry.kind == "client_gone") == "stepper"


def test_unmodified_clients_of_ur_rtde_live_by_the_steps_of_another_client(tmp_path):
    pytest.importorskip("rtde_receive")
    from tests.system.test_ur_clients import Client, until

    path = tmp_path / "run.mcap"
    with lockstep(6, path) as (served, host), Wire(served.endpoint) as stepper:
        clock = take_clock(stepper)
        stepper.step(clock, 1)
        begin_step(stepper, clock, 100_000)
        with (
            Client("rtde_receive", "RTDEReceiveInterface", host) as receive,
            Client("rtde_io", "RTDEIOInterface", host) as setter,
            Client("dashboard_client", "DashboardClient", host) as interface,
        ):
            interface.connect()
            interface.loadURP(PAPER)
            interface.play()
            assert interface.running()
            interface.stop()
            until(interface.programState, f"STOPPED {PAPER}")
            assert setter.setStandardDigitalOut(1, True)
            until(lambda: receive.getDigitalOutState(1), wanted=True)
            assert receive.isConnected()
            assert served.end() == 0
    told = [entry.message["type"] for entry in replayed(path).journal if entry.kind == "command"]
    assert {"program.play", "program.stop", "set_io"} <= set(told)
    assert told.count("simulation.step") == 2
