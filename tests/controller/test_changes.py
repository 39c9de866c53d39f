"""Changes during motion, checks before they apply, and the limits of every arm."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from tests.search.draws import WITHIN, own_limits
from tests.search.subject import Subject, refused, speeds, torques

from tvist_controller.about import info_of
from tvist_controller.dispatch.planner import Planner
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.foresight.stops import resting_after
from tvist_controller.kinematics.arm import SLEW, InverseDynamics
from tvist_controller.line.differentiator import STILL
from tvist_controller.line.limits import TORQUE_SHARE
from tvist_controller.line.line_tick import TORQUE as TORQUE_ROW
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.setup import body, paper_payload
from tvist_controller.trajectory import MotionLimits
from tvist_plant.description import load
from tvist_protocol import commands as c
from tvist_protocol.kinematics import ForwardKinematics
from tvist_protocol.motions import MoveL
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.transitions import Activity

from .robots import FITTING, PAPER, Q1, Q2, Q3, UR5E, H, NoArm, Robot, bits, calibration, without_arm
from .test_modes import at

DISC = paper_payload(UR5E)


@pytest.mark.parametrize("masses", [(5.0, 0.0), (1.0, 4.0)])
def test_a_payload_change_in_motion_makes_no_torque_step(masses):
    first, then = (body(paper_payload(UR5E, mass)) for mass in masses)
    changed, never, always = (without_arm() for _ in range(3))
    for line, payload in ((changed, first), (never, first), (always, then)):
        line.dynamics.declare(payload)
        line.reset(Q1)
        line.begin(line.plan(Q3, PAPER))
    torques = []
    for tick in range(700):
        if tick == 100:
            changed.dynamics.declare(then)
        torques.append([line.step().signals[TORQUE_ROW] for line in (changed, never, always)])
    torque, old, new = np.swapaxes(np.array(torques), 0, 1)
    assert (torque[:100] == old[:100]).all()
    np.testing.assert_allclose(torque[100 + SLEW :], new[100 + SLEW :], atol=1e-9)
    # No tick's change is more than that of the motion and an even share of the difference, with half on top.
    ticks = slice(100, 100 + SLEW)
    most = np.maximum(np.abs(np.diff(old, axis=0)), np.abs(np.diff(new, axis=0)))
    most = most[ticks] + 1.6 * np.abs(new - old)[ticks].max(axis=0) / SLEW
    assert (np.abs(np.diff(torque, axis=0))[ticks] <= most + 1e-9).all()
    assert (torque >= np.minimum(old, new) - 1e-9).all()
    assert (torque <= np.maximum(old, new) + 1e-9).all()


@pytest.mark.parametrize("masses", [(5.0, 0.0), (0.0, 5.0)])
def test_a_stop_during_a_payload_change_keeps_torque_limits_for_both_payloads(masses):
    line = without_arm()
    line.dynamics.declare(body(paper_payload(UR5E, masses[0])))
    line.reset(Q1)
    line.begin(line.plan(Q2 + np.array([0.0, 0.4, 0.0, 0.0, 0.0, 0.0]), MotionLimits(2.5, 6.0, 500.0)))
    for tick in range(200):
        if tick == 150:
            line.dynamics.declare(body(paper_payload(UR5E, masses[1])))
        line.step()
    state, planned = line.newest, Stopper(line).plan_stop(None).trajectory
    for mass in masses:
        dynamics = InverseDynamics(UR5E, body(paper_payload(UR5E, mass)))
        present = line.dynamics.effort(state.q, state.qd, state.qdd)
        limit = np.maximum(TORQUE_SHARE * np.array(UR5E.limits.torque), present)
        states = planned.states(np.linspace(0.0, planned.duration, 49)[1:])
        assert (np.abs(dynamics.torques(*states)) <= limit + 1e-9).all()


CHANGES = [
    (c.SetShaper, {"name": "ei"}),
    (c.SetEstimator, {"name": "fixed", "f_d": (8.0,), "zeta": (0.2,)}),
    (c.SetPayload, {"mass": 1.0, "com": DISC.com, "inertia": DISC.inertia}),
]


@pytest.mark.parametrize(
    "activity", [Activity.MOVING, Activity.STREAMING, Activity.ENDING, Activity.STOPPING]
)
def test_shaper_estimator_and_payload_changes_in_motion_are_reproducible(activity):
    robots = [at(activity, calibration=calibration()) for _ in range(2)]
    for robot in robots:
        for kind, fields in CHANGES:
            assert robot.send(kind, **fields) == Done()
            robot.tick(20)
        if activity is Activity.STREAMING:
            robot.send(c.ServoStop)
        robot.until_rest()
        robot.tick(50)
        assert robot.states[-1].target_qd == pytest.approx([0.0] * 6, abs=1e-6)
        assert activity is not Activity.MOVING or robot.states[-1].target_q == pytest.approx(Q3, abs=1e-6)
        assert robot.kinds().count("shaper_changed") == 2
    assert bits(robots[0].states) == bits(robots[1].states)


@pytest.mark.parametrize("every", [1, 2, 3])
def test_a_move_ends_even_if_the_shaper_changes_all_the_time(every):
    robot = Robot(plant=NoArm())
    assert isinstance(robot.send(c.MoveJ, q=tuple(Q1 + 0.05)), Accepted)
    while robot.controller.motion.activity is Activity.MOVING:
        assert robot.send(c.SetShaper, name=("none", "zv")[len(robot.states) // every % 2]) == Done()
        robot.tick(every)
        assert len(robot.states) < 500
    assert "motion_done" in robot.kinds()
    assert robot.states[-1].target_q == pytest.approx(Q1 + 0.05, abs=1e-9)


@pytest.mark.parametrize("name", [*FITTING[:4], "none"])
def test_the_simulated_future_of_the_line_is_bit_equal_to_the_real_one(name):
    random = np.random.default_rng(FITTING.index(name) if name in FITTING else 99)
    line = without_arm(name)
    motion = line.begin(line.plan(Q3, PAPER))
    for moment in sorted(random.integers(2, 1100, 3)):
        while line.trajectory._ticks < moment and not line.at_rest and motion.rate == 1.0:
            line.step()
        ahead = Stopper(line).simulate_until_rest()
        assert ahead is not None
        if moment > 800:
            break
    for expected in ahead[2:]:
        line.step()
        assert (line.position == expected).all()
    assert line.at_rest
    assert np.abs(np.diff(ahead[resting_after(ahead) :], axis=0)).max(initial=0.0) <= STILL


@pytest.mark.parametrize("shaper", ["none", "zv", "ei3"])
def test_a_stream_is_stopped_if_its_filtered_end_would_collide(shaper):
    """With its own low acceleration the stream would only rest inside the floor; a hard stop does not."""
    robot, start = Robot(), np.array([0.0, -1.6, 0.0, -1.57, 0.0, 0.0])
    robot.send(c.SetShaper, name=shaper)
    robot.send(SimulationReset, q=tuple(start))
    robot.send(c.ServoStart, velocity=1.5, acceleration=1.0, jerk=100.0)
    q, speed, sequence = start.copy(), 0.0, 0
    while q[1] < -0.2:
        speed = min(speed + 0.9 * H, 1.0)
        q[1] += speed * H
        robot.setpoint(sequence, q)
        robot.tick()
        sequence += 1
    assert robot.controller.motion.streaming
    assert robot.send(c.ServoStop) == Done()
    robot.until_rest()
    ended = robot.told("stream_stopped")
    assert [event.code for event in ended] == ["collision"]
    assert "through the filter" in ended[0].why
    model = robot.controller.motion.collisions
    assert all(model.meeting(q) is None for q in robot.column("target_q"))


def test_info_lists_stopping_times_and_distances():
    info = info_of(Robot().controller).stopping
    assert [(row.payload, row.speed) for row in info] == [
        (mass, speed) for mass in (0.0, UR5E.limits.payload) for speed in (0.33, 0.66, 1.0)
    ]
    for slow, fast in itertools.pairwise(info[:3]):
        assert slow.duration < fast.duration
        assert slow.way < fast.way
    assert all(empty.way < loaded.way for empty, loaded in zip(info[:3], info[3:], strict=True))


SEVEN = str(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")
TORQUE = 1.001
"""Largest ratio of a shaped reference's torque to the limit, for sampling [-]."""
USED = 0.985
"""Smallest share of a limit that a move uses which is slower for it [-]: its torque is taken for proportional to its
acceleration, of which a shaper makes less where its impulses overlap less.
"""


def ratios(robot):
    """Return the largest velocity, acceleration and torque relative to the limits [-]."""
    arm, q = robot.description, np.array(robot.references)
    torque = np.abs(torques(arm, robot.payload, q)) / arm.limits.torque
    return np.array([*speeds(arm, q), torque.max()])


def assert_kept(robot, *, torque=True):
    found = ratios(robot)
    assert (found <= [WITHIN, WITHIN, TORQUE if torque else np.inf]).all(), found


@pytest.mark.parametrize(
    ("name", "shaper", "start", "goal"),
    [
        (
            SEVEN,
            "none",
            (1.958304, -1.028545, -1.13757, -1.139029, 1.528591, 1.698451, 0.433821),
            (-2.8215, -1.593834, 2.016334, -1.672621, 1.940885, 0.612649, -1.826071),
        ),
        (
            "ur30",
            "auto-target",
            (1.742287, -0.668323, -0.58706, -0.625696, -1.401523, 1.611268),
            (-3.068842, -2.55983, -0.295144, -0.865182, -0.721249, -0.326427),
        ),
    ],
    ids=["seven", "ur30"],
)
def test_moves_limited_by_torque_peaks_or_gravity_keep_all_limits(name, shaper, start, goal):
    arm = load(name)
    robot = Subject(arm, np.array(start), paper_payload(arm), shaper=shaper)
    reply = robot.send(c.MoveJ, q=goal, **own_limits(arm))
    assert isinstance(reply, Accepted), reply
    assert robot.until_rest()
    assert_kept(robot)
    assert reply.limited is None or ratios(robot).max() > USED, (reply.limited, ratios(robot))


def paper_robot(shaper, q=Q1):
    return Subject(UR5E, np.array(q), DISC, shaper=shaper)


@pytest.mark.parametrize("shaper", ["zv", "auto", "zvd"])
def test_a_tool_line_keeps_torque_limits(shaper):
    q = (0.0, -0.55, 1.0, -2.02, -1.57, 0.0)
    robot = paper_robot(shaper, q)
    x, y, z, *turn = robot.send(ForwardKinematics, q=q).pose
    reply = robot.send(MoveL, pose=(x, y, z + 0.25, *turn), velocity=3.0, acceleration=40.0, jerk=4000.0)
    assert isinstance(reply, Accepted), reply
    assert reply.limited.endswith("so that the torque of joint shoulder stays within 150 N m")
    assert robot.until_rest()
    assert_kept(robot)
    assert ratios(robot)[2] > 0.99


@pytest.mark.parametrize("kind", ["servo_j", "speed_j"])
def test_a_shaper_with_more_overshoot_slows_down_a_guided_motion(kind):
    robot = paper_robot("none")
    fastest = min(UR5E.limits.velocity) * (Q3 - Q1) / np.abs(Q3 - Q1).max()
    for tick in range(900):
        if tick == 100:
            assert not refused(robot.send(c.SetShaper, name="zvddd"))
        if tick % 50 == 0 and kind == "servo_j":
            reply = robot.send(c.ServoJ, q=tuple(Q3.tolist()), lookahead=0.03, gain=2000.0, shaped=True)
        elif tick % 50 == 0:
            qd = fastest if tick < 300 else 0.0 * fastest
            reply = robot.send(c.SpeedJ, qd=tuple(qd.tolist()), acceleration=40.0, shaped=True)
        assert isinstance(reply, Accepted), reply
        robot.tick()
    assert_kept(robot, torque=False)


@pytest.mark.parametrize("name", ["ur5e", "ur20"])
def test_a_move_planned_within_a_tick_keeps_limits_and_names_the_binding_one(name):
    """A torque halves its speed first, then a velocity reduces it a little."""
    arm = load(name)
    robot = Subject(arm, np.array(arm.poses["Q1"]), paper_payload(arm), shaper="zv")
    fields = {"velocity": min(arm.limits.velocity), "acceleration": 8.0, "jerk": 500.0}
    command = c.MoveJ(token=robot.token, q=arm.poses["Q3"], **fields)
    found = Planner(robot.controller.setup).plan(command, robot.controller.snapshot(), within_tick=True).found
    assert isinstance(found, PlannedMove)
    assert found.limited[0] == "limit_torque", found.limited
    robot.controller.motion.move(found)
    assert robot.until_rest()
    assert_kept(robot)
