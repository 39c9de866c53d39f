"""What pushes the arm from outside: wrenches on bodies, by virtual work, by weight and against pinocchio."""

import numpy as np
import pinocchio as pin
import pytest

from tvist_plant.description import Payload
from tvist_plant.external_forces import ExternalForces
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import YieldingBase
from tvist_plant.model import flexible_model

from .arms import chain, quiet, rested, standing

FORCE, MOMENT, POINT = (30.0, -20.0, 50.0), (4.0, 7.0, -3.0), (0.02, -0.03, 0.05)


@pytest.fixture
def arm(ur5e):
    return quiet(ur5e)


def placed(flexible, q):
    data = flexible.model.createData()
    pin.forwardKinematics(flexible.model, data, q)
    pin.updateFramePlacements(flexible.model, data)
    return data


@pytest.mark.parametrize("joints", [1, 3, 7])
def test_wrench_on_any_body_matches_pinocchio(joints):
    """Its recursive algorithm takes forces in the frames of the joints, and has no Jacobian in it."""
    description = chain(joints)
    flexible = flexible_model(description, description.payload)
    q = np.random.default_rng(joints).uniform(-1.0, 1.0, flexible.model.nv)
    data = placed(flexible, q)
    outside = ExternalForces(flexible)
    assert len(outside.bodies) == flexible.model.nv + 1
    for body in outside.bodies:
        outside.clear()
        outside.push_body(body, FORCE, MOMENT, POINT)
        last = flexible.model.frames[flexible.flange] if body == "flange" else None
        joint = last.parentJoint if last else flexible.model.getJointId(body)
        lever = last.placement.act(np.array(POINT)) if last else np.array(POINT)
        R = data.oMi[joint].rotation
        force = R.T @ FORCE
        forces = [pin.Force.Zero() for _ in range(flexible.model.njoints)]
        forces[joint] = pin.Force(force, R.T @ MOMENT + np.cross(lever, force))
        still = np.zeros(flexible.model.nv)
        free = pin.rnea(flexible.model, data, q, still, still).copy()
        expected = free - pin.rnea(flexible.model, data, q, still, still, forces)
        np.testing.assert_allclose(outside.generalized_force(q), expected, rtol=0.0, atol=1e-11)


def test_weight_at_the_flange_bends_the_arm_like_a_payload(arm):
    """In the end: a payload has inertia, too."""
    loaded, command, expected = standing(arm, arm.poses["Q1"])
    bare, *_ = standing(arm, arm.poses["Q1"], carries=Payload())
    weight = (0.0, 0.0, -9.81 * arm.payload.mass)
    bare.push_body("flange", weight, point=arm.payload.com)
    np.testing.assert_allclose(rested(bare, command, 3000).q, expected.q, rtol=0.0, atol=2e-5)
    bent, deflection = bare.truth().link_deflection, loaded.truth().link_deflection
    np.testing.assert_allclose(bent, deflection, rtol=0.0, atol=1e-6)
    assert np.abs(bent).max() > 1e-5


def test_moment_about_a_joint_with_its_reaction_is_a_joint_torque(arm):
    q = np.array(arm.poses["Q3"])
    (pushed, command, _), (twisted, *_) = (standing(arm, q) for _ in range(2))
    axis = placed(pushed._flexible, pushed._q).oMi[2].rotation[:, 2]
    pushed.push(np.array([0.0, 25.0, 0.0, 0.0, 0.0, 0.0]))
    twisted.push_body("shoulder", moment=25.0 * axis)
    twisted.push_body("base", moment=-25.0 * axis)
    a, b = (rested(one, command, 50) for one in (pushed, twisted))
    np.testing.assert_allclose(a.q, b.q, rtol=0.0, atol=1e-8)
    assert np.abs(a.q - q).max() > 1e-4


def test_push_ends_with_zeros_or_a_reset(arm):
    one, command, rest = standing(arm, arm.poses["Q1"])
    one.push_body("flange", FORCE)
    one.push_body("elbow", FORCE)
    one.step(command)
    for body in ("flange", "elbow"):
        one.push_body(body)
    assert one._external.rests
    one.push_body("flange", FORCE)
    one.push(np.ones(6))
    np.testing.assert_array_equal(one.reset(command).moment, rest.moment)
    assert one._external.rests


def test_yielding_base_can_be_pushed(arm):
    one, command, _ = standing(arm, arm.poses["Q1"], base=YieldingBase())
    before = one._q[1]
    one.push_body("base_y", moment=(0.0, 150.0, 0.0))
    rested(one, command, 1000)
    assert one._q[1] - before == pytest.approx(150.0 / 1.5e5, rel=1e-2)


@pytest.mark.parametrize(("method", "arguments", "said"), [
    ("push_body", {"body": "nose"}, "body is 'nose': must be one of base, shoulder, .*flange"),
    ("push_body", {"body": "flange", "force": (1.0, 2.0)}, "force is .1.0, 2.0.: must be three finite"),
    ("push_body", {"body": "flange", "moment": (0.0, np.nan, 0.0)}, "moment is"),
    ("push_body", {"body": "flange", "point": (0.0, np.inf, 0.0)}, "point is"),
    ("push", {"torque": np.ones(5)}, "torque is .*: must be 6 finite numbers"),
    ("push", {"torque": np.array(1.0)}, "torque is .*: must be 6 finite numbers"),
    ("push", {"torque": np.array([1.0, np.nan, 0.0, 0.0, 0.0, 0.0])}, "torque is .*: must be 6 finite numbers"),
])  # fmt: skip
def test_invalid_push_is_refused(ur5e, method, arguments, said):
    with pytest.raises(ValueError, match=said):
        getattr(FlexibleArm(ur5e, ur5e.payload), method)(**arguments)
