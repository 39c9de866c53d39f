"""Paths of many close points: the arm does not stop in between, and waits for late points."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramPlay

from .robots import H
from .scripts import a_robot, failure, finish, playing, start
from .test_program_sockets import opened
from .test_programs import HERE, KINEMATICS

APART, ROUND, SPEED, ACCELERATION = 1.5e-3, 0.05, 0.5, 2.0
"""Distance of the points on a circle, its radius [m], and what the moves ask for [m/s, m/s^2]."""


def circle(count):
    """Return points on a circle through the present position, shape (count, 3) [m]."""
    angles = 2.0 * np.arcsin(0.5 * APART / ROUND) * np.arange(1, count + 1)
    around = np.column_stack((np.sin(angles), 1.0 - np.cos(angles), np.zeros(count)))
    return np.array(HERE[:3]) + ROUND * around


def zigzag(count):
    """Return rows of 30 mm, 6 mm apart."""
    steps = ([[1, 0, 0]] * 20 + [[0, 1, 0]] * 4 + [[-1, 0, 0]] * 20 + [[0, 1, 0]] * 4) * (count // 48 + 1)
    return np.array(HERE[:3]) + APART * np.cumsum(steps[:count], axis=0)


def moves(points, radius=5e-4):
    last = len(points) - 1
    return [
        f"movel(p{[*map(float, point), *HERE[3:]]}, a={ACCELERATION}, v={SPEED}, r={0 if number == last else radius})"
        for number, point in enumerate(points)
    ]


def tool(robot):
    """Return positions of the tool at the shaped reference, one per tick [m]."""
    return np.array([KINEMATICS.pose(np.array(state.target_q))[1] for state in robot.states])


def speeds(robot):
    """Return the tool's speed while it moves, without 0.1 s at both ends [m/s]."""
    speed = np.linalg.norm(np.diff(tool(robot), axis=0), axis=1) / H
    moving = np.flatnonzero(speed > 1e-6)
    return speed[moving[0] : moving[-1] + 1][50:-50]


def away(robot, points):
    """Return the tool's largest distance from the lines between the points [m]."""
    corners, worst = np.vstack((HERE[:3], points)), 0.0
    starts, ways = corners[:-1], np.diff(corners, axis=0)
    for place in tool(robot):
        shares = np.clip(((place - starts) * ways).sum(axis=1) / (ways**2).sum(axis=1), 0.0, 1.0)
        worst = max(worst, float(np.linalg.norm(starts + shares[:, None] * ways - place, axis=1).min()))
    return worst


def begin(points, ticks=0, **changes):
    robot = a_robot(**changes)
    start(robot, *moves(points))
    robot.tick(ticks)
    return robot


@pytest.mark.parametrize("shaper", ["none", "zv"])
def test_dense_points_are_followed_quickly_without_stops(shaper):
    """Without its ends, it takes at most 1.25 times the circle's quickest time."""
    points = circle(200)
    robot = finish(begin(points, shaper=shaper))
    between = speeds(robot)
    assert between.min() > 0.01 * SPEED
    quickest = between.sum() * H / np.sqrt(ACCELERATION * ROUND)
    assert len(between) * H <= 1.25 * quickest
    assert robot.kinds().count("motion_started") == 1
    assert robot.warnings() == []
    np.testing.assert_allclose(tool(robot)[-1], points[-1], atol=1e-9)
    assert away(robot, points) < 2e-5
    q = robot.column("reference_q")
    assert np.abs(np.diff(q, 3, axis=0)).max() / H**3 < 2000.0
    acceleration, jerk = (
        np.linalg.norm(np.diff([KINEMATICS.pose(each)[1] for each in q], order, axis=0), axis=1).max()
        / H**order
        for order in (2, 3)
    )
    assert acceleration < 1.02 * ACCELERATION
    assert jerk < 2.0 * 60.0  # along the path it is limited to 60, and across it by the joints


LOAD = {"com": (0, 0, 0.05), "inertia": (0,) * 6}
CHANGES = {
    "pause": (c.Pause, {}),
    "resume": (c.Resume, {}),
    "slow": (c.SetSpeed, {"fraction": 0.3}),
    "fast": (c.SetSpeed, {"fraction": 1.0}),
    "zv": (c.SetShaper, {"name": "zv"}),
    "none": (c.SetShaper, {"name": "none"}),
    "heavy": (c.SetPayload, {"mass": 3.0} | LOAD),
    "light": (c.SetPayload, {"mass": 0.5} | LOAD),
}


@examples(2)
@example([(1, "heavy"), (102, "heavy")])
@given(st.lists(st.tuples(st.integers(1, 120), st.sampled_from(list(CHANGES))), max_size=6))
def test_random_changes_keep_the_arm_on_its_path(changes):
    points = circle(40)
    robot = begin(points, 90)
    for ticks, what in changes:
        robot.tick(ticks)
        robot.send(CHANGES[what][0], **CHANGES[what][1])
    robot.send(c.Resume)
    robot.send(c.SetSpeed, fraction=1.0)
    finish(robot)
    assert failure(robot) is None
    np.testing.assert_allclose(tool(robot)[-1], points[-1], atol=1e-8)
    assert away(robot, points) < 2e-5


def test_a_stop_ends_on_the_path():
    points = circle(100)
    robot = begin(points, 230)
    robot.send(c.Stop)
    robot.tick(400)
    assert robot.controller.cycle.mode.at_rest
    assert not playing(robot)
    assert robot.kinds().count("motion_started") == 1
    assert away(robot, points) < 2e-5


def test_a_path_resumes_after_a_protective_stop_without_going_back():
    points = circle(120)
    robot = begin(points, 230)
    robot.controller.motion.protect("a test")
    robot.tick(600)
    stood = len(robot.states)
    robot.send(c.UnlockProtectiveStop)
    robot.send(ProgramPlay)
    finish(robot)
    assert failure(robot) is None
    np.testing.assert_allclose(tool(robot)[-1], points[-1], atol=1e-8)
    center = np.array(HERE[:3]) + np.array([0.0, ROUND, 0.0])
    x, y = (tool(robot)[stood:] - center)[:, :2].T
    assert np.diff(np.unwrap(np.arctan2(y, x))).min() > -1e-6
    assert away(robot, points) < 5e-5


def test_a_stop_before_tight_corners_is_quick_and_stays_on_the_path():
    """The motion slows down for its corners, so no single limit suits the whole stop."""
    points, ticks = zigzag(150), 295
    robot = begin(points, ticks, shaper="zv")
    robot.controller.motion.protect("a test")
    robot.tick(75)
    assert robot.controller.cycle.mode.at_rest
    assert away(robot, points) < 5e-4
    q = robot.column("target_q")
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= 40.0
    free = begin(points, ticks + 75, shaper="zv")
    covered, freely = (np.linalg.norm(np.diff(tool(each), axis=0), axis=1).cumsum() for each in (robot, free))
    assert (covered <= freely + 1e-9).all()


READS = (
    "n = 1",
    "while n > 0:",
    "  got = socket_read_ascii_float(3, timeout=1)",
    "  n = got[0]",
    "  if n > 0:",
    f"    movel(p[got[1], got[2], got[3], {HERE[3]}, {HERE[4]}, {HERE[5]}], a=2, v=0.5, r=0.0005)",
    "  end",
    "end",
)


def sent(points):
    return "".join(f"({x:.9f},{y:.9f},{z:.9f})\n" for x, y, z in points).encode()


def test_points_received_in_time_by_a_socket_are_one_motion():
    points = circle(150)
    robot, far = opened(*READS)
    for number in range(0, 150, 3):
        far.tell("received", sent(points[number : number + 3]))
        robot.tick(8)
    robot.tick(600)
    between = speeds(robot)
    assert between.min() > 0.01 * SPEED
    assert robot.kinds().count("motion_started") == 1
    np.testing.assert_allclose(tool(robot)[-1], points[-1], atol=1e-8)


def test_the_arm_stops_with_a_warning_if_the_next_point_is_late():
    points = circle(80)
    robot, far = opened(*READS)
    far.tell("received", sent(points[:60]))
    robot.tick(900)
    np.testing.assert_allclose(tool(robot)[-1], points[59], atol=1e-8)
    assert robot.warnings() == [
        "segments[59]: the arm stops there, since the move after it was not known in time for its blend"
    ]
    far.tell("received", sent(points[60:]))
    robot.tick(600)
    assert robot.kinds().count("motion_started") == 2
    np.testing.assert_allclose(tool(robot)[-1], points[-1], atol=1e-8)
