"""The whole control line (Figure 6)."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.plant.arms import frames
from tests.search.spaces import BENT, pose_of, tool_pose

from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import STILL, Target, central_differences
from tvist_controller.line.drive_feed_forward import DriveFeedForward
from tvist_controller.line.joint_controllers import command_drives
from tvist_controller.line.line_mode import LineMode, check_change
from tvist_controller.setup import body, paper_payload
from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_protocol import commands as c
from tvist_protocol.motions import MoveL
from tvist_shaping.estimators.fixed import Fixed

from .robots import FITTING, PAPER, Q1, Q3, UR5E, H, Robot, cut, without_arm


def motion(line, target, limits=PAPER):
    """Return the shaped reference of a motion and after, and the ticks until rest."""
    line.begin(line.plan(np.array(target), limits))
    shaped, rested = [], None
    for tick in range(6000):
        line.step()
        shaped.append(line.position)
        if rested is None and line.at_rest:
            rested = tick
        if rested is not None and tick > rested + 600:
            return np.array(shaped), rested
    raise AssertionError("still moving")


@pytest.mark.parametrize("name", FITTING)
@pytest.mark.parametrize("target", [Q3, Q1 + 1e-3])
def test_the_line_is_at_rest_soon_after_the_last_movement(name, target):
    """The target is one tick behind the shaped reference, so rest is two ticks after the last movement.

    Up to two more where a small last impulse makes steps below 1e-7 rad that come to more than that together.
    """
    shaped, rested = motion(without_arm(name), target)
    steps = np.abs(np.diff(shaped, axis=0)).max(axis=1)
    last_moved = np.flatnonzero(steps > STILL)[-1] + 1
    assert last_moved + 2 <= rested <= last_moved + (2 if name in {"none", "zv"} else 4)
    assert (shaped[-1] == target).all()


@pytest.mark.parametrize("name", ["zv", "zvd", "ei3"])
def test_a_plateau_between_two_impulses_does_not_count_as_rest(name):
    """A jog of 0.1 mrad lasts 32 ms, the shaper 75 ms: the shaped reference stands in between."""
    line = without_arm(name, estimator=Fixed([6.7], [0.1]))
    shaped, rested = motion(line, Q1 + 1e-4)
    steps = np.abs(np.diff(shaped, axis=0)).max(axis=1)
    assert (steps[: rested - 2] < STILL).sum() > 15
    assert rested * H > line.tvist.delay
    assert np.abs(shaped[rested:] - Q1 - 1e-4).max() <= STILL
    assert (shaped[rested + 20 :] == Q1 + 1e-4).all()


def test_no_mode_without_filter_leads_to_a_shaped_one_before_rest():
    assert set(LineMode.STOPPING.followed_by) == {"REST", "STOPPING"}
    for mode in LineMode:
        if not mode.shaped:
            assert not any(LineMode[after].shaped for after in mode.followed_by if after != "REST")


def test_mode_changes_follow_the_table():
    for before in LineMode:
        for after in LineMode:
            if after.name in before.followed_by:
                check_change(before, after, guarded=True)
            else:
                with pytest.raises(ValueError, match=f"from {before.name} to {after.name}"):
                    check_change(before, after, guarded=True)


def unshaped(states, name):
    """Return position, velocity or acceleration before shaping, by default that of the target."""
    pairs = ((getattr(state, f"unshaped_{name}"), getattr(state, f"target_{name}")) for state in states)
    return np.array([target if own is None else own for own, target in pairs])


def line(robot):
    position, turned = tool_pose(robot.controller.setup.q, (0.0,) * 6)
    return robot.send(MoveL, pose=pose_of(position + np.array([0.1, 0.05, -0.1]), turned))


def joints(robot):
    return robot.send(c.MoveJ, q=tuple(Q3))


def stream(robot):
    robot.stream(300, 0.025, 20.0)
    robot.send(c.ServoStop)


MOTIONS = {"joints": (Q1, joints), "line": (BENT, line), "stream": (Q1, stream)}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shaper", ["zv", "ei"])
def test_unshaped_values_are_central_differences_of_the_reference(motion, shaper):
    start, begin = MOTIONS[motion]
    robot = Robot(q=tuple(start), shaper=shaper)
    robot.tick(5)
    begin(robot)
    robot.until_rest()
    robot.tick(50)
    states = robot.states
    reference = np.array([state.reference_q for state in states])
    assert np.abs(reference - np.array([state.target_q for state in states])).max() > 1e-3
    for name, expected in zip(("q", "qd", "qdd"), central_differences(reference), strict=True):
        # Velocities are differences of neighbours here, which rounds in another way.
        rounding = 1e-12 if name == "qd" else 0.0
        np.testing.assert_allclose(unshaped(states, name)[2:], expected, rtol=0.0, atol=rounding)


@pytest.mark.parametrize("motion", ["joints", "line"])
def test_unshaped_values_join_the_shaped_ones_in_a_stop_without_peaks(motion):
    start, begin = MOTIONS[motion]
    robot = Robot(q=tuple(start), shaper="zv")
    begin(robot)
    robot.tick(400)
    assert robot.states[-1].unshaped_q is not None
    before = len(robot.states)
    robot.send(c.Stop)
    robot.until_rest()
    for state in robot.states[before:]:
        assert state.unshaped_q is state.unshaped_qd is None
    velocity, acceleration = (np.abs(unshaped(robot.states, name)).max() for name in ("qd", "qdd"))
    shaped = robot.column("target_qdd")
    assert velocity < 2.0
    assert acceleration <= max(np.abs(shaped).max(), 2.1)


def test_the_architecture_page_draws_the_line_modes():
    picture = Path(__file__).parents[2] / "docs/images/line-modes.svg"
    drawn = " ".join(re.findall(r'data-ways="([^"]+)"', picture.read_text("utf-8"))).split()
    ways = {f"{mode.name}-{after}" for mode in LineMode for after in mode.followed_by if after != mode.name}
    assert sorted(drawn) == sorted(ways)


def tensor(values):
    xx, xy, xz, yy, yz, zz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def bodies(description, payload):
    """Return link number, mass, centre of mass and inertia of all moving bodies."""
    links = description.links
    yield from zip(range(1, description.joints + 1), links.mass, links.com, links.inertia, strict=True)
    yield description.joints, payload.mass, payload.com, payload.inertia


def mass_matrix_and_gravity(description, payload, q):
    """M = Σ m Jᵥᵀ Jᵥ + J_ωᵀ R I Rᵀ J_ω and g = Σ m Jᵥᵀ (0, 0, 9.81) with geometric Jacobians."""
    poses, n = frames(description, q), description.joints
    M, g = np.zeros((n, n)), np.zeros(n)
    for link, mass, com, inertia in bodies(description, payload):
        R = poses[link][:3, :3]
        centre = poses[link][:3, 3] + R @ np.array(com)
        J_v, J_w = np.zeros((2, 3, n))
        for joint in range(link):
            axis, origin = poses[joint][:3, 2], poses[joint][:3, 3]
            J_v[:, joint], J_w[:, joint] = np.cross(axis, centre - origin), axis
        M += mass * J_v.T @ J_v + J_w.T @ R @ tensor(inertia) @ R.T @ J_w
        g += mass * J_v.T @ [0.0, 0.0, 9.81]
    return M, g


def lagrange(description, payload, q, qd, qdd):
    """τ = M q̈ + Ṁ q̇ - ∂(½ q̇ᵀM q̇)/∂q + g, derivatives of M by central differences."""
    M, g = mass_matrix_and_gravity(description, payload, q)
    step = 1e-5

    def slope(direction):
        more = mass_matrix_and_gravity(description, payload, q + step * direction)[0]
        less = mass_matrix_and_gravity(description, payload, q - step * direction)[0]
        return (more - less) / (2 * step)

    gradient = np.array([0.5 * qd @ slope(axis) @ qd for axis in np.eye(len(q))])
    return M @ qdd + slope(qd) @ qd - gradient + g


@pytest.mark.parametrize("joints", [1, 2, 5, 6])
def test_inverse_dynamics_matches_the_lagrange_equations(joints):
    description = cut(joints)
    payload = Payload(mass=3.0, com=(0.05, -0.02, 0.08), inertia=(0.01, 0.001, 0.0, 0.012, 0.0, 0.008))
    dynamics, random = InverseDynamics(description, payload), np.random.default_rng(joints)
    for _ in range(10):
        q, qd, qdd = random.uniform(-3, 3, (3, joints))
        expected = lagrange(description, payload, q, qd, qdd)
        assert dynamics.torque(q, qd, qdd) == pytest.approx(expected, abs=2e-7)
        assert dynamics.gravity(q) == pytest.approx(
            mass_matrix_and_gravity(description, payload, q)[1], abs=1e-10
        )


def commanded(description, *targets):
    """Return the last of several drive commands, with torques of inverse dynamics."""
    dynamics = InverseDynamics(description, body(paper_payload(description)))
    rows, command = DriveFeedForward(description).rows, np.empty((3, description.joints))
    for target in targets:
        torque, gravity = dynamics.torque(target.q, target.qd, target.qdd), dynamics.gravity(target.q)
        command_drives(target.q, np.array([target.qd, target.qdd]), torque, gravity, rows, command)
    return DriveCommand(*command), torque, gravity


def test_feed_forward_contains_rotor_inertia_and_part_of_coulomb_friction():
    drives = UR5E.drives
    target = Target(
        Q1, np.array([0.5, -0.5, 0.01, 0.0, 1.0, -0.02]), np.array([1.0, -2.0, 0.0, 3.0, 0.5, 0.1])
    )
    command, torque, _ = commanded(UR5E, target)
    rotors = np.array(drives.rotor_inertia) * target.qdd
    share, width = drives.friction_feedforward, drives.friction_feedforward_width
    friction = share * np.array(drives.coulomb_friction) * np.tanh(target.qd / width)
    assert command.torque == pytest.approx(torque + rotors + friction, rel=1e-14)


def test_the_motor_leads_by_gear_wind_up_without_gravity():
    drives, still = UR5E.drives, np.zeros(6)
    moving = Target(Q1 + 0.1, still, np.array([1.0, -2.0, 0.5, 0.0, 0.0, 2.0]))
    command, torque, gravity = commanded(UR5E, Target(Q1, still, still), moving)
    lead = np.array(drives.windup_feedforward) * (torque - gravity) / np.array(drives.gear_stiffness)
    assert command.q == pytest.approx(moving.q + lead, abs=1e-15)
    assert command.qd == pytest.approx(lead / H, abs=1e-12)
    assert np.abs(lead).max() > 1e-5
