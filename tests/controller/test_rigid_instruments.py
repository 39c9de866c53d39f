"""Motion of the tool and force at it, compiled, against pinocchio and numpy."""

import numpy as np
import pinocchio as pin
import pytest

from tvist_controller.instruments import wrench as module
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import (
    ACTUAL_MOMENT,
    ACTUAL_Q,
    DAMPING,
    NEAR_SINGULAR,
    ROWS,
    SHAPED_MOMENT,
    SHAPED_QD,
    SHAPED_QDD,
)
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import rotation_vector
from tvist_plant.chain import chain_of
from tvist_plant.description import Payload, load
from tvist_plant.model import FLANGE, rigid_model

OFFSETS = ((0.0,) * 6, (0.1, -0.2, 0.3, 0.4, -1.0, 2.0))
STRETCHED = (0.3, -1.0, 0.0, 0.0, 0.0, 0.2)


@pytest.fixture(scope="module")
def arm():
    return load("ur5e")


def placed(model, q, offset):
    """Placement, and the Jacobian in the base's axes, of a point of the flange."""
    data, flange = model.createData(), model.getFrameId(FLANGE)
    J = pin.computeFrameJacobian(model, data, q, flange, pin.LOCAL_WORLD_ALIGNED)
    rotation, position = data.oMf[flange].rotation.copy(), data.oMf[flange].translation.copy()
    lever = rotation @ np.array(offset[:3])
    J[:3] -= pin.skew(lever) @ J[3:]
    return position + lever, rotation @ pin.exp3(np.array(offset[3:])), J


@pytest.mark.parametrize("offset", OFFSETS, ids=["flange", "tool"])
def test_the_tool_moves_as_differences_of_its_poses_say(arm, offset):
    model, body, random = rigid_model(arm, Payload()), RigidBody(arm), np.random.default_rng(2)
    kinematics = Arm(arm, offset)
    h = 1e-4
    for _ in range(20):
        q, qd, qdd = random.uniform(-2.0, 2.0, (3, 6))
        tool = body.tool(np.array([q, qd, qdd]), list(offset))
        position, rotation, J = placed(model, q, offset)
        np.testing.assert_allclose(tool[:3], position, atol=1e-12)
        np.testing.assert_allclose(pin.exp3(tool[3:6]), rotation, atol=1e-12)
        np.testing.assert_allclose(tool[6:12], J @ qd, atol=1e-12)
        assert kinematics.motion(q, qd).tolist() == tool[:12].tolist()
        later, earlier = (placed(model, q + s * qd * h + 0.5 * qdd * h * h, offset)[2] for s in (1.0, -1.0))
        expected = (later @ (qd + qdd * h) - earlier @ (qd - qdd * h)) / (2.0 * h)
        np.testing.assert_allclose(tool[12:], expected, atol=2e-6 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.1, 1.0, np.pi - 1e-7, np.pi - 1e-12, np.pi])
def test_a_rotation_vector_is_that_of_its_rotation(angle):
    random = np.random.default_rng(1)
    for _ in range(30):
        axis = random.standard_normal(3)
        vector = angle * axis / np.linalg.norm(axis)
        found = np.array(rotation_vector(pin.exp3(vector)))
        assert np.linalg.norm(found) <= np.pi + 1e-12
        np.testing.assert_allclose(pin.exp3(found), pin.exp3(vector), atol=1e-12)
        if angle < 3.0:
            np.testing.assert_allclose(found, vector, atol=1e-12)


def by_numpy(J, torque):
    """Damped least squares as the documentation says."""
    tall = J.shape[1] <= J.shape[0]
    square = J.T @ J if tall else J @ J.T
    manipulability = np.sqrt(max(np.linalg.det(square), 0.0))
    if manipulability < NEAR_SINGULAR:
        square += np.eye(len(square)) * (DAMPING * (1.0 - manipulability / NEAR_SINGULAR)) ** 2
    return J @ np.linalg.solve(square, torque) if tall else np.linalg.solve(square, J @ torque)


@pytest.mark.parametrize("plain", [False, True], ids=["compiled", "python"])
@pytest.mark.parametrize("offset", OFFSETS, ids=["flange", "tool"])
def test_the_force_is_that_of_the_formula(arm, offset, plain, monkeypatch):
    if plain:
        for name, function in vars(module).copy().items():
            if hasattr(function, "py_func"):
                monkeypatch.setattr(module, name, function.py_func)
    model, random = rigid_model(arm, Payload()), np.random.default_rng(4)
    links = Arm(arm, offset).chain
    for q in (*random.uniform(-2.0, 2.0, (20, 6)), np.array(STRETCHED)):
        torque, found = random.uniform(-50.0, 50.0, 6), np.empty(6)
        wanted = by_numpy(placed(model, q, offset)[2], torque)
        module.force_at(links, q, torque, found)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())


def test_the_force_on_an_arm_with_seven_joints():
    pin.seed(3)
    model, random = pin.Model(), np.random.default_rng(3)
    for number in range(7):
        joint = model.addJoint(number, pin.JointModelRZ(), pin.SE3.Random(), f"joint {number}")
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    model.addFrame(pin.Frame(FLANGE, 7, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    chain = chain_of(model, model.getFrameId(FLANGE))
    for _ in range(10):
        q, torque, force = random.uniform(-2.0, 2.0, 7), random.uniform(-50.0, 50.0, 7), np.empty(6)
        module.force_at(chain, q, torque, force)
        wanted = by_numpy(placed(model, q, (0.0,) * 6)[2], torque)
        np.testing.assert_allclose(force, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())


def test_an_estimate_is_that_of_its_formula_to_the_last_bit(arm):
    body, random = RigidBody(arm), np.random.default_rng(5)
    drives, offset = arm.drives, [0.1, -0.2, 0.3, 0.4, -1.0, 2.0]
    for _ in range(30):
        motion = random.uniform(-3.0, 3.0, (ROWS, 6))
        found = body.external(motion, offset)
        share = motion[SHAPED_QD] / drives.friction_width
        friction = np.array(drives.coulomb_friction) * (share if drives.linear_friction else np.tanh(share))
        expected = motion[SHAPED_MOMENT] + np.array(drives.rotor_inertia) * motion[SHAPED_QDD] + friction
        torque, force = expected - motion[ACTUAL_MOMENT], np.empty(6)
        assert found[6:].tolist() == torque.tolist()
        module.force_at(body._tool.chain, motion[ACTUAL_Q], torque, force)
        assert found[:6].tolist() == force.tolist()
        plain, slip = np.empty(12), share if drives.linear_friction else np.tanh(share)
        module.estimate.py_func(body._tool.chain, motion, body._drives, slip, plain)
        assert plain.tolist() == found.tolist()
