"""The program that follows set-points: on the path on a good link, smooth on a bad one, at rest without one."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples
from tests.server.followed import HERE, PATIENCE, RUN, Alone, H, OnRobot, late, packages, swings

from tvist_controller.programs.checking import check_program
from tvist_protocol.commands import UnlockProtectiveStop
from tvist_protocol.programs import ProgramPause, ProgramPlay
from tvist_protocol.simulation import SimulationInject
from tvist_server.moving import program as r
from tvist_server.moving.program import CLOSE, Window, program

BACK = 1.1 * CLOSE / H**2
"""Acceleration with which the rest of a distance from the set-points is made up for [rad/s²]."""
GIVEN = {"speed": 0.5, "deceleration": 4.0, "lookahead": 0.03, "gain": 2000.0}
DOCUMENTED = {
    *("get_steptime", "sync", "pow", "norm", "servoj", "stopj", "get_target_joint_positions", "textmsg"),
    *("read_input_integer_register", "read_input_float_register", "write_output_integer_register"),
}
"""Functions in UR's manuals of software 3.14 and 5.9, which also compute with lists."""


def of_path(path, numbers):
    """Set-points by their numbers; before the first one, the arm counts as there."""
    return path[np.maximum(np.array(numbers) - 1, 0)]


def followed(path, arrivals, count, kind=Alone, **changes):
    """A program that has had packages of a path; the last tick with one."""
    robot = kind(**changes)
    begun = robot.tick
    robot.play(packages(path, count), arrivals)
    return robot, begun + max(tick for tick, come in enumerate(arrivals) if come)


def test_the_program_is_correct_and_calls_documented_functions_alone():
    text = program(1, **GIVEN)
    assert check_program(text) == []
    code = re.sub(r"#.*", "", text)
    calls = set(re.findall(r"(\w+)\(", code)) - {"tvist_follow", "setpoint", "if", "while"}
    assert calls == DOCUMENTED
    assert not re.search(r"\$|[^\x00-\x7f]", text)


@pytest.mark.parametrize(
    ("name", "value"),
    [("run", 0), ("run", 2**31), ("speed", 0.0), ("lookahead", 0.02), ("gain", float("nan"))],
)
def test_what_a_robot_would_not_take_is_refused(name, value):
    with pytest.raises(ValueError, match=f"^{name} is .*: must be"):
        program(**{"run": 1, **GIVEN, name: value})


def test_a_package_has_the_newest_set_point_first_and_every_register_once():
    window = Window()
    for k in range(6):
        window.add((float(k),) * 6)
    assert window.values(RUN)[:2] == (6, RUN)
    assert window.values(0)[1::6] == (0, 5.0, 4.0, 3.0, 2.0)
    assert len(r.INPUTS) == len(window.values(RUN))


@pytest.mark.parametrize("seed", range(4))
def test_numbers_that_begin_anew_change_nothing(seed):
    arrivals = late(np.random.default_rng(seed), 200, jitter=1.4, stalls=0.02, longest=6)
    runs = Alone(), Alone()
    for robot, before in zip(runs, (0, r.MOST - 100 + seed), strict=True):
        robot.play(packages(swings(200, 0.4), 200, before=before), arrivals[:200])
    first, second = (str((run.told, run.at, run.alone, run.output(r.LEFT_OUT), run.state)) for run in runs)
    assert first == second
    assert runs[1].numbers[-1] < 200 < runs[1].numbers[0]


@examples(20)
@given(seed=st.integers(0, 2**31), speed=st.floats(0.05, 3.0), jitter=st.floats(0.0, 0.99))
def test_on_a_good_link_it_plays_every_set_point_as_it_is(seed, speed, jitter):
    """Packages that come up to a period late or early at random are waited for by one period."""
    path = swings(600, 0.99 * speed)
    arrivals = late(np.random.default_rng(seed), 560, base=1.0, jitter=jitter / 2)
    robot, last = followed(path, arrivals[:560], 560, speed=speed)
    assert robot.state is r.State.FOLLOWING
    np.testing.assert_allclose(robot.told, of_path(path, robot.numbers), rtol=0.0, atol=1e-9)
    assert np.diff(robot.numbers[40:]).tolist() == [1] * (len(robot.numbers) - 41)
    robot.until_ended().assert_kept(last)
    assert robot.ended is r.Ended.SILENCE


@examples(50)
@given(
    seed=st.integers(0, 2**31),
    speed=st.floats(0.1, 2.5),
    jitter=st.floats(0.0, 2.0),
    stalls=st.floats(0.0, 0.05),
    repeated=st.floats(0.0, 0.3),
    left_out=st.floats(0.0, 0.05),
)
def test_a_bad_link_shows_by_smooth_detours_that_fade(seed, speed, jitter, stalls, repeated, left_out):
    """Packages late by up to 12 periods and then at once, some twice, some never."""
    random, count = np.random.default_rng(seed), 400
    path = swings(count + 400, 0.9 * speed)
    arrivals = [
        [place for place in come for _ in range(2 if random.random() < repeated else 1)]
        for come in late(random, count, jitter=jitter, stalls=stalls)
    ]
    arrivals = [[place for place in come if random.random() >= left_out] for come in arrivals]
    robot = Alone(speed=speed)
    robot.play(packages(path, count + 300), [*arrivals[:count], *([count + k] for k in range(250))])
    assert robot.state is r.State.FOLLOWING, robot.ended
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
    """A package of which something may be wrong."""
    package = list(package)
    if random.random() < 0.01:
        at = random.integers(2, len(package))
        package[at:] = [random.choice([package[at], wildness, np.nan, np.inf, -1e300])] * (len(package) - at)
    if random.random() < 0.01:
        package[0] = int(np.clip(package[0] + random.integers(-1000, 1000), -(2**31), 2**31 - 1))
    if random.random() < 0.002:
        package[1] = random.integers(-3, 3)
    return package


@pytest.mark.parametrize("kind", [Alone, OnRobot])
@examples(25)
@given(seed=st.integers(0, 2**31), speed=st.floats(0.1, 3.0), wildness=st.sampled_from([1e-3, 0.1, 5.0]))
def test_whatever_comes_it_moves_within_its_limits_and_ends_at_rest(kind, seed, speed, wildness):
    random, count = np.random.default_rng(seed), 300
    path = swings(count, 0.9 * speed)
    robot = kind(speed=speed)
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


@pytest.mark.parametrize("speed", [0.2, 3.0])
@pytest.mark.parametrize("moment", [3, 100, 201, 305])
def test_it_brakes_within_40_ms_of_the_last_set_point(speed, moment):
    path = swings(400, speed)
    robot, last = followed(
        path, [[k] for k in range(moment)], moment, OnRobot, speed=speed, deceleration=20.0
    )
    before = np.abs(robot.targets[-1] - robot.targets[-2]).max()
    robot.until_ended(600)
    assert robot.ended is r.Ended.SILENCE
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


@pytest.mark.parametrize(("speed", "share"), [(0.05, 0.97), (1.0, 0.97), (1.0, 1.0), (2.5, 1.0)])
def test_joints_at_their_largest_speed_fall_behind_no_further_once_a_bad_link_is_good(speed, share):
    """On a robot of 125 Hz; neither do they stay behind, since the program may be faster than the set-points."""
    count, step = 900, 0.008
    speeds = np.clip((np.arange(count) - 8) * step * 40.0 * speed, 0.0, share * speed)
    path = HERE + np.outer(np.cumsum(speeds) * step, (1.0, -0.15, 0.1, 0.2, 0.3, -1.0))
    newest = np.maximum.accumulate([k - int(by) for k, by in enumerate(LATE)]).tolist()
    arrivals = [[place] if place >= 0 else [] for place in [*newest, *range(len(LATE), count)]]
    robot, _ = followed(path, arrivals, count, speed=speed, step=step)
    assert robot.state is r.State.FOLLOWING
    off = np.abs(np.array(robot.told) - of_path(path, robot.numbers)).max(axis=1)
    assert off[len(LATE) + 10 :].max() <= off[: len(LATE) + 10].max()
    assert off[-1] <= 1e-9


@pytest.mark.parametrize("together", [2, 3, 4])
@pytest.mark.parametrize("slip", [0, 1, 2, 3])
@pytest.mark.parametrize("speed", [0.5, 2.5])
def test_packages_that_come_together_are_followed_at_the_largest_speed_whenever_they_come(
    together, slip, speed
):
    """All joints are as fast as they may be; from some moment on, packages come later by some periods."""
    count = 900
    passed = np.minimum(np.cumsum(np.clip((np.arange(count) - 100) * H * 5.0, 0.0, speed)) * H, 0.7 * speed)
    path = HERE + np.outer(passed, (1.0, -1.0, 1.0, 1.0, 1.0, -1.0))
    newest = [(k + 1 - (slip if k > 40 else 0)) // together * together - 1 for k in range(count)]
    arrivals = [[b] if b > a else [] for a, b in zip([-1, *newest], newest, strict=False)]
    robot, _ = followed(path, arrivals, count, speed=speed)
    assert robot.state is r.State.FOLLOWING
    off = np.abs(np.array(robot.told) - of_path(path, robot.numbers)).max(axis=1)
    assert off.max() <= 0.03 * speed
    assert off[-1] <= 1e-3 * speed


@pytest.mark.parametrize("lost", [3, 7, 12, 17])
def test_a_sender_that_has_lost_periods_for_good_is_followed_later_by_as_many(lost):
    path = swings(1000, 0.45)
    robot, _ = followed(path, [[k] for k in range(200)], 600)
    robot.play(packages(path, 600), [*([] for _ in range(lost)), *([200 + k] for k in range(400))])
    told, numbers = np.array(robot.told), np.array(robot.numbers)
    assert robot.state is r.State.FOLLOWING
    assert robot.tick - 2 - lost - 2 <= numbers[-1] <= robot.tick - lost
    assert np.abs(told - of_path(path, numbers))[-1].max() <= 1e-6
    assert robot.output(r.ALONE) <= 2 * lost + 4


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({1: 0}, r.Ended.ORDERED),
        ({1: -1}, r.Ended.ORDERED),
        ({0: 3}, r.Ended.LOST),
        ({0: 190}, r.Ended.LOST),
        ({12: float("nan")}, r.Ended.TOO_FAST),
        ({8: 0.3, 14: 0.3, 20: 0.3, 2: 0.3}, r.Ended.TOO_FAST),
    ],
)
def test_a_wrong_package_ends_it_and_it_says_why(change, why):
    path = swings(300, 0.4)
    robot, _ = followed(path, [[k] for k in range(150)], 300)
    for k in (150, 151, 152):
        package = list(packages(path, 300)[k])
        for place, value in change.items():
            package[place] = value
        robot.write(*package)
        robot.steps()
    robot.until_ended().assert_kept(robot.tick)
    assert robot.ended is why


@pytest.mark.parametrize("wrong", [float("nan"), float("-inf"), 1e300, 3.0])
def test_a_wrong_set_point_beside_the_one_that_is_played_ends_it(wrong):
    """After a gap the program also reads the set-point before, for the velocity."""
    path = swings(300, 0.4)
    robot, _ = followed(path, [[k] for k in range(150)], 300)
    robot.steps(3)
    package = list(packages(path, 300)[154])
    for at in range(14, 20):  # it plays the last but one
        package[at] = wrong
    robot.write(*package)
    robot.steps(2)
    robot.until_ended().assert_kept(robot.tick)
    assert robot.ended is r.Ended.TOO_FAST
    assert np.isfinite(robot.told).all()


@pytest.mark.parametrize("away", [0.0099, -0.0101])
def test_the_first_set_point_may_be_a_hundredth_of_a_radian_away(away):
    path = np.tile(HERE, (600, 1))
    path[:, 2] += away
    robot, last = followed(path, [[k] for k in range(500)], 500)
    if abs(away) > 0.01:
        assert robot.ended is r.Ended.AWAY
        assert not robot.told
        return
    told = np.array(robot.told)
    assert np.abs(told[-1] - path[0]).max() <= 1e-6
    assert np.abs(np.diff(told, 2, axis=0)).max() / H**2 <= 0.01 / 0.05**2 + BACK
    robot.until_ended().assert_kept(last)


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("waits", [0, 50])
def test_a_program_that_waits_is_ended_at_once(number, waits):
    """Else the robot would take no program for as long as it waits."""
    package = (number, -RUN, *(4 * tuple(HERE)))
    robot = Alone(before=None if waits else package)
    robot.steps(waits)
    robot.write(*package)
    robot.steps(10)
    assert robot.state is r.State.ENDED
    assert robot.ended is r.Ended.ORDERED
    assert not robot.told


def test_registers_of_before_move_nothing():
    robot = Alone(before=packages(swings(600, 0.4), 400)[-1])
    robot.steps(1000)
    assert robot.state is r.State.WAITING
    assert robot.output(r.RUN) == RUN
    robot.until_ended(5000)
    assert robot.ended is r.Ended.SILENCE
    assert not robot.told


@pytest.mark.parametrize(("lag", "why"), [(40, None), (120, r.Ended.STRAYED)])
def test_an_arm_that_does_not_follow_ends_it(lag, why):
    path = swings(400, 0.45)
    robot, _ = followed(path, [[k] for k in range(300)], 300, lag=lag)
    assert robot.state is (r.State.ENDED if why else r.State.FOLLOWING)
    assert robot.ended is (why or r.Ended.NOT)


@pytest.mark.parametrize(
    ("how", "periods", "moment"), [("pause", 25, 90), ("stop", 25, 160), ("pause", 400, 160)]
)
def test_it_does_not_go_on_after_a_pause(how, periods, moment):
    """Of more than 40 ms: neither when the sender goes on meanwhile, since what has come counts no more."""
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
    robot.play(sent, [[min(robot.tick - 2 + k, 1399)] for k in range(200)])
    assert robot.state is r.State.ENDED
    assert robot.ended is r.Ended.LOST
    assert len(robot.told) == calls
    assert (robot.targets[-200:] == still).all()
