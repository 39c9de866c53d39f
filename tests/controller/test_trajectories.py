"""Trajectories are played as scipy interpolates them, or refused as a whole; stops, pauses and shaping on them."""

import re
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BPoly, CubicHermiteSpline
from tests.search import draws
from tests.search.spaces import BENT
from tests.search.subject import torques

from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import admit_command
from tvist_controller.foresight.stops import resting_after
from tvist_controller.host import Host
from tvist_controller.line.limits import TORQUE_SHARE
from tvist_controller.setup import Setup, paper_payload
from tvist_controller.sources.calibrations import load
from tvist_lab.replay import replay
from tvist_protocol import commands as c
from tvist_protocol.motions import MoveTrajectory, StopJ, TrajectoryPoint
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q1, UR5E, H, Kept, NoArm, Robot, setup

STILL = (0.0,) * 6
RAISED = (0.0, -0.9, 0.0, -1.57, 0.0, 0.0)
KINDS = ("linear", "cubic", "quintic")
LIMITS = UR5E.limits
EACH_JOINT = (
    (LIMITS.position, "limit_position"), (LIMITS.velocity, "limit_velocity"),
    (LIMITS.acceleration, "limit_acceleration"), (LIMITS.jerk, "out_of_range"),
)  # fmt: skip
"""Limits of the position and its differences, and the codes of refusals."""


def curve(points, q, times):
    """Return the positions at times of the interpolation that begins at rest at q, by scipy."""
    t, given = [point.time for point in points], [[p.q, p.qd, p.qdd] for p in points]
    if t[0] > 0.0:
        t, given = [0.0, *t], [[q, STILL, STILL], *given]
    q, qd, qdd = zip(*given, strict=True)
    inside = np.clip(times, 0.0, t[-1])
    if qd[-1] is None:
        return np.transpose([np.interp(inside, t, column) for column in np.transpose(q)])
    if qdd[-1] is None:
        return CubicHermiteSpline(t, q, qd)(inside)
    return BPoly.from_derivatives(t, np.stack((q, qd, qdd), axis=1))(inside)


def fault(points, q):
    """Return code and number of the first point at which the curve's differences break a limit; None without one."""
    ticks = np.arange(-2, np.ceil(points[-1].time / H) + 3)
    positions, found = curve(points, q, ticks * H), []
    for order, (limit, code) in enumerate(EACH_JOINT):
        values = np.abs(np.diff(positions, order, axis=0)) / H**order
        rows = np.flatnonzero((values > np.array(limit) * (1.0 + 1e-6)).any(axis=1))
        if len(rows):
            found.append((ticks[rows[0] + (0, 1, 1, 2)[order]] * H, order, code))
    if not found:
        return None
    time, _, code = min(found)
    return code, next(n for n, point in enumerate(points) if point.time > time - 1e-9 or point is points[-1])


@pytest.mark.parametrize("count", [9, pytest.param(200, marks=pytest.mark.nightly)])
def test_a_trajectory_is_tracked_as_scipy_interpolates_it_or_refused_at_its_first_bad_point(count):
    robot, outcomes = Robot(plant=NoArm(), q=tuple(BENT)), []
    for number in range(count):
        random, kind = np.random.default_rng([number, 3]), KINDS[number % 3]
        points = draws.points(random, BENT, kind)
        robot.send(SimulationReset, q=tuple(BENT))
        robot.tick(2)
        robot.states.clear()
        robot.events.clear()
        reply, wrong = robot.send(MoveTrajectory, points=points), fault(points, BENT)
        outcomes.append(getattr(reply, "code", "accepted"))
        if isinstance(reply, Accepted):
            assert wrong is None, number
            last = robot.until_rest()
            times = np.arange(1, len(robot.states) + 1) * H
            assert np.abs(robot.column("reference_q") - curve(points, BENT, times)).max() <= 1e-9, number
            assert last.target_q == pytest.approx(points[-1].q, abs=1e-6)
            assert robot.motions() == ["motion_started", "motion_done"]
            continue
        if reply.code in {"collision", "limit_torque"}:  # the oracle does not know these
            named = int(reply.where[len("points[") : -1])
            assert wrong is None or named <= wrong[1], (number, reply)
        else:
            assert (reply.code, reply.where) == (wrong[0], f"points[{wrong[1]}]"), (number, reply)
        assert reply.why.startswith(f"{reply.where}: ")
        robot.tick(3)
        assert (robot.column("reference_q") == BENT).all()
        assert not robot.motions()
        assert isinstance(robot.send(c.MoveJ, q=tuple(BENT + 0.01)), Accepted)
    assert outcomes.count("accepted") >= 0.6 * count
    assert count < 200 or len(set(outcomes)) > 3


def bent():
    """Return points of a lively way that bends and does not come back."""
    middle, end = (0.8, -0.4, 0.5, 0.3, 0.6, 0.8), (1.6, 0.0, 0.0, 0.6, 0.0, 0.8)
    speed = (1.2, 0.0, 0.3, 0.5, 0.0, -1.0)
    return tuple(
        TrajectoryPoint(time=time, q=tuple((BENT + turn).tolist()), qd=qd, qdd=STILL)
        for time, turn, qd in ((1.5, middle, speed), (3.0, end, STILL))
    )


def begun(shaper):
    """Return a robot that has just accepted the bent way."""
    robot = Robot(plant=NoArm(), q=tuple(BENT), shaper=shaper, calibration=load("ur5e_modal"))
    assert isinstance(robot.send(MoveTrajectory, points=bent()), Accepted)
    return robot


@cache
def alone(shaper):
    """Return the shaped bent way, which nothing disturbs."""
    robot = begun(shaper)
    robot.until_rest()
    return robot.column("target_q")


def swings(*turns):
    """Return points at rest at given times and shoulder angles, from the raised posture."""
    return tuple(
        TrajectoryPoint(time=time, q=(0.0, turn, *RAISED[2:]), qd=STILL, qdd=STILL) for time, turn in turns
    )


def test_a_trajectory_that_needs_more_torque_than_a_joint_has_is_refused_with_point_and_joint():
    robot = Robot(plant=NoArm(), q=RAISED, shaper="none")
    reply = robot.send(MoveTrajectory, points=swings((1.0, -0.9), (1.5, -0.4)))
    assert (reply.code, reply.where, reply.limit) == ("limit_torque", "points[1]", LIMITS.torque[1])
    assert "joint shoulder would need a torque of" in reply.why


def test_a_refusal_names_the_first_bad_point_before_and_after_shaping():
    robot = Robot(plant=NoArm(), q=RAISED, shaper="none")
    reply = robot.send(MoveTrajectory, points=swings((1.0, -0.9), (1.5, -0.4), (1.52, -0.9)))
    assert (reply.code, reply.where) == ("limit_torque", "points[1]")
    reply = robot.send(MoveTrajectory, points=swings((500.0, -0.9), (500.0, -0.4)))
    assert reply.why == "points[1].time is 500 s: must be at least 0.1 ms after the point before"


@pytest.mark.parametrize("moment", [205, 255, 905])
def test_a_stop_near_the_torque_limits_is_quick_and_keeps_them(moment):
    robot = Robot(plant=NoArm(), q=RAISED, shaper="none")
    points = swings((0.7, -0.4), (1.4, -0.9), (2.1, -0.4), (2.8, -0.9))
    assert isinstance(robot.send(MoveTrajectory, points=points), Accepted)
    robot.tick(moment)
    robot.send(c.Stop)
    robot.until_rest()
    stopped = robot.column("target_q")[moment - 2 :]
    assert (np.abs(torques(UR5E, paper_payload(UR5E), stopped)).max(axis=0) <= LIMITS.torque).all()
    assert stopped[:, 1].max() - stopped[-1, 1] < 0.02  # it hardly swings back
    assert H * resting_after(stopped) < 0.6


def test_a_stop_near_the_torque_limits_names_the_deceleration_that_it_reaches():
    robot = Robot(plant=NoArm(), q=RAISED, shaper="none")
    points = swings((0.7, -0.4), (1.4, -0.9), (2.1, -0.4), (2.8, -0.9))
    assert isinstance(robot.send(MoveTrajectory, points=points), Accepted)
    speed = abs(robot.tick(255).target_qd[1])
    robot.send(c.Stop, deceleration=30.0)
    robot.until_rest()
    told = re.search("deceleration is (.*) rad/s², limited from 30", robot.told("motion_stopped")[0].why)
    assert float(told[1]) == pytest.approx(np.sqrt(10.0 * speed), rel=0.02)


def test_the_way_between_ticks_is_as_smooth_as_the_checked_one():
    """A lower time rate plays it; the points' own curve turns by 0.3 rad and back between two ticks."""
    robot = Robot(plant=NoArm(), q=tuple(BENT))
    turns = ((0.5, 0.0), (0.5 + H / 2, 0.3), (0.5 + H, 0.0), (1.5, 0.05))
    points = tuple(
        TrajectoryPoint(time=time, q=(*BENT[:5], BENT[5] + turn), qd=STILL) for time, turn in turns
    )
    assert isinstance(robot.send(MoveTrajectory, points=points), Accepted)
    assert robot.send(c.SetSpeed, fraction=0.37) == Done()
    robot.until_rest()
    assert np.abs(np.diff(robot.column("target_q"), axis=0)).max() / H < 0.08


def places(way, positions):
    """Return the place of each position on a way, in ticks, and its distance from there [rad]."""
    steps = np.diff(way, axis=0)
    lengths = np.maximum((steps**2).sum(axis=1), 1e-30)
    found = []
    for q in positions:
        share = np.clip(((q - way[:-1]) * steps).sum(axis=1) / lengths, 0.0, 1.0)
        off = np.abs(q - way[:-1] - share[:, None] * steps).max(axis=1)
        number = int(np.argmin(off))
        found.append((number + share[number], off[number]))
    return np.transpose(found)


STOPS = {
    "stop": lambda robot: robot.send(c.Stop),
    "gentle": lambda robot: robot.send(c.Stop, deceleration=1.5),
    "stop_j": lambda robot: robot.send(StopJ, acceleration=4.0),
    "protective": lambda robot: robot.send(SimulationInject, fault="protective_stop"),
    "lease": lambda robot: robot.send(c.ReleaseControl),
    "power": lambda robot: robot.send(c.PowerOff),
}


@pytest.mark.parametrize("shaper", ["none", "zv", "um_zv"])
@pytest.mark.parametrize("halt", STOPS)
def test_a_stop_stays_on_the_shaped_way_behind_the_motion_and_within_torque_limits(halt, shaper):
    robot, way, moment = begun(shaper), alone(shaper), 100 + 230 * list(STOPS).index(halt)
    robot.tick(moment)
    STOPS[halt](robot)
    robot.until_rest()
    stopped = robot.column("target_q")
    reached, off = places(way, stopped[moment:])
    assert off.max() <= 1e-5
    assert (np.diff(reached) >= -1e-6).all()
    assert (reached <= np.arange(moment, len(stopped)) + 1e-6).all()
    assert moment + 10 < len(stopped) < min(moment + 600, len(way))
    needed, taken = (np.abs(torques(UR5E, paper_payload(UR5E), q[moment - 2 :])) for q in (way, stopped))
    share = TORQUE_SHARE * np.array(LIMITS.torque)
    assert (taken.max(axis=0) <= 1.001 * np.maximum(share, needed.max(axis=0))).all()
    lasted = H * resting_after(stopped[moment:])
    assert robot.told("motion_stopped")[0].duration == pytest.approx(lasted, abs=4 * H)


def test_a_harder_stop_replaces_a_gentle_one_on_the_way():
    ends = []
    for halts in (("gentle",), ("gentle", "protective")):
        robot = begun("zv")
        robot.tick(500)
        for halt in halts:
            STOPS[halt](robot)
            robot.tick(60)
        ends.append(robot.until_rest().tick)
        assert places(alone("zv"), robot.column("target_q"))[1].max() <= 1e-5
    assert ends[1] < ends[0] - 50


@pytest.mark.parametrize("shaper", ["none", "zv"])
def test_slider_pause_and_resume_keep_the_reference_on_its_curve(shaper):
    robot = begun(shaper)
    pause = (c.Pause, {}), (c.Resume, {})
    steps = (c.SetSpeed, {"fraction": 0.3}), *pause, (c.SetSpeed, {"fraction": 1.0}), *pause
    for kind, how in steps:
        robot.tick(100)
        assert robot.send(kind, **how) == Done()
        robot.tick(350)
        paused = np.abs(np.diff(robot.column("target_q")[-5:], axis=0)).max()
        assert (paused < 1e-6) == (kind is c.Pause)
    robot.until_rest()
    way = curve(bent(), BENT, np.arange(int(3.0 / H) + 1) * H)
    reached, off = places(way, robot.column("reference_q"))
    assert off.max() <= 1e-5
    assert (np.diff(reached) >= -1e-6).all()
    assert reached[-1] == pytest.approx(len(way) - 1, abs=0.1)
    hardest = np.abs(np.diff(way, 2, axis=0)).max() / H**2
    assert np.abs(robot.column("target_qdd")).max() <= 1.005 * max(hardest, 2.0)
    assert robot.motions() == ["motion_started", "motion_done"]


@pytest.mark.parametrize("seconds", [2.0, 30.0])
@pytest.mark.parametrize("paused", [False, True])
def test_a_change_of_payload_or_shaper_is_checked_on_the_rest_of_the_way(seconds, paused):
    """A long rod meets the floor where the disc does not."""
    robot = Robot(plant=NoArm(), q=tuple(BENT))
    down = tuple(BENT + np.array([0.0, 0.25, 0.0, 0.0, 0.0, 0.0]))
    point = TrajectoryPoint(time=seconds, q=down, qd=STILL)
    assert isinstance(robot.send(MoveTrajectory, points=(point,)), Accepted)
    robot.tick(100)
    assert not paused or robot.send(c.Pause) == Done()
    robot.tick(200)
    rod = {"mass": 1.0, "com": (0.0, 0.0, 0.3), "inertia": (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)}
    assert robot.send(c.SetPayload, **rod).code == "collision"
    assert robot.send(c.SetShaper, name="zvd") == Done()


def test_payload_and_shaper_change_at_any_tick_of_the_shaped_end_of_a_trajectory():
    robot = Robot(plant=NoArm(), q=tuple(BENT), shaper="um_zv", calibration=load("ur5e_modal"))
    point = TrajectoryPoint(time=0.5, q=tuple(BENT + 0.2), qd=STILL)
    assert isinstance(robot.send(MoveTrajectory, points=(point,)), Accepted)
    robot.tick(240)
    weight = {"mass": 1.0, "com": (0.0, 0.0, 0.03), "inertia": (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)}
    for _ in range(80):
        robot.tick()
        assert robot.send(c.SetPayload, **weight) == Done()
        assert robot.send(c.SetShaper, name="um_zv") == Done()
    robot.until_rest()
    assert robot.motions() == ["motion_started", "motion_done"]


def test_a_replay_of_a_stopped_trajectory_is_bit_equal():
    kept, start = Kept(), setup(q=tuple(BENT.tolist()))
    host = Host(Controller(start), kept)

    def ask(command):
        return host.carry_out(admit_command(command, host.controller.session.lease))

    token = ask(c.TakeControl(client="a")).token
    commands = {
        10: MoveTrajectory(token=token, points=bent()),
        400: c.SetSpeed(token=token, fraction=0.5),
        700: c.Stop(token=token),
    }
    for tick in range(900):
        if tick in commands:
            ask(commands[tick])
        host.tick()
    assert [event.kind for event in kept.events].count("motion_stopped") == 1
    again = replay(Setup.from_builtins(start.to_builtins()), kept.entries, kept.states)
    assert again.first_difference is None


def ringing(shaper):
    """Return the tool's largest true acceleration from 10 ms after a brisk trajectory on [m/s²]."""
    robot = Robot(shaper=shaper, calibration=load("ur5e_modal"))
    target = tuple(Q1 + np.array([0.3, 0.1, -0.2, 0.1, 0.1, 0.2]))
    point = TrajectoryPoint(time=0.5, q=target, qd=STILL, qdd=STILL)
    assert isinstance(robot.send(MoveTrajectory, points=(point,)), Accepted)
    robot.until_rest()
    robot.tick(5)
    forces = []
    for _ in range(250):
        robot.tick()
        forces.append(robot.controller.cycle.plant.truth().specific_force)
    return np.linalg.norm(np.array(forces) - forces[-1], axis=1).max()


def test_shapers_reduce_the_vibration_after_a_trajectory():
    unshaped = ringing("none")
    assert unshaped > 0.2
    assert ringing("zv") <= 0.25 * unshaped
    assert ringing("elastic") <= 0.1 * unshaped
