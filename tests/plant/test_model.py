"""The two multibody models against textbook kinematics and against each other."""

import numpy as np
import pinocchio as pin
import pytest

from tvist_plant.description import load
from tvist_plant.model import FLANGE, carries_weight, flexible_model, rigid_model

from .arms import chain, forward_kinematics


def random_poses(joints, count=20):
    return np.random.default_rng(5).uniform(-np.pi, np.pi, (count, joints))


def stiff(flexible, q):
    """Joint angles among those of the flexible arm, whose links do not bend."""
    angles = np.zeros(flexible.model.nv)
    angles[flexible.joints] = q
    return angles


def symmetric(M):
    return np.triu(M) + np.triu(M, 1).T


@pytest.mark.parametrize(
    ("pose", "elbow", "place"),
    [("Q1", 1, (0.917, -0.233, 0.163)), ("Q3", 1, (0.233, -0.246, 0.162)), ("Q3", -1, (0.233, 0.246, 0.162))],
)
def test_flange_is_at_the_positions_of_the_paper(ur5e, pose, elbow, place):
    q = np.array(ur5e.poses[pose]) * [1, 1, elbow, 1, 1, 1]
    np.testing.assert_allclose(forward_kinematics(ur5e, q)[:3, 3], place, atol=6e-4)


@pytest.mark.parametrize("arm", ["ur5e", "chain"])
def test_flange_of_both_models_matches_denavit_hartenberg(ur5e, arm):
    description = ur5e if arm == "ur5e" else chain(7)
    rigid = rigid_model(description, description.payload)
    flexible = flexible_model(description, description.payload)
    for q in random_poses(description.joints):
        expected = forward_kinematics(description, q)
        for model, angles in ((rigid, q), (flexible.model, stiff(flexible, q))):
            data = model.createData()
            pin.framesForwardKinematics(model, data, angles)
            np.testing.assert_allclose(data.oMf[model.getFrameId(FLANGE)].homogeneous, expected, atol=1e-12)


def test_bending_links_keep_mass_centre_and_gravity(ur5e):
    rigid, flexible = rigid_model(ur5e, ur5e.payload), flexible_model(ur5e, ur5e.payload)
    for q in random_poses(6):
        data, flexible_data = rigid.createData(), flexible.model.createData()
        angles = stiff(flexible, q)
        np.testing.assert_allclose(
            pin.centerOfMass(flexible.model, flexible_data, angles),
            pin.centerOfMass(rigid, data, q),
            atol=1e-12,
        )
        np.testing.assert_allclose(
            pin.computeGeneralizedGravity(flexible.model, flexible_data, angles)[flexible.joints],
            pin.computeGeneralizedGravity(rigid, data, q),
            atol=1e-10,
        )


def test_lumps_change_the_mass_matrix_only_by_their_inertia(ur5e, measured):
    """Two lumps have Iyy and Izz of Iyy + Ixx and no products; the rest of the arm is untouched."""
    rigid, flexible = rigid_model(ur5e, ur5e.payload), flexible_model(ur5e, ur5e.payload)
    largest = 0.0
    for q in random_poses(6):
        data, angles = rigid.createData(), stiff(flexible, q)
        M = symmetric(pin.crba(rigid, data, q))
        lumped = symmetric(pin.crba(flexible.model, flexible.model.createData(), angles))
        expected = M.copy()
        for link in ur5e.link_flexibility.links:
            xx, xy, xz, yy, yz, zz = ur5e.links.inertia[link]
            change = np.array([[0, -xy, -xz], [-xy, xx, -yz], [-xz, -yz, yy + xx - zz]])
            alpha = ur5e.kinematics.alpha[link]
            turn = pin.exp3(np.array([alpha, 0.0, 0.0]))
            spin = pin.computeJointJacobian(rigid, data, q, link + 1)[3:]
            expected += spin.T @ turn @ change @ turn.T @ spin
        projected = lumped[np.ix_(flexible.joints, flexible.joints)]
        np.testing.assert_allclose(projected, expected, atol=1e-12)
        largest = max(largest, np.max(np.abs(projected - M)))
    measured("largest change of an entry of M [kg m^2]", largest)
    assert largest < 0.05


def test_arm_with_vertical_axes_carries_no_weight():
    assert carries_weight(load("ur5e"))
    assert not carries_weight(load("one-joint"))
