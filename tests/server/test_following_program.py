"""The program that follows set-points: exact on a good link, smooth on a bad one, at rest without one."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.controller.robots import NoArm, Robot
from tests.controller.scripts import URSIM
from tests.examples import examples

from tvist_controller.programs.compiling import check_program
from tvist_controller.programs.library import known_signatures
from tvist_controller.programs.player import GUIDED
from tvist_protocol.commands import UnlockProtectiveStop
from tvist_protocol.io import Registers, SetRegisters
from tvist_protocol.programs import ProgramPause, ProgramPlay, ProgramRun
from tvist_protocol.simulation import SimulationInject
from tvist_server.moving import program as r
from tvist_server.moving.program import CLOSE, MARGIN, Window, program
from tvist_urscript import EVALUATIONS, Array, Machine, compile_script

H, RUN = 0.002, 71
HERE = np.array(URSIM)
PATIENCE = 20
"""Periods of 2 ms within which braking has to begin."""
LAG = 17
"""Periods by which the arm of a program alone follows `servoj`."""
BACK = 1.1 * CLOSE / H**2
"""Acceleration with which the rest of a distance from the set-points is made up for [rad/s²]."""
GIVEN = {"speed": 0.5, "deceleration": 4.0}
DOCUMENTED = {
    *("get_steptime", "sync", "pow", "norm", "servoj", "stopj", "get_target_joint_positions", "textmsg"),
    *("read_input_integer_register", "read_input_float_register", "write_output_integer_register"),
}
"""Functions in UR's manuals of software 3.14 and 5.9, which also compute with lists."""


class Followed:
    """Record of what the program does.

    Attributes:
        told: What `servoj` was told, one posture a call, and the tick of each.
        numbers: The number that the program said in each of these ticks.
        alone: The number of periods without a set-point that it said then.
    """

    def __init__(self, speed, deceleration, step):
        self.speed, self.most, self.tick = speed, MARGIN * speed * step, 0
        self.told, self.at, self.numbers, self.alone = [], [], [], []
        self.text = program(RUN, speed=speed, deceleration=deceleration)
        if step != H:
            self.text = self.text.replace("get_steptime()", str(step))

    def steps(self, count=1):
        for _ in range(count):
            before = len(self.told)
            self._step()
            self.tick += 1
            if len(self.told) > before:
                self.numbers.append(self.output(r.PLAYED))
                self.alone.append(self.output(r.ALONE))

    def _tell(self, q):
        self.told.append(np.array(q.items))
        self.at.append(self.tick)

    def play(self, packages, arrivals):
        """Write the packages that arrive in each tick, given by their indices."""
        for come in arrivals:
            for place in come:
                self.write(*packages[place])
            self.steps()

    def until_ended(self, most=2000):
        for _ in range(most):
            self.steps()
            if self.state is r.ProgramState.ENDED:
                return self
        raise AssertionError("it goes on")

    @property
    def state(self):
        return r.ProgramState(self.output(r.STATE))

    @property
    def ended(self):
        return r.ProgramEnded(self.output(r.ENDED))

    def assert_kept(self, last_came):
        """Check what holds for any input; `last_came` is the tick of the last new number."""
        assert (np.diff(self.at) == 1).all(), "a period in which it tells `servoj` nothing holds the arm back"
        told = np.array([HERE, *self.told])
        assert np.abs(np.diff(told, axis=0)).max(initial=0.0) <= self.most * (1 + 1e-9)
        played = np.array(self.numbers)[np.diff([0, *self.alone]) == 0]
        assert set(np.diff([0, *self.alone])) <= {0, 1}
        if len(played):
            assert self.output(r.LEFT_OUT) == played[-1] - played[0] + 1 - len(set(played))
        assert (np.diff(played) >= 0).all()
        if self.state is r.ProgramState.ENDED:
            assert self.ended is not r.ProgramEnded.NOT
            assert not self.at or self.at[-1] < last_came + PATIENCE


class OnRobot(Followed):
    """The program on a robot without an arm."""

    def __init__(self, *, speed=0.5, deceleration=4.0):
        super().__init__(speed, deceleration, H)
        self.robot = Robot(plant=NoArm(), q=URSIM, shaper="none")
        functions = self.robot.controller.programs._functions
        servoj = functions["servoj"]

        def listening(q, *others):
            self._tell(q)
            yield from servoj(q, *others)

        functions["servoj"] = listening
        self.robot.send(ProgramRun, text=self.text)
        self.steps(2)

    def _step(self):
        self.robot.tick()

    def write(self, n, order, *doubles):
        also = (Registers(bank="input_double", first=r.SETPOINTS, values=tuple(map(float, doubles))),)
        ints = {"bank": "input_int", "first": r.NUMBER, "values": (int(n), int(order))}
        self.robot.send(SetRegisters, **ints, also=also, token=None)

    def output(self, place):
        return self.robot.controller.io().output_int_register[place]

    @property
    def targets(self):
        return np.array([state.target_q for state in self.robot.states])

    def assert_kept(self, last_came):
        super().assert_kept(last_came)
        limits = self.robot.controller.cycle.description.limits
        speeds = np.diff(self.targets, axis=0) / H
        assert np.abs(speeds).max() <= MARGIN * self.speed * (1 + 1e-6)
        assert np.abs(np.diff(speeds, axis=0) / H).max() <= min(limits.acceleration) * (1 + 1e-6)
        if self.state is r.ProgramState.ENDED:
            assert (speeds[-1] == 0.0).all()
            assert self.robot.controller.programs.state != "PLAYING"


class Alone(Followed):
    """The program with registers alone, on an arm that follows `lag` periods later."""

    def __init__(self, *, speed=0.5, deceleration=4.0, before=None, lag=LAG, step=H):
        super().__init__(speed, deceleration, step)
        self._ints, self._doubles, self._outputs = [0] * 48, [0.0] * 48, [0] * 48
        functions = {
            "get_steptime": lambda: H,
            "sync": lambda: iter([None]),
            "read_input_integer_register": lambda place: self._ints[place],
            "read_input_float_register": lambda place: self._doubles[place],
            "write_output_integer_register": self._outputs.__setitem__,
            "get_target_joint_positions": lambda: Array(tuple(([HERE] * lag + self.told)[-lag].tolist())),
            "servoj": self._servoj,
            "stopj": lambda _: iter([None] * 5),
            "textmsg": lambda *_: None,
        }
        self._machine = Machine(compile_script(self.text, known_signatures()), functions)
        if before is not None:
            self.write(*before)
        self.steps(2)

    def _servoj(self, q, *_):
        self._tell(q)
        yield

    def _step(self):
        if self._machine.running:
            self._machine.resume(EVALUATIONS - GUIDED)

    def write(self, n, order, *doubles):
        self._ints[r.NUMBER], self._ints[r.ORDER] = int(n), int(order)
        self._doubles[r.SETPOINTS :] = map(float, doubles)

    def output(self, place):
        return self._outputs[place]


def packages(path, count, order=RUN, before=0):
    """Return the input packages of the first `count` rows of a path, numbered from `before` + 1."""
    window, made = Window(), []
    window.number = before
    for row in path[:count]:
        window.add(tuple(row))
        made.append(window.values(order))
    return made


def swings(count, speed, *, rest=30, h=H):
    """Return postures that rest, then swing up to a speed [rad/s], shape (count, 6)."""
    passed = np.maximum(np.arange(count) - rest, 0) * h
    return HERE + np.outer(speed / 4.0 * np.sin(4.0 * passed) ** 2, (1.0, -0.15, 0.1, 0.2, 0.3, -1.0))


def late(random, count, *, base=1.0, jitter=0.6, stalls=0.0, longest=12):
    """Return the packages that arrive in each tick; a stall of up to `longest` ticks holds up all later ones."""
    arrivals, free = [[] for _ in range(count + int(base + jitter) + longest + 3)], 0.0
    for k in range(count):
        if random.random() < stalls:
            free = max(free, k + base + random.integers(2, longest + 1))
        free = max(free, k + base + jitter * random.uniform(-1.0, 1.0))
        arrivals[int(np.ceil(free))].append(k)
    return arrivals


def of_path(path, numbers):
    """Return set-points by their numbers; number 0 stands for the first one."""
    return path[np.maximum(np.array(numbers) - 1, 0)]


def followed(path, arrivals, count, kind=Alone, **changes):
    """Return a program that has received packages of a path, and the last tick with one."""
    robot = kind(**changes)
    begun = robot.tick
    robot.play(packages(path, count), arrivals)
    return robot, begun + max(tick for tick, come in enumerate(arrivals) if come)


def test_the_program_compiles_and_calls_only_documented_functions():
    text = program(1, **GIVEN)
    assert check_program(text) == []
    code = re.sub(r"#.*", "", text)
    calls = set(re.findall(r"(\w+)\(", code)) - {"tvist_follow", "setpoint", "if", "while"}
    assert calls == DOCUMENTED
    assert not re.search(r"\$|[^\x00-\x7f]", text)


@pytest.mark.parametrize(
    ("name", "value"), [("run", 0), ("run", 2**31), ("speed", 0.0), ("deceleration", float("nan"))]
)
def test_invalid_parameters_of_the_program_are_refused(name, value):
    with pytest.raises(ValueError, match=f"^{name} is .*: must be"):
        program(**{"run": 1, **GIVEN, name: value})


def test_the_wrap_of_set_point_numbers_changes_nothing():
    arrivals = late(np.random.default_rng(1), 200, jitter=1.4, stalls=0.02, longest=6)
    runs = Alone(), Alone()
    for robot, before in zip(runs, (0, r.MAX_NUMBER - 100), strict=True):
        robot.play(packages(swings(200, 0.4), 200, before=before), arrivals[:200])
    first, second = (str((run.told, run.at, run.alone, run.output(r.LEFT_OUT), run.state)) for run in runs)
    assert first == second
    assert runs[1].numbers[-1] < 200 < runs[1].numbers[0]


@examples(20)
@given(seed=st.integers(0, 2**31), speed=st.floats(0.05, 3.0), jitter=st.floats(0.0, 0.99))
def test_on_a_good_link_every_set_point_is_played_exactly(seed, speed, jitter):
    """The program waits one period for packages that come up to a period early or late."""
    path = swings(600, 0.99 * speed)
    arrivals = late(np.random.default_rng(seed), 560, base=1.0, jitter=jitter / 2)
    robot, last = followed(path, arrivals[:560], 560, speed=speed)
    assert robot.state is r.ProgramState.FOLLOWING
    np.testing.assert_allclose(robot.told, of_path(path, robot.numbers), rtol=0.0, atol=1e-9)
    assert np.diff(robot.numbers[40:]).tolist() == [1] * (len(robot.numbers) - 41)
    robot.until_ended().assert_kept(last)
    assert robot.ended is r.ProgramEnded.SILENCE


@examples(30)
@given(seed=st.integers(0, 2**31), speed=st.floats(0.1, 2.5))
def test_on_a_bad_link_deviations_are_smooth_and_decay(seed, speed):
    """Packages are late by up to 12 periods, repeated, or lost."""
    random, count = np.random.default_rng(seed), 400
    jitter, stalls, repeated, left_out = random.uniform(0.0, [2.0, 0.05, 0.3, 0.05])
    path = swings(count + 400, 0.9 * speed)
    arrivals = [
        [place for place in come for _ in range(2 if random.random() < repeated else 1)]
        for come in late(random, count, jitter=jitter, stalls=stalls)
    ]
    arrivals = [[place for place in come if random.random() >= left_out] for come in arrivals]
    robot = Alone(speed=speed)
    robot.play(packages(path, count + 300), [*arrivals[:count], *([count + k] for k in range(250))])
    assert robot.state is r.ProgramState.FOLLOWING, robot.ended
    told, own = np.array(robot.told), of_path(path, robot.numbers)
    ways, own_ways = np.diff(told, axis=0), own[1:] - of_path(path, np.array(robot.numbers[1:]) - 1)
    assert np.abs(ways - own_ways).max() <= 2e-3
    assert np.abs(np.diff(ways, axis=0)).max() / H**2 <= 25.0 * speed + BACK
    fades = np.abs(told - own).max(axis=1)
    assert fades.max() <= 0.05 * speed
    assert fades[-1] <= 1e-3 * speed
    last = robot.tick
    robot.until_ended().assert_kept(last)


def garbled(random, package, wildness):
    package = list(package)
    if random.random() < 0.01:
        at = random.integers(2, len(package))
        package[at:] = [random.choice([package[at], wildness, np.nan, np.inf, -1e300])] * (len(package) - at)
    if random.random() < 0.01:
        package[0] = int(np.clip(package[0] + random.integers(-1000, 1000), -(2**31), 2**31 - 1))
    if random.random() < 0.002:
        package[1] = random.integers(-3, 3)
    return package


@examples(30)
@given(seed=st.integers(0, 2**31), speed=st.floats(0.1, 3.0), wildness=st.sampled_from([1e-3, 0.1, 5.0]))
def test_garbled_packages_never_exceed_the_limits_and_the_arm_ends_at_rest(seed, speed, wildness):
    """Every fourth case runs on a whole robot."""
    random, count = np.random.default_rng(seed), 300
    path = swings(count, 0.9 * speed)
    robot = (Alone if seed % 4 else OnRobot)(speed=speed)
    sent = packages(path, count)
    newest, last = 0, robot.tick
    for come in late(random, count, jitter=random.uniform(0.0, 3.0), stalls=0.02):
        for place in come:
            package = garbled(random, sent[place], wildness)
            robot.write(*package)
        if come and (package[0] > newest or len(robot.told) < 2):  # it waits for any other number at first
            newest, last = package[0], robot.tick
        robot.steps()
    robot.until_ended().assert_kept(last)
    calls = len(robot.told)
    robot.play(sent, [[place] for place in range(100)])
    assert len(robot.told) == calls


@pytest.mark.parametrize(("speed", "moment"), [(3.0, 3), (0.2, 201), (3.0, 305)])
def test_the_program_brakes_within_40_ms_of_the_last_set_point(speed, moment):
    path = swings(400, speed)
    arrivals, how = [[k] for k in range(moment)], {"speed": speed, "deceleration": 20.0}
    robot, last = followed(path, arrivals, moment, OnRobot, **how)
    before = np.abs(robot.targets[-1] - robot.targets[-2]).max()
    robot.until_ended(600)
    assert robot.ended is r.ProgramEnded.SILENCE
    assert robot.at[-1] < last + PATIENCE
    robot.assert_kept(last)
    ways = np.abs(np.diff(robot.targets, axis=0)).max(axis=1)
    assert (np.diff(ways[last + PATIENCE :]) <= 1e-12).all()
    assert robot.output(r.ALONE) >= 15
    assert before <= robot.most


LATE = (
    "1211221001222311123234223212231223223432122212112221232231223121221223122112221223222221112122321211210"
)
"""Periods by which packages are late on a bad link, one a digit."""


@pytest.mark.parametrize(("speed", "share"), [(0.05, 0.97), (2.5, 1.0)])
def test_joints_at_the_speed_limit_catch_up_after_a_bad_link(speed, share):
    """They catch up because the program may be a little faster than the set-points; the robot has 125 Hz."""
    count, step = 400, 0.008
    speeds = np.clip((np.arange(count) - 8) * step * 40.0 * speed, 0.0, share * speed)
    path = HERE + np.outer(np.cumsum(speeds) * step, (1.0, -0.15, 0.1, 0.2, 0.3, -1.0))
    newest = np.maximum.accumulate([k - int(by) for k, by in enumerate(LATE)]).tolist()
    arrivals = [[place] if place >= 0 else [] for place in [*newest, *range(len(LATE), count)]]
    robot, _ = followed(path, arrivals, count, speed=speed, step=step)
    assert robot.state is r.ProgramState.FOLLOWING
    off = np.abs(np.array(robot.told) - of_path(path, robot.numbers)).max(axis=1)
    assert off[len(LATE) + 10 :].max() <= off[: len(LATE) + 10].max()
    assert off[-1] <= 1e-9


@pytest.mark.parametrize("lost", [3, 17])
def test_lost_periods_shift_the_motion_in_time(lost):
    path = swings(1000, 0.45)
    robot, _ = followed(path, [[k] for k in range(200)], 600)
    robot.play(packages(path, 600), [*([] for _ in range(lost)), *([200 + k] for k in range(400))])
    told, numbers = np.array(robot.told), np.array(robot.numbers)
    assert robot.state is r.ProgramState.FOLLOWING
    assert robot.tick - 2 - lost - 2 <= numbers[-1] <= robot.tick - lost
    assert np.abs(told - of_path(path, numbers))[-1].max() <= 1e-6
    assert robot.output(r.ALONE) <= 2 * lost + 4


@pytest.mark.parametrize(
    ("come", "change", "why"),
    [
        ((150, 151, 152), {1: 0}, r.ProgramEnded.ORDERED),
        ((150, 151, 152), {1: -1}, r.ProgramEnded.ORDERED),
        ((150, 151, 152), {0: 3}, r.ProgramEnded.LOST),
        ((150, 151, 152), {0: 190}, r.ProgramEnded.LOST),
        ((150, 151, 152), {12: float("nan")}, r.ProgramEnded.TOO_FAST),
        ((150, 151, 152), {8: 0.3, 14: 0.3, 20: 0.3, 2: 0.3}, r.ProgramEnded.TOO_FAST),
        *[
            ((None, None, None, 154), dict.fromkeys(range(14, 20), wrong), r.ProgramEnded.TOO_FAST)
            for wrong in (float("nan"), float("-inf"), 1e300, 3.0)
        ],
    ],
)
def test_an_invalid_package_ends_the_program_with_its_reason(come, change, why):
    """After a gap it plays the set-point before the newest, and reads the one before that for the velocity."""
    path = swings(300, 0.4)
    robot, _ = followed(path, [[k] for k in range(150)], 300)
    for k in come:
        if k is not None:
            package = list(packages(path, 300)[k])
            for place, value in change.items():
                package[place] = value
            robot.write(*package)
        robot.steps()
    robot.until_ended().assert_kept(robot.tick)
    assert robot.ended is why
    assert np.isfinite(robot.told).all()


@pytest.mark.parametrize("away", [0.0099, -0.0101])
def test_the_first_set_point_may_be_at_most_10_mrad_away(away):
    path = np.tile(HERE, (600, 1))
    path[:, 2] += away
    robot, last = followed(path, [[k] for k in range(500)], 500)
    if abs(away) > 0.01:
        assert robot.ended is r.ProgramEnded.AWAY
        assert not robot.told
        return
    told = np.array(robot.told)
    assert np.abs(told[-1] - path[0]).max() <= 1e-6
    assert np.abs(np.diff(told, 2, axis=0)).max() / H**2 <= 0.01 / 0.05**2 + BACK
    robot.until_ended().assert_kept(last)


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("waits", [0, 50])
def test_a_waiting_program_ends_on_request(number, waits):
    """Otherwise the robot would take no other program while it waits."""
    package = (number, -RUN, *(4 * tuple(HERE)))
    robot = Alone(before=None if waits else package)
    robot.steps(waits)
    robot.write(*package)
    robot.steps(10)
    assert robot.state is r.ProgramState.ENDED
    assert robot.ended is r.ProgramEnded.ORDERED
    assert not robot.told


def test_set_points_left_in_registers_by_an_earlier_run_move_nothing():
    robot = Alone(before=packages(swings(600, 0.4), 400)[-1])
    robot.steps(1000)
    assert robot.state is r.ProgramState.WAITING
    assert robot.output(r.RUN) == RUN
    robot.until_ended(5000)
    assert robot.ended is r.ProgramEnded.SILENCE
    assert not robot.told


@pytest.mark.parametrize(("lag", "why"), [(40, None), (120, r.ProgramEnded.STRAYED)])
def test_the_program_ends_if_the_arm_does_not_follow(lag, why):
    path = swings(400, 0.45)
    robot, _ = followed(path, [[k] for k in range(300)], 300, lag=lag)
    assert robot.state is (r.ProgramState.ENDED if why else r.ProgramState.FOLLOWING)
    assert robot.ended is (why or r.ProgramEnded.NOT)


@pytest.mark.parametrize(("how", "periods", "moment"), [("pause", 25, 90), ("stop", 25, 160)])
def test_the_program_ends_after_a_pause(how, periods, moment):
    """The pause is longer than 40 ms; set-points that come during it are not played."""
    path = swings(1500, 0.45)
    sent = packages(path, 1400)
    robot = OnRobot()
    robot.play(sent, [[k] for k in range(moment)])
    if how == "pause":
        robot.robot.send(ProgramPause)
    else:
        robot.robot.controller.receive(SimulationInject(token=robot.robot.token, fault="protective_stop"))
    while np.abs(robot.targets[-1] - robot.targets[-2]).max() > 0.0 or robot.tick < moment + 2 + periods:
        robot.play(sent, [[min(robot.tick - 2, 1399)]])
    still, calls = robot.targets[-1], len(robot.told)
    if how == "stop":
        robot.robot.send(UnlockProtectiveStop)
    robot.robot.send(ProgramPlay)
    robot.play(sent, [[min(robot.tick - 2 + k, 1399)] for k in range(50)])
    assert robot.state is r.ProgramState.ENDED
    assert robot.ended is r.ProgramEnded.LOST
    assert len(robot.told) == calls
    assert (robot.targets[-50:] == still).all()
