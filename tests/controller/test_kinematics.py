"""Compiled kinematics against pinocchio, and against their own Python source."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.plant.arms import chain

from tvist_controller.instruments import wrench as module
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import (
    DAMPING,
    NEAR_SINGULAR,
)
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.least_squares import solve_in_place
from tvist_controller.kinematics.pose import rotation_vector
from tvist_plant.description import Payload, load
from tvist_plant.model import FLANGE, rigid_model

SEVEN = load(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")
"""Its links have placements."""
ARMS = [load("ur5e"), load("one-joint"), chain(3), SEVEN]
AXES = pin.LOCAL_WORLD_ALIGNED


def cases(description, number=20):
    rng = np.random.default_rng(description.joints)
    model = rigid_model(description, Payload())
    flange = model.getFrameId(FLANGE)
    for _ in range(number):
        tool = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(scale=0.2, size=3))
        frame = pin.Frame(
            "tool", model.frames[flange].parentJoint, 0, model.frames[flange].placement * tool, pin.OP_FRAME
        )
        with_tool = model.copy()
        q, qd = rng.uniform(-2 * np.pi, 2 * np.pi, (2, description.joints))
        yield with_tool, with_tool.addFrame(frame), tool, q, qd


@pytest.mark.parametrize(
    "description", ARMS, ids=lambda description: f"{description.robot.name}-{description.joints}"
)
def test_pose_jacobian_and_bias_are_pinocchios(description):
    bare = Arm(description)
    for model, frame, tool, q, qd in cases(description):
        data = model.createData()
        pin.forwardKinematics(model, data, q, qd, np.zeros_like(q))
        placement = pin.updateFramePlacement(model, data, frame)
        expected = pin.getFrameClassicalAcceleration(model, data, frame, AXES).vector.copy()
        tooled = bare.with_tool([*tool.translation, *pin.log3(tool.rotation)])
        turned, position, jacobian = tooled.located(q)
        np.testing.assert_allclose(turned, placement.rotation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(position, placement.translation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            jacobian, pin.computeFrameJacobian(model, data, q, frame, AXES), rtol=0, atol=1e-12
        )
        still = np.zeros_like(q)
        np.testing.assert_allclose(tooled.acceleration(q, qd, still), expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(tooled.motion(q, qd)[6:], jacobian @ qd, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("solve", [solve_in_place, solve_in_place.py_func], ids=["compiled", "python"])
@given(st.integers(1, 24), st.integers(0, 2**32 - 1))
def test_it_solves_as_lapack_does_and_knows_the_determinant(solve, n, seed):
    random = np.random.default_rng(seed)
    root, x = random.normal(size=(n, n)), random.normal(size=n)
    A = root @ root.T
    b = A @ x
    found = b.copy()
    half = solve(A.copy(), found)
    exact = np.linalg.solve(A, b)
    worst = 1e-12 * np.linalg.cond(A)
    assert np.abs(found - exact).max() <= worst * max(1.0, np.abs(exact).max())
    assert abs(half - abs(np.linalg.det(root))) <= worst * half


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


@pytest.mark.parametrize("offset", OFFSETS, ids=["flange", "tool"])
def test_the_force_is_that_of_the_formula(arm, offset):
    model, random = rigid_model(arm, Payload()), np.random.default_rng(4)
    links = Arm(arm, offset).chain
    for q in (*random.uniform(-2.0, 2.0, (20, 6)), np.array(STRETCHED)):
        torque, found = random.uniform(-50.0, 50.0, 6), np.empty(6)
        wanted = by_numpy(placed(model, q, offset)[2], torque)
        module.force_at(links, q, torque, found)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
