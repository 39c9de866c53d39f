"""UR's interfaces in lockstep: one client steps the clock, and UR clients follow its steps."""

import socket
import struct
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from tests.conformance.served import NOT_REPEATED, PATIENCE, Served
from tests.conformance.wire import Wire
from tests.places import own_address
from tests.server.ur import decoders, rtde_client

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_server.ur_ports import WITHOUT_JOINTS, UrPorts

SEVEN = Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf"
BOOTED, TICK = 40.0, 0.002
FAR = [0.6, -2.9, 0.3, -1.4, 0.2, 0.4]
REALTIME_BYTES = 1220
READ = ("timestamp", "target_q", "shaped_q", "actual_q", "actual_tool_accelerometer", "runtime_state")


def timestamps(ticks):
    return [BOOTED + tick * TICK for tick in ticks]


class Connection:
    def __init__(self, host, port):
        self.socket = socket.create_connection((host, port), PATIENCE)
        self._stream = self.socket.makefile("rb")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._stream.close()
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def take(self, size):
        taken = self._stream.read(size)
        assert len(taken) == size, "the robot closed the connection"
        return taken

    def package(self, head):
        """Return the next package, which begins with its length of 16 or 32 bits."""
        length = self.take(struct.calcsize(head))
        return length + self.take(struct.unpack(head, length)[0] - len(length))

    def ask(self, line):
        self.send(f"{line}\n".encode())
        return self.line()

    def line(self):
        return self._stream.readline().decode().strip()


def dashboard(host):
    interface = Connection(host, 29999)
    assert interface.line().startswith("Connected")
    return interface


def rtde(host):
    """Return an RTDE client whose outputs are started at 500 Hz."""
    interface = Connection(host, 30004)
    requests = {"V": rtde_client.version(), "O": rtde_client.outputs(READ), "S": rtde_client.package("S")}
    for letter, request in requests.items():
        interface.send(request)
        ((answered, payload),) = rtde_client.packages(interface.package(">H"))
        assert (answered, payload[:1]) == (letter, b"\x01")
    return interface


@contextmanager
def lockstep(last, path, constants=None):
    how = ("--clock", "lockstep", "--profile", "real", "--start", "Q1", "--ur-address", own_address(last))
    with Served(*how, "--record", str(path), constants=constants) as served:
        yield served, own_address(last)


def running(interface):
    """Wait until the first state has reached the dashboard, so that the arm may move."""
    while interface.ask("robotmode") != "Robotmode: RUNNING":
        pass


def replayed(path):
    """Return a recording, which must replay to the last bit."""
    content = read(path)
    assert content.complete
    assert replay_file(content).first_difference is None
    return content


def told(state, name):
    """Return a value of a state by its name in UR's interfaces."""
    if name == "target_q":
        return state["unshaped_q"] or state["target_q"]
    return state[name.replace("shaped", "target")]


def test_rtde_and_real_time_interface_have_each_tick_once_with_the_values_of_zenoh(tmp_path):
    ticks = 1000
    with lockstep(1, tmp_path / "run.mcap", NOT_REPEATED) as (served, host):
        with (
            Wire(served.endpoint) as stepper,
            Wire(served.endpoint) as mover,
            rtde(host) as receive,
            Connection(host, 30003) as realtime,
            Connection(host, 30013) as read_only,
        ):
            clock = stepper.take("clock", "stepper")
            token = mover.command("take_control", client="mover")["token"]
            assert mover.command("move_j", token=token, q=FAR)["type"] == "accepted"
            stepper.listen("state")
            for number in (1, 2, 497, 500):
                stepper.step(clock, number)
            states = {state["tick"]: state for state in stepper.received["state"]}
            assert sorted(states) == list(range(1, ticks + 1))
            received = [rtde_client.decoded(receive.package(">H"), READ) for _ in range(ticks)]
            assert [sample["timestamp"] for sample in received] == timestamps(range(1, ticks + 1))
            for tick, sample in enumerate(received, 1):
                for name in READ[1:]:
                    assert sample[name] == told(states[tick], name), (tick, name)
            for interface in (realtime, read_only):
                times = []
                while not times or times[-1] < timestamps([ticks])[0]:
                    package = struct.unpack(">i152d", interface.take(REALTIME_BYTES))
                    times.append(package[1])
                    assert list(package[2:8]) == told(states[len(times)], "target_q")
                assert times == timestamps(range(1, ticks + 1))
        assert served.end() == 0
    replayed(tmp_path / "run.mcap")


def test_program_of_the_dashboard_ends_within_one_step_of_another_client(tmp_path):
    with (
        lockstep(3, tmp_path / "run.mcap", NOT_REPEATED) as (served, host),
        Wire(served.endpoint) as stepper,
        dashboard(host) as interface,
    ):
        clock = stepper.take("clock", "stepper")
        stepper.listen("event")
        assert interface.ask("robotmode") == "Robotmode: NO_CONTROLLER"
        stepper.step(clock, 1)
        running(interface)
        assert interface.ask("load Q2.urp") == "Loading program: Q2.urp"
        assert interface.ask("play") == "Starting program"
        assert stepper.info()["control"].startswith("ur-")
        stepper.begin("simulation.step", token=clock, ticks=100_000)
        stepper.wait("event", lambda event: event["kind"] == "motion_done")
        while interface.ask("running") != "Program running: false":
            pass
        assert served.end() == 0
    journal = replayed(tmp_path / "run.mcap").journal
    told = [(entry.tick, entry.message["type"]) for entry in journal if entry.kind == "command"]
    assert [tick for tick, kind in told if kind == "simulation.step"] == [1, 2]
    assert [tick for tick, kind in told if kind == "program.play"] == [2]
    assert "move_j" not in {kind for _, kind in told}  # a replay makes the moves of the program again
    started = [event["tick"] for event in stepper.received["event"] if event["kind"] == "motion_started"]
    assert started == [2]


def test_script_moves_the_arm_and_is_ended_by_the_next_one(tmp_path):
    with (
        lockstep(6, tmp_path / "run.mcap") as (served, host),
        Wire(served.endpoint) as stepper,
        Connection(host, 30001) as listener,
        Connection(host, 30002) as sender,
    ):

        def keys(count):
            """Return the next key messages in short, without other messages."""
            found = []
            while len(found) < count:
                package = listener.package(">i")
                told = decoders.message(package) if package[4] == 20 else None
                if told is not None and told.kind == 7:
                    title = told.values["title"].removeprefix("PROGRAM_XXX_")
                    found.append(f"{title} {told.values['text']}")
            return found

        clock = stepper.take("clock", "stepper")
        stepper.step(clock, 1)
        stepper.begin("simulation.step", token=clock, ticks=100_000)
        sender.send(b"def one():\n  sleep(100)\nend\ndef two():\n  movej([0.1, -3, 0, -1.6, 0, 0])\nend\n")
        assert keys(4) == ["STARTED one", "STOPPED one", "STARTED two", "STOPPED two"]
        sender.send(b"def bad():\n  calldoesntexist()\nend\n")
        served.wait_until_said("line 2, column 3: compile_error_name_not_found:calldoesntexist:")
        assert served.end() == 0
    content = replayed(tmp_path / "run.mcap")
    (motion,) = (event for event in content.events if event.kind == "motion_done")
    (state,) = (state for state in content.states if state.tick == motion.tick)
    assert (state.unshaped_q or state.target_q) == pytest.approx([0.1, -3, 0, -1.6, 0, 0], abs=1e-6)


def test_each_robot_has_its_own_interfaces_and_connections_do_not_delay_the_end():
    options = ("--robots", "ur5e*2", "--clock", "lockstep", "--ur", "--ur-address", own_address(8))
    with Served(*options, name=None) as served, ExitStack() as stack:
        first, second = (stack.enter_context(dashboard(own_address(last))) for last in (8, 9))
        assert first.ask("get serial number") != second.ask("get serial number")
        assert served.end() == 0


def test_arm_with_seven_joints_has_dashboard_and_interpreter_only():
    limited = [interface for interface in UrPorts().open() if interface not in WITHOUT_JOINTS]
    shut = [word for interface in limited for word in ("--ur-port", f"{interface}=off")]
    arm = ("--robot", str(SEVEN), "--calibration", "none", "--clock", "lockstep", "--profile", "real")
    options = (*arm, "--ur", "--ur-address", own_address(25))
    with (
        Served(*options, *shut, name="seven") as served,
        Wire(served.endpoint, "seven") as wire,
        dashboard(own_address(25)) as interface,
    ):
        clock = wire.take("clock", "stepper")
        wire.step(clock, 5)
        running(interface)
        assert interface.ask("load Q2.urp") == "Loading program: Q2.urp"
        assert interface.ask("play") == "Starting program"
        assert wire.step(clock, 5000)["actual_q"] == pytest.approx([0.5] * 7, abs=0.01)
