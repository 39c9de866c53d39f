"""Kinematics of an arm whose links have placements, as from a URDF: compared with pinocchio, forward and inverse."""

from pathlib import Path

import numpy as np
import pinocchio as pin

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.inverse import InverseKinematics
from tvist_plant.description import load
from tvist_plant.model import FLANGE, rigid_model
from tvist_plant.robot_tables import Payload

SEVEN = load(Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf")


def test_pose_jacobian_and_bias_are_pinocchio_s():
    model, tool = rigid_model(SEVEN, Payload()), Arm(SEVEN)
    data, frame, axes = model.createData(), model.getFrameId(FLANGE), pin.LOCAL_WORLD_ALIGNED
    random = np.random.default_rng(0)
    for _ in range(20):
        q, qd = random.uniform(-2.0, 2.0, (2, 7))
        rotation, position, jacobian = tool.located(q)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        np.testing.assert_allclose(rotation, data.oMf[frame].rotation, atol=1e-12)
        np.testing.assert_allclose(position, data.oMf[frame].translation, atol=1e-12)
        np.testing.assert_allclose(jacobian, pin.getFrameJacobian(model, data, frame, axes), atol=1e-12)
        pin.forwardKinematics(model, data, q, qd, np.zeros(7))
        bias = pin.getFrameClassicalAcceleration(model, data, frame, axes).vector
        np.testing.assert_allclose(tool.acceleration(q, qd, np.zeros(7)), bias, atol=1e-12)


def test_a_pose_is_reached_near_the_posture_that_it_came_from():
    inverse, tool = InverseKinematics(SEVEN), Arm(SEVEN)
    assert not inverse._closed
    random = np.random.default_rng(1)
    for q in random.uniform(-1.5, 1.5, (3, 7)):
        rotation, position = tool.pose(q)
        found = inverse.solve(rotation, position, q + 0.05)
        reached = tool.pose(found)
        np.testing.assert_allclose(reached[1], position, atol=1e-8)
        np.testing.assert_allclose(reached[0], rotation, atol=1e-8)
        assert np.abs(found - q).max() < 0.5
