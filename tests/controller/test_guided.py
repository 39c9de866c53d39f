"""Guided motions: servo_j, speed_j and speed_l, what they do, and how they begin and end."""

import numpy as np
import pytest

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import turn
from tvist_controller.trajectory import MotionLimits, Speed
from tvist_controller.trajectory.guided import _step
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.io import SetTcp
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.transitions import Activity

from .robots import UR5E, H, NoArm, Robot

HOME = np.array((1.57, -1.57, 1.57, -1.57, -1.57, 0.0))
REST = (0.0,) * 6
BESIDE = (1.97, *HOME[1:])


def robot(**changes):
    return Robot(**({"q": tuple(HOME), "plant": NoArm()} | changes))


def velocities(robot):
    return np.diff(robot.column("target_q"), axis=0) / H


def accelerations(robot):
    return np.diff(robot.column("target_q"), 2, axis=0) / H**2


def activity(robot):
    return robot.controller.motion.activity


def last(robot):
    return robot.events[-1]


# ---------------------------------------------------------------- numbers and events


@pytest.mark.parametrize("shaped", [False, True])
def test_a_run_of_commands_is_one_motion_that_is_done_at_rest(shaped):
    arm = robot()
    assert arm.send(m.SpeedJ, qd=(0.3, 0, 0, 0, 0, 0), shaped=shaped) == Accepted(id=1)
    arm.tick(100)
    assert arm.send(m.SpeedL, xd=(0.0, 0.05, 0.0, 0.0, 0.0, 0.0), shaped=shaped) == Accepted(id=1)
    arm.tick(100)
    assert arm.send(m.ServoJ, q=BESIDE, shaped=shaped) == Accepted(id=1)
    arm.until_rest()
    arm.tick(2)
    assert [(event.kind, event.id) for event in arm.events] == [("motion_started", 1), ("motion_done", 1)]
    assert arm.states[-1].target_q == pytest.approx(BESIDE, abs=1e-7)
    assert activity(arm) is Activity.REST
    assert arm.send(m.ServoJ, q=tuple(HOME)) == Accepted(id=2)


def test_a_planned_motion_is_taken_over_without_a_jump():
    arm = robot(shaper="zv")
    arm.send(c.MoveJ, q=BESIDE)
    arm.tick(150)
    before = velocities(arm)[-1]
    assert arm.send(m.SpeedJ, qd=(0.5, 0, 0, 0, 0, 0), acceleration=1.0) == Accepted(id=2)
    arm.tick(4)
    ended = [(event.kind, event.id, event.why) for event in arm.events if event.kind != "warning"]
    assert ended == [
        ("motion_started", 1, None),
        ("motion_stopped", 1, "speed_j took over"),
        ("motion_started", 2, None),
    ]
    assert velocities(arm)[-1] == pytest.approx(before, abs=4 * H * 2.5)
    assert np.abs(accelerations(arm)).max() <= 2.1


def test_only_a_motion_that_begins_at_rest_is_shaped():
    arm = robot()
    arm.send(c.MoveJ, q=BESIDE)
    arm.tick(50)
    reply = arm.send(m.ServoJ, q=BESIDE, shaped=True)
    assert (reply.code, reply.where) == ("busy", "shaped")
    assert activity(arm) is Activity.MOVING
    arm.send(m.ServoJ, q=BESIDE)
    assert arm.send(m.SpeedJ, qd=REST, shaped=True).code == "busy"
    assert arm.send(c.Pause).code == "wrong_mode"


def test_the_shaper_acts_only_if_asked():
    rise = []
    for shaped in (False, True):
        arm = robot(shaper="zv")
        arm.send(m.ServoJ, q=BESIDE, shaped=shaped)
        rise.append(arm.tick(60).target_q[0])
    assert rise[1] < rise[0] - 1e-3


@pytest.mark.parametrize(
    ("kind", "fields", "code", "where"),
    [
        (m.ServoJ, {"q": (7.0, *REST[1:])}, "limit_position", "q[0]"),
        (m.ServoJ, {"q": (0.0,)}, "out_of_range", "q"),
        (m.SpeedJ, {"qd": (0.0, 3.2, 0.0, 0.0, 0.0, 0.0)}, "limit_velocity", "qd[1]"),
        (m.SpeedJ, {"qd": (0.0,) * 5}, "out_of_range", "qd"),
        (m.SpeedJ, {"qd": REST, "acceleration": 41.0}, "limit_acceleration", "acceleration"),
    ],
)
def test_what_the_arm_cannot_do_is_refused(kind, fields, code, where):
    reply = robot().send(kind, **fields)
    assert isinstance(reply, Refused)
    assert (reply.code, reply.where) == (code, where)


# ---------------------------------------------------------------- servo_j


@pytest.mark.parametrize(("lookahead", "gain"), [(0.03, 1200.0), (0.1, 300.0), (0.1, 2000.0), (0.2, 100.0)])
def test_a_ramp_is_followed_with_a_lag_of_lookahead_and_two_ticks(lookahead, gain):
    arm, speed = robot(), 0.5
    for tick in range(1000):
        wanted = HOME[0] + speed * H * tick
        arm.send(m.ServoJ, q=(wanted, *HOME[1:]), lookahead=lookahead, gain=gain)
        arm.tick()
    lag = (wanted - arm.states[-1].target_q[0]) / speed
    assert lag == pytest.approx(lookahead + 2 * H, abs=1e-4)  # 34 ms at 0.03, as measured on a UR10e


@pytest.mark.parametrize(
    ("lookahead", "gain", "way"),
    [
        (0.03, 100.0, 1e-3),
        (0.03, 300.0, 0.03),
        (0.03, 2000.0, 0.5),
        (0.1, 100.0, 0.03),
        (0.1, 300.0, 0.5),
        (0.1, 2000.0, 1e-3),
        (0.2, 100.0, 0.5),
        (0.2, 300.0, 1e-3),
        (0.2, 2000.0, 0.03),
    ],
)
def test_a_posture_is_reached_exactly_and_hardly_overshot(lookahead, gain, way):
    arm = robot()
    arm.send(m.ServoJ, q=(HOME[0] + way, *HOME[1:]), lookahead=lookahead, gain=gain)
    arm.until_rest()
    arm.tick(2)
    gone = (arm.column("target_q")[:, 0] - HOME[0]) / way
    assert gone.max() <= 1.005
    assert arm.states[-1].target_q == [HOME[0] + way, *HOME[1:]]
    assert last(arm).kind == "motion_done"


def test_a_higher_gain_begins_more_quickly():
    begun = []
    for gain in (300.0, 2000.0):
        arm = robot()
        arm.send(m.ServoJ, q=(HOME[0] + 1e-3, *HOME[1:]), lookahead=0.1, gain=gain)
        begun.append(arm.tick(10).target_q[0])
    assert begun[1] > begun[0] + 1e-5


def test_lookahead_and_gain_are_clipped():
    ends = []
    for lookahead, gain in ((0.03, 2000.0), (1e-6, 1e6)):
        arm = robot()
        arm.send(m.ServoJ, q=BESIDE, lookahead=lookahead, gain=gain)
        ends.append(arm.tick(100).target_q)
    assert ends[0] == ends[1]


@pytest.mark.parametrize(("k", "damping"), [(300.0, 31.0), (2000.0, 200.0), (400.0, 40.0)])
def test_a_step_of_the_spring_is_that_of_its_differential_equation(k, damping):
    matrix = np.array([[0.0, 1.0], [-k, -damping]]) * H
    series, power = np.eye(2), np.eye(2)
    for order in range(1, 30):
        power = power @ matrix / order
        series = series + power
    assert np.array(_step(k, damping, H)) == pytest.approx(series, abs=1e-12)


def test_it_stops_inside_the_range_and_keeps_the_limits():
    arm = robot()
    arm.send(m.ServoJ, q=(2 * np.pi, *HOME[1:]), lookahead=0.03)
    arm.until_rest()
    q = arm.column("target_q")[:, 0]
    assert q.max() <= 2 * np.pi
    assert np.abs(velocities(arm)).max() <= UR5E.limits.velocity[0] * 1.0001
    assert np.abs(accelerations(arm)).max() <= UR5E.limits.acceleration[0]
    assert np.abs(np.diff(accelerations(arm), axis=0)).max() / H <= UR5E.limits.jerk[0] * 1.01


def test_a_posture_in_collision_is_not_reached():
    arm = robot()
    arm.send(m.ServoJ, q=(1.57, 0.3, 0.5, -1.57, -1.57, 0.0), lookahead=0.2)
    arm.until_rest()
    ended = next(event for event in arm.events if event.kind == "motion_stopped")
    assert (ended.code, ended.id) == ("collision", 1)
    assert arm.controller.motion.collisions.meeting(np.array(arm.states[-1].target_q)) is None


def test_a_step_does_not_overload_the_drives_of_the_flexible_arm():
    arm = Robot(q=tuple(UR5E.poses["Q1"]))
    arm.send(m.ServoJ, q=tuple(UR5E.poses["Q3"]))
    arm.until_rest()
    assert last(arm).kind == "motion_done"


# ---------------------------------------------------------------- speed_j


def test_a_step_that_the_acceleration_allows_takes_one_tick_and_lands_exactly():
    arm = Speed((HOME, np.zeros(6), np.zeros(6)), MotionLimits(3.14, 40.0, 2000.0), Anything(), H)
    random, before = np.random.default_rng(1), np.zeros(6)
    for _ in range(200):
        qd = before + random.uniform(-0.02, 0.02, 6)
        arm.aim(qd, float(np.abs(qd - before).max() / H))
        q = arm.state[0]
        after = arm.next()
        assert np.array_equal(arm.state[1], qd)
        assert after - q == pytest.approx(0.5 * H * (before + qd), abs=1e-15)
        before = qd


class Anything:
    """Torque without a limit."""

    def allows(self, *_):
        return True

    def acceleration(self, *_):
        return np.inf


@pytest.mark.parametrize(("fraction", "ticks"), [(1.0, 1), (0.5, 2), (0.25, 4)])
def test_the_slider_stretches_a_step_at_constant_acceleration(fraction, ticks):
    arm = robot()
    arm.send(c.SetSpeed, fraction=fraction)
    arm.tick(3)
    qd = np.array((0.004, -0.002, 0.0, 0.0, 0.0, 0.001))
    arm.send(m.SpeedJ, qd=tuple(qd), acceleration=2.0)
    arm.tick(ticks + 4)
    steps = np.diff(velocities(arm)[:, 0]) / H  # the first is half a tick of acceleration
    assert np.allclose(velocities(arm)[-1], fraction * qd, rtol=0, atol=1e-9)
    expected = fraction**2 * 2.0 * np.array([0.5, *[1.0] * (ticks - 1), 0.5])
    begun = int(np.flatnonzero(np.abs(steps) > 1e-6)[0])
    assert steps[begun : begun + ticks + 1] == pytest.approx(expected, abs=1e-6)


def test_the_joints_stay_in_phase_and_the_velocity_is_kept():
    arm, qd = robot(), np.array((0.3, -0.6, 0.1, 0.0, 0.2, -0.3))
    arm.send(m.SpeedJ, qd=tuple(qd), acceleration=1.5)
    arm.tick(300)
    gone = arm.column("target_q") - HOME
    share = gone @ qd / (qd @ qd)
    assert np.abs(gone - share[:, None] * qd).max() < 1e-12
    assert velocities(arm)[-1] == pytest.approx(qd, abs=1e-9)
    assert np.abs(accelerations(arm)).max() == pytest.approx(1.5, rel=1e-6)
    assert activity(arm) is Activity.GUIDED


def test_a_change_of_the_slider_does_not_jump_and_the_speed_follows():
    arm = robot()
    arm.send(m.SpeedJ, qd=(0.6, 0, 0, 0, 0, 0), acceleration=2.0)
    arm.tick(250)
    for fraction in (0.1, 0.0, 1.0):
        arm.send(c.SetSpeed, fraction=fraction)
        state = arm.tick(350)
        assert velocities(arm)[-1, 0] == pytest.approx(0.6 * fraction, abs=1e-9)
        assert state.speed_scaling == pytest.approx(fraction)
    assert np.abs(accelerations(arm)).max() <= 2.0 * (1 + 1e-6)


@pytest.mark.parametrize(
    ("first", "then", "acceleration"),
    [((0, 0, 0, 0, 3.1, 0), (0, 0, 0, 0, -3.1, 3.1), 5.0), ((0, 0, 0, 0, 1, 0), (0, 0, 0, 0, -1, 3.1), 5.0)],
)
def test_joints_that_turn_back_keep_reduced_speed(first, then, acceleration):
    arm = Robot(q=(-1.0, -1.3, 1.4, -1.6, -1.6, 0.0))
    arm.send(SimulationInject, fault="reduced")
    for qd in (first, then):
        arm.send(m.SpeedJ, qd=qd, acceleration=acceleration)
        arm.tick(200)
    assert np.abs(arm.column("target_qd")).max() <= arm.controller.motion.motions.slowest * (1.0 + 1e-9)


def test_reduced_speed_limits_what_is_guided():
    most = 0.25 * UR5E.limits.velocity[0]
    for kind, fields in (
        (m.SpeedJ, {"qd": (1.5, 0, 0, 0, 0, 0), "acceleration": 5.0}),
        (m.ServoJ, {"q": (HOME[0] + 3.0, *HOME[1:])}),
        (m.SpeedL, {"xd": (-0.7, 0, 0, 0, 0, 0), "acceleration": 5.0}),
    ):
        arm = robot()
        arm.send(kind, **fields)
        arm.tick(150)
        assert np.abs(velocities(arm)[-1]).max() > most
        arm.send(SimulationInject, fault="reduced")
        arm.tick(150)
        assert np.abs(velocities(arm)[-1]).max() <= most * (1 + 1e-6)
        assert activity(arm) is Activity.GUIDED
        assert np.abs(accelerations(arm)).max() <= UR5E.limits.acceleration[0]


def test_the_range_ends_a_motion_inside_it():
    arm = robot()
    arm.send(m.SpeedJ, qd=(3.0, 0, 0, 0, 0, 0), acceleration=10.0)
    arm.until_rest()
    ended = next(event for event in arm.events if event.kind == "motion_stopped")
    assert ended.code == "limit_position"
    assert 2 * np.pi - 0.2 < arm.column("target_q")[:, 0].max() <= 2 * np.pi


def test_the_lease_is_the_dead_man_s_switch():
    arm = robot(clock="realtime", lease_s=0.2)
    arm.send(m.SpeedJ, qd=(0.3, 0, 0, 0, 0, 0))
    arm.tick(99)
    assert activity(arm) is Activity.GUIDED
    arm.until_rest()
    assert [event.kind for event in arm.events][-2:] == ["lease_lost", "motion_stopped"]


# ---------------------------------------------------------------- speed_l


def poses(arm, tcp=(0.0,) * 6):
    kinematics = Arm(UR5E, tcp)
    return np.array([kinematics.motion(np.array(q), np.zeros(6))[:6] for q in arm.column("target_q")])


@pytest.mark.parametrize("tcp", [REST, (0.05, 0.0, 0.2, 0.0, 0.5, 0.0)])
@pytest.mark.parametrize("xd", [(0.1, 0.05, -0.05), (0.0, -0.2, 0.0), (-0.5, 0.0, 0.1)])
def test_the_tool_goes_straight_and_does_not_turn(tcp, xd):
    arm = robot()
    arm.send(SetTcp, offset=tcp)
    arm.send(m.SpeedL, xd=(*xd, 0.0, 0.0, 0.0))
    arm.tick(300)
    pose, direction = poses(arm, tcp), np.array(xd) / np.linalg.norm(xd)
    way = pose[:, :3] - pose[0, :3]
    assert np.abs(way - np.outer(way @ direction, direction)).max() < 1e-9
    assert np.ptp(pose[:, 3:], axis=0).max() < 1e-9
    speed = np.linalg.norm(np.diff(pose[:, :3], axis=0), axis=1) / H
    assert np.abs(np.diff(speed)).max() / H <= 1.2 * (1 + 1e-4)
    assert speed[-1] == pytest.approx(np.linalg.norm(xd), rel=1e-6)


def test_the_tool_turns_about_its_centre_point():
    arm, tcp = robot(), (0.0, 0.0, 0.15, 0.0, 0.0, 0.0)
    arm.send(SetTcp, offset=tcp)
    arm.send(m.SpeedL, xd=(0.0, 0.0, 0.0, 0.0, 0.0, 0.3))
    arm.tick(400)
    pose = poses(arm, tcp)
    assert np.ptp(pose[:, :3], axis=0).max() < 1e-9
    assert abs(velocities(arm)[-1]).max() > 0.1


def test_before_a_singular_posture_the_tool_slows_down_and_then_stops():
    arm = robot()
    arm.send(m.SpeedL, xd=(0.25, 0.1, 0.1, 0.0, 0.0, 0.0))
    arm.until_rest()
    ended = next(event for event in arm.events if event.kind == "motion_stopped")
    assert ended.code == "singular"
    pose, direction = poses(arm), np.array((0.25, 0.1, 0.1))
    direction /= np.linalg.norm(direction)
    way = pose[:, :3] - pose[0, :3]
    moved = [state.tick <= ended.tick for state in arm.states]
    assert np.abs(way - np.outer(way @ direction, direction))[moved].max() < 1e-4
    speed = np.linalg.norm(np.diff(pose[:, :3], axis=0), axis=1) / H
    assert speed[ended.tick - 3] < 0.02
    assert np.abs(velocities(arm)).max() <= UR5E.limits.velocity[0]
    assert np.abs(accelerations(arm)).max() <= UR5E.limits.acceleration[0]


def test_at_a_singular_posture_the_tool_moves_where_it_can():
    arm = Robot(q=(0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.5, 0.0), plant=NoArm())  # stretched upwards
    arm.send(m.SpeedL, xd=(0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
    arm.until_rest()
    assert last(arm).code == "singular"
    assert np.isfinite(arm.column("target_q")).all()


def test_the_jacobian_is_the_derivative_of_the_pose():
    kinematics = Arm(UR5E).with_tool((0.1, -0.05, 0.2, 0.3, 0.1, -0.2))
    jacobian, step = kinematics.jacobian(HOME), 1e-6
    for joint, column in enumerate(jacobian.T):
        (before, p), (after, r) = (
            kinematics.pose(HOME + sign * step * np.eye(6)[joint]) for sign in (-1.0, 1.0)
        )
        found = np.concatenate((r - p, turn(before, after))) / (2 * step)
        assert found == pytest.approx(column, abs=1e-8)


# ---------------------------------------------------------------- stops


def test_stop_j_brakes_in_phase_with_its_deceleration():
    arm, qd = robot(), np.array((0.5, -0.25, 0.1, 0.0, 0.0, 0.3))
    arm.send(m.SpeedJ, qd=tuple(qd))
    arm.tick(300)
    begun = len(arm.states)
    assert arm.send(m.StopJ, acceleration=4.0) == Done()
    assert activity(arm) is Activity.STOPPING
    arm.until_rest()
    ended = next(event for event in arm.events if event.kind == "motion_stopped")
    assert (ended.why, ended.category) == ("stop_j was commanded", 2)
    assert ended.duration == pytest.approx(0.125)
    assert ended.way == pytest.approx(0.5 * 0.125 * 0.5)
    braking = velocities(arm)[begun:]
    share = braking @ qd / (qd @ qd)
    assert np.abs(braking - share[:, None] * qd).max() < 1e-9
    assert np.abs(accelerations(arm)[begun:]).max() == pytest.approx(4.0, rel=1e-6)


def test_stop_l_keeps_the_tool_on_its_line():
    arm = robot()
    arm.send(m.SpeedL, xd=(0.2, 0.1, 0.0, 0.0, 0.0, 0.0))
    arm.tick(200)
    begun = len(arm.states)
    arm.send(m.StopL, acceleration=2.0)
    arm.until_rest()
    pose, direction = poses(arm)[:, :3], np.array((0.2, 0.1, 0.0)) / np.hypot(0.2, 0.1)
    way = pose - pose[0]
    assert np.abs(way - np.outer(way @ direction, direction)).max() < 1e-9
    assert (len(arm.states) - begun) * H == pytest.approx(np.hypot(0.2, 0.1) / 2.0, abs=5 * H)


@pytest.mark.parametrize("kind", [m.StopJ, m.StopL])
def test_a_planned_motion_stops_on_its_path_and_at_rest_nothing_happens(kind):
    arm = robot(shaper="zv")
    assert arm.send(kind) == Done()
    arm.tick(2)
    assert not arm.events
    arm.send(c.MoveJ, q=(2.37, -1.57, 1.77, -1.57, -1.57, 0.0))
    arm.tick(200)
    arm.send(kind, acceleration=1.5)
    arm.until_rest()
    ended = next(event for event in arm.events if event.kind == "motion_stopped")
    assert ended.why.startswith(("stop_j was commanded", "stop_l was commanded"))
    gone = arm.column("target_q") - HOME
    assert np.abs(gone[:, 2] - 0.25 * gone[:, 0]).max() < 1e-9


@pytest.mark.parametrize("kind", [m.ServoJ, m.SpeedJ, m.SpeedL])
def test_a_stop_during_a_stop_is_not_gentler(kind):
    fields = {m.ServoJ: {"q": BESIDE}, m.SpeedJ: {"qd": (0.5, 0, 0, 0, 0, 0)}}.get(
        kind, {"xd": (0.2, 0, 0, 0, 0, 0)}
    )
    ticks = []
    for gentler in (False, True):
        arm = robot()
        arm.send(kind, **fields)
        arm.tick(60)
        arm.send(m.StopJ, acceleration=4.0)
        arm.tick(3)
        if gentler:
            arm.send(c.Stop, deceleration=1.0)
        arm.until_rest()
        ticks.append(len(arm.states))
    assert ticks[0] == ticks[1]
