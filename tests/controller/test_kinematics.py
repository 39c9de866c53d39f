"""Compiled kinematics against pinocchio, and against their own Python source."""

import numpy as np
import pinocchio as pin
import pytest
from tests.plant.arms import chain

from tvist_controller.kinematics import arm, pose
from tvist_controller.kinematics.arm import Arm
from tvist_plant.description import Payload, load
from tvist_plant.model import FLANGE, rigid_model

ARMS = [load("ur5e"), load("one-joint"), *(chain(joints) for joints in (2, 3, 5, 7))]
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


def test_the_compiled_kernels_equal_their_python_source(monkeypatch):
    tooled = Arm(ARMS[0], (0.1, -0.2, 0.3, 0.4, -1.0, 2.0))
    states = [(q, qd) for _, _, _, q, qd in cases(ARMS[0], 5)]

    def found():
        parts = [
            (*tooled.located(q), tooled.motion(q, qd), tooled.acceleration(q, qd, qd)) for q, qd in states
        ]
        return np.concatenate([part.ravel() for some in parts for part in some])

    compiled = found()
    for module in (arm, pose):
        for name, one in vars(module).copy().items():
            if hasattr(one, "py_func"):
                monkeypatch.setattr(module, name, one.py_func)
    np.testing.assert_allclose(compiled, found(), rtol=1e-13, atol=1e-13)
