"""Moving a real robot, without a socket or a clock: claimed inputs, start checks, reasons of stops and periods."""

import contextlib
import math
import re
import struct
from dataclasses import replace
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import UR5E, Robot
from tests.examples import examples
from tests.server.test_watching import set_up

from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.kinematics.arm import Arm
from tvist_plant.description import Payload, load
from tvist_plant.drives import DriveCommand
from tvist_plant.foreign import called
from tvist_plant.plant import PERIOD, Measurement, RobotReport
from tvist_protocol import commands as c
from tvist_protocol.codec import decode, encode
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.stream import State
from tvist_server.gateways.ur.primary.packages import robot_state
from tvist_server.moving import program as r
from tvist_server.moving.checks import (
    Expected,
    halt_by_modes,
    halt_by_program,
    mounting_trouble,
    tells_gravity,
    version_trouble,
    why_not_by_answers,
    why_not_by_state,
)
from tvist_server.moving.interfaces import (
    Configuration,
    NoAnswerError,
    configuration_in,
    narrow_limits,
    query,
)
from tvist_server.moving.moved_robot import SILENT, ControlPeriods, MovedRobot
from tvist_server.moving.program import ProgramEnded
from tvist_server.moving.run import ProgramRun, Upload
from tvist_server.rtde.client import RtdeClient
from tvist_server.rtde.codec import PackageKind, package
from tvist_server.watching.address import place_of
from tvist_server.watching.connection import RtdeConnection
from tvist_server.watching.variables import NEEDED, OPTIONAL

Q = np.array([0.3, -1.2, 1.5, -1.8, -1.5, 0.2])
GOOD = RobotReport(
    1, Measurement(Q, np.zeros(6), np.zeros(6), np.zeros(3)), np.array([Q, *np.zeros((3, 6))]),
    (RobotMode.RUNNING, SafetyMode.NORMAL, RuntimeState.STOPPED), 1.0, 0,
    payload=Payload(mass=5.0), tool=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0),
)  # fmt: skip
EXPECTED = Expected(UR5E, Payload(mass=5.0))
PLAYING = replace(GOOD, modes=(7, 1, RuntimeState.PLAYING))
FAR = place_of("ur://127.0.0.1:9")


@pytest.fixture(scope="module")
def sent():
    """Package of a simulated robot's primary interface."""
    controller = Robot().controller
    return robot_state(UR5E, Instruments(UR5E).snapshot(controller.latest, controller.io()))


def test_the_configuration_of_a_simulated_robot_matches_its_file(sent):
    own = configuration_in(sent)
    assert own.is_of(UR5E)
    assert not own.is_of(load("ur10e"))
    for name in ("velocity", "acceleration"):
        assert getattr(own, name) == pytest.approx(getattr(UR5E.limits, name))
    assert own.most == pytest.approx(UR5E.limits.position)
    assert own.least == pytest.approx(-own.most)


@examples(40)
@given(st.integers(0, 1385), st.binary(max_size=40))
def test_a_configuration_is_found_once_it_is_complete(sent, cut, other):
    message = struct.pack(">iB", 5 + len(other), 20) + other
    assert configuration_in(message + sent) is not None
    assert configuration_in(message + sent[:cut]) is None


@examples(40)
@given(st.floats(0.05, 3.2), st.lists(st.floats(0.1, 6.0), min_size=24, max_size=24))
def test_limits_are_the_narrowest_of_robot_file_robot_and_speed_cap(cap, own):
    least, most, velocity, acceleration = np.array(own).reshape(4, 6)
    robot = Configuration(-least, most, velocity, acceleration, *np.zeros((3, 6)))
    limits, file = narrow_limits(UR5E, robot, cap).limits, UR5E.limits
    for j in range(6):
        assert limits.position[j] == min(file.position[j], least[j], most[j])
        assert limits.velocity[j] == min(file.velocity[j], velocity[j], cap)
        assert limits.acceleration[j] == min(file.acceleration[j], acceleration[j])
    assert narrow_limits(UR5E, None, cap).limits.position == file.position


def turned(joint, by, target=Q):
    q = target.copy()
    q[joint] += by
    return q


OFF, REDUCED = (RobotMode.POWER_OFF, SafetyMode.NORMAL, 1), (RobotMode.RUNNING, SafetyMode.REDUCED, 1)
LIMITED = narrow_limits(UR5E, Configuration(*np.full((7, 6), 1.0)), 0.5)


@pytest.mark.parametrize(
    ("changes", "wanted", "words"),
    [
        ({"modes": OFF}, {}, "mode is POWER_OFF: switch it on"),
        ({"modes": REDUCED}, {}, "safety mode is REDUCED"),
        ({"modes": (RobotMode.RUNNING, 77, 1)}, {}, "safety mode is 77"),
        ({"modes": PLAYING.modes}, {}, "a program runs on it"),
        ({"modes": (RobotMode.DISCONNECTED, SafetyMode.NORMAL, 1)}, {}, "not connected"),
        ({"target": np.array([Q, turned(2, 0.1, np.zeros(6)), *np.zeros((2, 6))])}, {}, "it moves"),
        ({"target": np.array([turned(3, 0.011), *np.zeros((3, 6))])}, {}, "joint 3 is 0.011 rad from where"),
        ({"payload": Payload(mass=4.9)}, {}, "payload is set to 4.9 kg, and here it is 5 kg"),
        ({}, {}, None),
        ({}, {"q": tuple(turned(1, 0.009))}, None),
        ({}, {"q": tuple(turned(1, 0.02))}, "--start says"),
        ({}, {"tool": GOOD.tool}, None),
        ({}, {"tool": (0.0, 0.0, 0.2, 0.0, 0.0, 0.0)}, "--tcp says 0,0,0.2"),
        ({}, {"description": LIMITED}, "beyond"),
    ],
)
def test_a_robot_is_moved_only_in_a_suitable_state_that_agrees_with_the_options(changes, wanted, words):
    trouble = why_not_by_state(EXPECTED._replace(**wanted), replace(GOOD, **changes))
    assert trouble is None if words is None else words in trouble


def test_missing_answers_of_a_robot_are_no_reason_not_to_move_it(sent):
    own = configuration_in(sent)
    assert why_not_by_answers(EXPECTED, {}, None) is None
    good = {"get robot model": "UR5", "is in remote control": "true"}
    assert why_not_by_answers(EXPECTED, good, own) is None
    assert "it is a UR10" in why_not_by_answers(EXPECTED, {"get robot model": "UR10"}, own)
    assert "local control" in why_not_by_answers(EXPECTED, {"is in remote control": "false"}, own)
    for wrong in (math.nan, 1e-9):
        slow = own._replace(velocity=np.full(6, wrong))
        assert "largest velocities" in why_not_by_answers(EXPECTED, {}, slow)
    other = EXPECTED._replace(description=load("ur10e"))
    assert "dimensions are not those of a UR10e" in why_not_by_answers(other, {}, own)


def test_the_accelerometer_detects_a_robot_that_is_not_upright():
    rotation, _ = Arm(UR5E).pose(Q)
    for leaning, told in ((0.0, False), (0.1, False), (0.2, True), (np.pi, True)):
        felt = rotation.T @ (9.6 * np.array([np.sin(leaning), 0.0, np.cos(leaning)]))
        assert tells_gravity(felt)
        assert (mounting_trouble(UR5E, Q, felt) is not None) == told
    assert not tells_gravity(np.zeros(3))


def test_each_stop_of_a_robot_has_its_own_reason():
    playing = RobotMode.RUNNING, SafetyMode.NORMAL, RuntimeState.PLAYING
    assert halt_by_modes(playing) is None
    assert halt_by_program(ProgramEnded.NOT, playing) is None
    reasons = {halt_by_program(ended, playing).why for ended in ProgramEnded if ended}
    reasons |= {halt_by_program(ProgramEnded.NOT, (7, 1, runtime)).why for runtime in (1, 4)}
    reasons |= {halt_by_modes((7, safety, 1)).why for safety in SafetyMode if safety not in {1, 2}}
    reasons |= {halt_by_modes((mode, 1, 1)).why for mode in RobotMode if mode != 7}
    assert len(reasons) == len(ProgramEnded) - 1 + 2 + len(SafetyMode) - 2 + len(RobotMode) - 1
    assert all("here" in why for why in reasons)
    assert halt_by_modes((7, 3, 4)).safety_mode == SafetyMode.PROTECTIVE_STOP


@examples(40)
@given(st.lists(st.tuples(st.integers(0, 6), st.floats(0.0, 0.3)), max_size=60), st.sampled_from([1, 4]))
def test_periods_follow_the_robots_clock_or_the_local_one_during_silence(gaps, interval):
    """Rows come late and in bunches; each of the robot's periods is computed exactly once."""
    pace, now, tick = ControlPeriods(), 10.0, 5000
    pace.row(tick, now)
    first = pace.tick
    while pace.next(now):
        pass
    for missed, wait in gaps:
        own, until = 0, now + wait
        while now < until:
            now = min(until, now + max(pace.until(now), 1e-4))
            own += pace.next(now)
        assert own == 0 or wait > SILENT - 1e-9  # sums of times are rounded
        assert own <= max(0.0, wait - SILENT) / 0.002 + 3
        tick += interval * (1 + missed)
        before, begun = pace.tick, pace.row(tick, now)
        assert begun == (tick > before)
        while pace.next(now):
            pass
        assert pace.tick == max(tick, before)
        assert pace.owed == 0
    assert pace.tick >= first


class Written:
    """A robot that keeps what is written to it, with registers that the test sets."""

    def __init__(self):
        self.newest = {"target_q": tuple(Q)} | dict.fromkeys(r.OUTPUTS, (0,))
        self.written = []

    def write(self, numbers):
        self.written.append(tuple(numbers))

    def says(self, place, number):
        self.newest[f"output_int_register_{place}"] = (number,)


@pytest.fixture
def new_run(monkeypatch):
    """A run whose program has not started, and its robot."""
    nothing = SimpleNamespace(trouble=None, close=lambda: None)
    monkeypatch.setattr("tvist_server.moving.run.Upload", lambda *_: nothing)
    robot = Written()
    return ProgramRun(robot, FAR, 7, UR5E.limits, None, lambda: None), robot


@pytest.fixture
def running(new_run):
    """A run whose program waits for the first set-point, and its robot."""
    run, robot = new_run
    robot.says(r.RUN, 7)
    robot.says(r.STATE, r.ProgramState.WAITING)
    for _ in range(50):
        run.take(PLAYING)
    return run, robot


@pytest.mark.parametrize("interval", [1, 4])
def test_each_period_of_the_robot_gets_one_set_point(running, interval):
    run, robot = running
    assert robot.written == [(0,) * len(r.INPUTS)]
    run.add(DriveCommand(Q + 1.0, np.zeros(6), np.zeros(6)), played=True)
    run.write()
    assert robot.written[-1] == (1, 7, *(4 * tuple(Q)))
    robot.says(r.STATE, r.ProgramState.FOLLOWING)
    run.take(PLAYING)
    assert not run.ready, "a command that comes before the next tick is of before it followed"
    run.add(DriveCommand(Q + 1.0, np.zeros(6), np.zeros(6)), played=False)
    assert run.ready
    assert run.last == tuple(Q)
    for tick in range(1, 9):
        q = Q + 1e-4 * tick
        run.add(DriveCommand(q, np.zeros(6), np.zeros(6)), played=tick % interval == 0)
    run.write()
    number, order, *angles = robot.written[-1]
    assert (number, order) == (1 + 8 // interval, 7)
    assert angles[:6] == pytest.approx(Q + 8e-4)
    assert angles[6:12] == pytest.approx(Q + 1e-4 * (8 - interval))
    run.end()
    assert robot.written[-1][1] == -7


def test_a_stopped_program_is_reported_within_20_ms(running):
    run, _ = running
    for _ in range(10):
        run.take(replace(PLAYING, modes=(7, 1, RuntimeState.STOPPED)))
    assert "its program was stopped at the robot" in run.halt.why


def test_registers_of_an_earlier_run_are_ignored(new_run):
    run, robot = new_run
    robot.says(r.RUN, 6)
    robot.says(r.STATE, r.ProgramState.FOLLOWING)
    robot.says(r.ENDED, ProgramEnded.SILENCE)
    for _ in range(50):
        run.take(PLAYING)
    assert run.halt is None
    assert not run.ready


@pytest.mark.parametrize("how", ["a run of ours", "any program"])
def test_a_program_that_replaces_the_running_one_is_detected(running, how):
    """Another program does not change the registers that ours has left, and the robot reports PLAYING."""
    run, robot = running
    robot.says(r.STATE, r.ProgramState.FOLLOWING)
    for number in range(50):
        other = number >= 30
        robot.says(r.PLAYED, 29 if other and how == "any program" else number)
        robot.says(r.RUN, 8 if other and how == "a run of ours" else 7)
        run.take(PLAYING)
        assert other or run.halt is None
    assert "another program has replaced the one that follows set-points" in run.halt.why
    assert not run.ready


def test_a_robot_with_old_software_is_not_moved():
    assert all(version_trouble(version) is None for version in ((3, 15, 8), (5, 9), (10, 1)))
    for version in ((3, 13), (4, 20), (5, 8, 2)):
        assert "update it to 5.9 or later" in version_trouble(version)


@pytest.mark.parametrize(("cap", "most"), [(0.05, 5.0), (3.2, 25.6), (10.0, 40.0)])
def test_the_program_brakes_within_125_ms_and_within_the_limits(monkeypatch, cap, most):
    texts = []
    monkeypatch.setattr("tvist_server.moving.run.Upload", lambda _, text, __: texts.append(text))
    limits = msgspec.structs.replace(UR5E.limits, velocity=6 * (cap,))
    ProgramRun(Written(), FAR, 7, limits, None, lambda: None)
    assert f"stopj({most})" in texts[0]


def test_a_program_is_sent_only_to_a_robot_without_one(monkeypatch):
    sent = []
    connection = contextlib.nullcontext(SimpleNamespace(sendall=sent.append))
    monkeypatch.setattr("tvist_server.moving.run.query_dashboard", lambda *_: {})
    monkeypatch.setattr("socket.create_connection", lambda *_: connection)
    upload = Upload(FAR, "def nothing():\nend\n", lambda: "a program runs on it")
    upload.thread.join(10.0)
    assert upload.trouble == "a program runs on it"
    assert sent == []


TEXT = package(PackageKind.TEXT_MESSAGE, b"\x06\x1b[2J\nX\x00\x03")
FIELDS = {**NEEDED, **r.OUTPUTS, **OPTIONAL}
DOUBLES = [name for name, field in FIELDS.items() if field.wire.value.endswith("d")]
STANDS = {name: (0,) * field.wire.length for name, field in FIELDS.items()} | {
    "actual_TCP_pose": tuple(Arm(UR5E).motion(Q, np.zeros(6))[:6]), "robot_mode": (7,), "safety_mode": (1,),
    "payload": (5.0,), "speed_scaling": (1.0,), "target_speed_fraction": (1.0,),
}  # fmt: skip


def packed(row, recipe=1):
    values = [struct.pack(f">{field.wire.value}", *row[name]) for name, field in FIELDS.items()]
    return package(PackageKind.DATA, bytes([recipe]) + b"".join(values))


class Far:
    """A robot in simulated time that stands in for socket and selector; `spoil` encodes its rows."""

    def __init__(self, patch):
        self.now, self.written, self.spoil, self.close = 50.0, [], packed, lambda: None
        times = SimpleNamespace(monotonic=self.passed, sleep=self.passed, monotonic_ns=lambda: 1)
        for module in ("watching.connection", "watching.watched_robot", "moving.moved_robot", "moving.run"):
            patch.setattr(f"tvist_server.{module}.time", times)
        patch.setattr("tvist_server.moving.run.Upload", self.upload)
        patch.setattr("tvist_server.watching.watched_robot.RtdeConnection", lambda *_: self.connected())

    def passed(self, duration=1e-7):
        self.now += duration
        return self.now

    def connected(self):
        self.run, self.number, self.q = 0, 0, tuple(Q)
        client, link = RtdeClient(FIELDS, {}, r.INPUTS), object.__new__(RtdeConnection)
        wires = [field.wire for field in FIELDS.values()], r.INPUTS.values()
        set_up(client, *(",".join(wire.name for wire in one).encode() for one in wires))
        client.receive(package(PackageKind.START, b"\x01"))
        vars(link).update(client=client, _socket=self, _selector=self, _place=FAR, texts=[])
        vars(link).update(_heard=self.now, _newest=-1, _connected=True, _rest=b"")
        return link

    def send(self, data):
        number, order, *angles = struct.unpack(">ii24d", data[4:]) if data else (0, 0)
        self.run = self.run if order in {0, self.run} else 0
        if self.run and number:
            self.written.append(angles)
            self.number, self.q = number, tuple(angles[:6])
        return len(data)

    def select(self, timeout):
        return timeout > 0.0 and self.passed(PERIOD) > 0.0

    def recv(self, _):
        said = {r.RUN: self.run, r.STATE: 2 if self.number else 1, r.PLAYED: self.number}
        row = STANDS | {f"output_int_register_{place}": (value,) for place, value in said.items()}
        row |= {"timestamp": (self.now,), "runtime_state": (2 if self.run else 1,)}
        return self.spoil(row | {"target_q": self.q, "actual_q": self.q})

    def upload(self, _, text, __):
        self.run = int(re.search(rf"register\({r.RUN}, (\d+)\)", text)[1])
        return SimpleNamespace(trouble=None, close=lambda: None)


SPOILT = [
    ("to 1e+06 s", {"timestamp": (1e6,)}),
    ("to 3 s", {"timestamp": (3.0,)}),
    ("no new row for 1 s", {"timestamp": (51.0,)}),
    ("no new row for 1 s", TEXT),
    ("no new row for 1 s", packed(STANDS, recipe=2)),
    ("more texts of the robot are left out", {}),
    ("target_speed_fraction is -1: must be 0 to 1", {"target_speed_fraction": (-1.0,)}),
    *[(f"{name} is nan: must be", {name: (math.nan,) * len(STANDS[name])}) for name in DOUBLES],
]


@pytest.mark.parametrize(("said", "wrong"), SPOILT, ids=[said for said, _ in SPOILT])
def test_invalid_rows_are_reported_and_set_points_stay_within_limits(monkeypatch, said, wrong):
    far = Far(monkeypatch)
    plant = called(MovedRobot(FAR, UR5E, Payload(mass=5.0), speed_cap=0.5), 6)
    robot = Robot(plant=plant)
    for tick in range(660 if "1 s" in said or "left out" in said else 160):
        if tick == 60:
            robot.send(c.MoveJ, q=tuple(Q + 0.2), velocity=0.4)
        elif tick == 120:
            far.spoil = lambda row: wrong if isinstance(wrong, bytes) else packed(row | wrong) + 50 * TEXT
        if plant.wait(0.1):
            robot.tick()
    told = [event.why for event in robot.events if event.why]
    assert any(said in why for why in told)
    assert len(told) < 60
    assert all(why.isprintable() for why in told)
    assert all(decode(State, encode(state)) for state in robot.states)  # which bounds each number
    sent = np.reshape(far.written, (-1, 4, 6))
    assert (np.abs(sent) <= UR5E.limits.position).all()
    assert 1e-4 < np.abs(np.diff(sent, axis=1)).max() <= 0.5 * PERIOD * (1 + 1e-9)


def test_a_query_has_one_deadline_even_if_bytes_keep_arriving(monkeypatch):
    times = iter(np.arange(0.0, 9.0, 0.1))
    monkeypatch.setattr("tvist_server.moving.interfaces.time", SimpleNamespace(monotonic=lambda: next(times)))
    slow = SimpleNamespace(sendall=len, settimeout=float, recv=lambda _: b"x")
    monkeypatch.setattr("socket.create_connection", lambda *_: contextlib.nullcontext(slow))
    with pytest.raises(NoAnswerError, match="no answer within 2 s"):
        query(FAR, b"", lambda _: None)
