"""Differentiator, inverse dynamics, joint controllers and kinematics, each against another way."""

import numpy as np
import pytest
from tests.plant.arms import frames

from tvist_controller.line.differentiator import Differentiator, Target
from tvist_controller.line.drive_feed_forward import DriveFeedForward
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.joint_controllers import command_drives
from tvist_controller.setup import body, paper_payload
from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand

from .robots import Q1, UR5E, H, cut


def updated(differentiator, q):
    """Take the reference of a tick; return the target of the tick before."""
    differentiator.push(q)
    return differentiator.published


def parabola(tick):
    """1.1 - 0.7 t + 1.3 t² and another joint."""
    time = H * tick
    return np.array([1.1 - 0.7 * time + 1.3 * time**2, -2.0 + 0.5 * time])


def test_on_a_parabola_position_velocity_and_acceleration_are_those_of_the_tick_before():
    differentiator = Differentiator(parabola(-2), H)
    for tick in range(-1, 50):
        target = updated(differentiator, parabola(tick))
    time = H * 48
    assert (target.q == parabola(48)).all()
    assert target.qd == pytest.approx([-0.7 + 2.6 * time, 0.5], abs=1e-12)
    assert target.qdd == pytest.approx([2.6, 0.0], abs=1e-9)


def tensor(values):
    xx, xy, xz, yy, yz, zz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def bodies(description, payload):
    """Number of the link, mass, centre of mass and inertia of everything that moves."""
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
def test_torques_are_those_of_lagrange(joints):
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


def command_of(controllers, target, torque, gravity):
    command = np.empty((3, len(torque)))
    command_drives(target.q, np.array([target.qd, target.qdd]), torque, gravity, controllers.rows, command)
    return DriveCommand(*command)


def commanded(description, *targets):
    """Last of several drive commands, with torque and gravity as inverse dynamics gives them."""
    dynamics = InverseDynamics(description, body(paper_payload(description)))
    controllers = DriveFeedForward(description, H)
    for target in targets:
        torque, gravity = dynamics.torque(target.q, target.qd, target.qdd), dynamics.gravity(target.q)
        command = command_of(controllers, target, torque, gravity)
    return command, torque, gravity


def test_the_feed_forward_has_rotor_inertia_and_a_share_of_coulomb_friction():
    drives = UR5E.drives
    target = Target(
        Q1, np.array([0.5, -0.5, 0.01, 0.0, 1.0, -0.02]), np.array([1.0, -2.0, 0.0, 3.0, 0.5, 0.1])
    )
    command, torque, _ = commanded(UR5E, target)
    rotors = np.array(drives.rotor_inertia) * target.qdd
    share, width = drives.friction_feedforward, drives.friction_feedforward_width
    friction = share * np.array(drives.coulomb_friction) * np.tanh(target.qd / width)
    assert command.torque == pytest.approx(torque + rotors + friction, rel=1e-14)


def test_the_motor_leads_by_a_share_of_the_gears_wind_up_and_gravitys_own_is_left():
    drives, still = UR5E.drives, np.zeros(6)
    moving = Target(Q1 + 0.1, still, np.array([1.0, -2.0, 0.5, 0.0, 0.0, 2.0]))
    command, torque, gravity = commanded(UR5E, Target(Q1, still, still), moving)
    lead = np.array(drives.windup_feedforward) * (torque - gravity) / np.array(drives.gear_stiffness)
    assert command.q == pytest.approx(moving.q + lead, abs=1e-15)
    assert command.qd == pytest.approx(lead / H, abs=1e-12)
    assert np.abs(lead).max() > 1e-5
