"""Guided motions servo_j, speed_j and speed_l: their start, course and end."""

import numpy as np
import pytest

from tvist_controller.kinematics.arm import Arm
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.io import SetTcp
from tvist_protocol.replies import Accepted, Done
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.transitions import Activity

from .robots import ROUNDING, UR5E, H, NoArm, Robot

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


@pytest.mark.parametrize("shaped", [False, True])
def test_consecutive_guided_commands_are_one_motion_done_at_rest(shaped):
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


def test_a_guided_motion_takes_over_a_planned_one_without_a_jump():
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
    rise = []
    for shaped in (False, True):
        arm = robot(shaper="zv")
        arm.send(m.ServoJ, q=BESIDE, shaped=shaped)
        rise.append(arm.tick(60).target_q[0])
    assert rise[1] < rise[0] - 1e-3
    arm = robot()
    arm.send(c.MoveJ, q=BESIDE)
    arm.tick(50)
    reply = arm.send(m.ServoJ, q=BESIDE, shaped=True)
    assert (reply.code, reply.where) == ("busy", "shaped")
    assert activity(arm) is Activity.MOVING


@pytest.mark.parametrize(("lookahead", "gain"), [(0.03, 1200.0), (0.1, 300.0), (0.1, 2000.0), (0.2, 100.0)])
def test_servo_j_lags_a_ramp_by_its_lookahead_plus_two_ticks(lookahead, gain):
    arm, speed = robot(), 0.5
    for tick in range(1000):
        wanted = HOME[0] + speed * H * tick
        arm.send(m.ServoJ, q=(wanted, *HOME[1:]), lookahead=lookahead, gain=gain)
        arm.tick()
    lag = (wanted - arm.states[-1].target_q[0]) / speed
    assert lag == pytest.approx(lookahead + 2 * H, abs=1e-4)  # 34 ms at 0.03, as measured on a UR10e


@pytest.mark.parametrize(
    ("lookahead", "gain", "way"),
    [(0.03, 100.0, 1e-3), (0.03, 2000.0, 0.5), (0.1, 300.0, 0.5), (0.2, 2000.0, 0.03)],
)
def test_servo_j_reaches_its_posture_with_hardly_any_overshoot(lookahead, gain, way):
    arm = robot()
    arm.send(m.ServoJ, q=(HOME[0] + way, *HOME[1:]), lookahead=lookahead, gain=gain)
    arm.until_rest()
    arm.tick(2)
    gone = (arm.column("target_q")[:, 0] - HOME[0]) / way
    assert gone.max() <= 1.005
    assert arm.states[-1].target_q == [HOME[0] + way, *HOME[1:]]
    assert arm.kinds()[-1] == "motion_done"


@pytest.mark.parametrize(
    ("kind", "fields"),
    [
        (m.ServoJ, {"q": (2 * np.pi, *HOME[1:]), "lookahead": 0.03}),
        (m.SpeedJ, {"qd": (3.0, *REST[1:]), "acceleration": 10.0}),
    ],
)
def test_a_guided_motion_stops_inside_the_range_and_keeps_the_limits(kind, fields):
    arm = robot()
    arm.send(kind, **fields)
    arm.until_rest()
    assert 2 * np.pi - 0.2 < arm.column("target_q")[:, 0].max() <= 2 * np.pi
    assert np.abs(velocities(arm)).max() <= UR5E.limits.velocity[0] * 1.0001
    assert np.abs(accelerations(arm)).max() <= UR5E.limits.acceleration[0] + ROUNDING
    ended = ending(arm)
    assert ended.code == "limit_position"
    stop = arm.column("target_q")[ended.tick - 5 :]  # and before: the stop continues the motion
    assert np.abs(np.diff(stop, 3, axis=0)).max() / H**3 <= UR5E.limits.jerk[0] * (1 + 1e-6)


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


def test_reduced_mode_limits_guided_motions():
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


def poses(arm, tcp=(0.0,) * 6):
    kinematics = Arm(UR5E, tcp)
    return np.array([kinematics.motion(np.array(q), np.zeros(6))[:6] for q in arm.column("target_q")])


def off_line(pose, xd):
    """Return the tool's distances from a line from its start in this direction."""
    way, direction = pose[:, :3] - pose[0, :3], np.array(xd) / np.linalg.norm(xd)
    return np.abs(way - np.outer(way @ direction, direction)).max(axis=1)


def ending(arm):
    """Return the event of the first stopped motion."""
    return arm.told("motion_stopped")[0]


@pytest.mark.parametrize("tcp", [REST, (0.05, 0.0, 0.2, 0.0, 0.5, 0.0)])
def test_speed_l_moves_the_tool_straight_without_turning(tcp):
    arm, xd = robot(), np.array((-0.5, 0.05, 0.1))
    arm.send(SetTcp, offset=tcp)
    arm.send(m.SpeedL, xd=(*xd, 0.0, 0.0, 0.0))
    arm.tick(300)
    pose = poses(arm, tcp)
    assert off_line(pose, xd).max() < 1e-9
    assert np.ptp(pose[:, 3:], axis=0).max() < 1e-9
    speed = np.linalg.norm(np.diff(pose[:, :3], axis=0), axis=1) / H
    assert np.abs(np.diff(speed)).max() / H <= 1.2 * (1 + 1e-4)
    assert speed[-1] == pytest.approx(np.linalg.norm(xd), rel=1e-6)


def test_speed_l_slows_down_and_stops_before_a_singular_posture():
    arm, xd = robot(), (0.25, 0.1, 0.1)
    arm.send(m.SpeedL, xd=(*xd, 0.0, 0.0, 0.0))
    arm.until_rest()
    ended, pose = ending(arm), poses(arm)
    assert ended.code == "singular"
    moved = [state.tick <= ended.tick for state in arm.states]
    assert off_line(pose, xd)[moved].max() < 1e-4
    assert np.linalg.norm(np.diff(pose[:, :3], axis=0), axis=1)[ended.tick - 3] / H < 0.02
    assert np.abs(velocities(arm)).max() <= UR5E.limits.velocity[0]
    assert np.abs(accelerations(arm)).max() <= UR5E.limits.acceleration[0]


def test_stop_j_brakes_in_phase_with_its_deceleration():
    arm, qd = robot(), np.array((0.5, -0.25, 0.1, 0.0, 0.0, 0.3))
    arm.send(m.SpeedJ, qd=tuple(qd))
    arm.tick(300)
    begun = len(arm.states)
    assert arm.send(m.StopJ, acceleration=4.0) == Done()
    assert activity(arm) is Activity.STOPPING
    arm.until_rest()
    ended = ending(arm)
    assert (ended.why, ended.category) == ("stop_j was commanded", 2)
    assert ended.duration == pytest.approx(0.125)
    assert ended.way == pytest.approx(0.5 * 0.125 * 0.5)
    braking = velocities(arm)[begun:]
    share = braking @ qd / (qd @ qd)
    assert np.abs(braking - share[:, None] * qd).max() < 1e-9
    assert np.abs(accelerations(arm)[begun:]).max() == pytest.approx(4.0, rel=1e-6)


def test_stop_l_keeps_the_tool_on_its_line():
    arm, xd = robot(), (0.2, 0.1, 0.0)
    arm.send(m.SpeedL, xd=(*xd, 0.0, 0.0, 0.0))
    arm.tick(200)
    begun = len(arm.states)
    arm.send(m.StopL, acceleration=2.0)
    arm.until_rest()
    assert off_line(poses(arm), xd).max() < 1e-9
    assert (len(arm.states) - begun) * H == pytest.approx(np.hypot(0.2, 0.1) / 2.0, abs=5 * H)


@pytest.mark.parametrize(("kind", "fields"), [
    (m.ServoJ, {"q": BESIDE}), (m.SpeedJ, {"qd": (0.5, *REST[1:])}), (m.SpeedL, {"xd": (0.2, *REST[1:])}),
])  # fmt: skip
def test_a_gentler_stop_during_a_stop_changes_nothing(kind, fields):
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
