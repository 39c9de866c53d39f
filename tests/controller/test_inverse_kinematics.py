"""Inverse kinematics against forward kinematics, and against a numerical search."""

import itertools

import numpy as np
import pytest
from tests.controller.postures import (
    PUMA,
    UR5E,
    error,
    every,
    nearest,
    pose_of,
    random_spherical,
    random_ur,
    wrapped,
)
from tests.controller.robots import cut
from tests.examples import share
from tests.plant.arms import chain, changed

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.choice import closest
from tvist_controller.kinematics.inverse import InverseKinematics, InverseKinematicsError
from tvist_controller.kinematics.least_squares import descend
from tvist_plant.description import load


def missed(description, pose, rng, starts=64):
    """Postures that a numerical search finds and the closed form does not have."""
    links, known = Arm(description).chain, every(description, pose)
    for start in rng.uniform(-np.pi, np.pi, (starts, description.joints)):
        q = start.copy()
        if descend(links, *pose, q, 0.0, 100, q) < 1e-10:
            distances = np.abs(wrapped(known - q)).max(axis=1)
            if distances.min(initial=np.inf) > 1e-4:
                yield q


def test_forward_of_inverse_is_the_pose_and_the_nearest_posture_is_returned(measured):
    rng, ik, worst = np.random.default_rng(1), InverseKinematics(UR5E), 0.0
    limit = UR5E.limits.position
    assert ik._closed
    for _ in range(share(3_000)):
        q, near = rng.uniform(-2 * np.pi, 2 * np.pi, (2, 6))
        pose = pose_of(UR5E, q)
        found = ik.solve(*pose, near)
        worst = max(worst, error(UR5E, pose, found))
        assert np.all(np.abs(found) <= limit)
        assert np.linalg.norm(found - near) == pytest.approx(
            nearest(every(UR5E, pose), near, limit), abs=1e-7
        )
        np.testing.assert_allclose(ik.solve(*pose, q), q, rtol=0, atol=1e-6)
    measured("largest error of 3,000 poses [m, rad]", worst)
    assert worst <= 1e-12


def test_no_posture_is_missed():
    rng = np.random.default_rng(2)
    for _ in range(500):
        pose = pose_of(UR5E, rng.uniform(-np.pi, np.pi, 6))
        assert not list(missed(UR5E, pose, rng))


@pytest.mark.parametrize("make", [random_ur, random_spherical])
def test_arms_with_any_lengths_and_signs_are_solved_in_closed_form(make, measured):
    rng, worst = np.random.default_rng(3), 0.0
    for _ in range(share(200)):
        description = make(rng)
        ik = InverseKinematics(description)
        assert ik._closed
        for _ in range(5):
            q, near = rng.uniform(-2 * np.pi, 2 * np.pi, (2, 6))
            pose = pose_of(description, q)
            postures = every(description, pose)
            assert len(postures) <= 8
            assert np.abs(wrapped(postures - q)).max(axis=1).min() < 1e-6
            found = ik.solve(*pose, near)
            worst = max(
                worst, error(description, pose, found), *(error(description, pose, p) for p in postures)
            )
            assert np.linalg.norm(found - near) == pytest.approx(
                nearest(postures, near, description.limits.position), abs=1e-7
            )
        assert not list(missed(description, pose, rng, 32))
    measured("largest error [m, rad]", worst)
    assert worst <= 1e-12


OTHERS = [load("one-joint"), *(chain(n) for n in range(1, 8)), *(cut(n) for n in range(1, 6))]


@pytest.mark.parametrize("description", OTHERS, ids=lambda arm: f"{arm.robot.name}-{arm.joints}")
def test_other_arms_are_solved_numerically(description):
    rng, ik = np.random.default_rng(4), InverseKinematics(description)
    assert not ik._closed
    limit = np.minimum(description.limits.position, np.pi)
    for _ in range(5):
        q = rng.uniform(-limit, limit)
        pose, near = pose_of(description, q), q + 0.1 * rng.normal(size=q.shape)
        near = np.clip(near, -limit, limit)
        found = ik.solve(*pose, near)
        assert error(description, pose, found) <= 1.001e-9
        assert np.all(np.abs(found) <= description.limits.position)
        assert np.linalg.norm(found - near) <= np.linalg.norm(q - near) + 1e-7
        np.testing.assert_array_equal(ik.solve(*pose, near), found)
        np.testing.assert_allclose(ik.solve(*pose, q), q, rtol=0, atol=1e-7)
        for posture in every(description, pose):
            assert error(description, pose, posture) <= 1.001e-9


def test_a_redundant_arm_moves_as_little_as_it_can():
    """At the nearest posture, the way to the wish is perpendicular to all motions that keep the pose."""
    rng, description = np.random.default_rng(5), chain(7)
    ik, arm = InverseKinematics(description), Arm(description)
    for _ in range(10):
        q = rng.uniform(-2, 2, 7)
        near = q + 0.1 * rng.normal(size=7)
        found = ik.solve(*pose_of(description, q), near)
        kept = np.linalg.svd(arm.jacobian(found))[2][6]
        assert abs(kept @ (near - found)) < 1e-5


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.3), (0.05, 0.0, 0.5), (3.0, 0.0, 0.0), (np.nan, 0.0, 0.0)])
@pytest.mark.parametrize("description", [UR5E, PUMA, chain(6), cut(4)], ids=["ur", "puma", "chain", "short"])
def test_a_place_that_no_posture_reaches_has_no_solution(description, place):
    """The first two are beside the UR's axis 1, nearer than the shoulder's offset."""
    if description in (PUMA, chain(6)) and np.linalg.norm(place) < 1.0:
        place = (0.0, 2.0, 0.0)
    flange = np.array(place) + np.array([0.0, 0.0, UR5E.kinematics.d[5]])
    with pytest.raises(InverseKinematicsError, match="no joint positions reach") as refusal:
        InverseKinematics(description).solve(np.eye(3), flange, np.zeros(description.joints))
    assert refusal.value.code == "no_solution"


@pytest.mark.parametrize("description", [UR5E, chain(4)], ids=["closed", "numerical"])
def test_a_posture_out_of_range_is_told_from_none(description):
    q = np.array([0.5, -1.0, 1.2, 0.4, 0.6, 0.7])[: description.joints]
    pose = pose_of(description, q)
    limits = tuple(0.1 for _ in q)
    narrow = changed(description, "limits", position=limits)
    with pytest.raises(InverseKinematicsError, match="outside its range") as refusal:
        InverseKinematics(narrow).solve(*pose, q)
    assert refusal.value.code == "limit_position"
    assert refusal.value.limit == 0.1
    farthest = int(np.argmax(np.abs(q)))
    assert f"{narrow.robot.joints[farthest]} would be at {q[farthest]:.4f} rad" in str(refusal.value)


def test_a_posture_within_the_ranges_is_preferred_to_a_nearer_one_outside():
    rng = np.random.default_rng(8)
    limits = (2.0, 2.5, 3.0, 2.0, 3.5, 6.0)
    ik = InverseKinematics(changed(UR5E, "limits", position=limits))
    outcomes = set()
    for _ in range(300):
        pose = pose_of(UR5E, rng.uniform(-np.pi, np.pi, 6))
        near = rng.uniform(-1, 1, 6) * limits
        expected = nearest(every(UR5E, pose), near, limits)
        outcomes.add(bool(np.isfinite(expected)))
        if np.isfinite(expected):
            found = ik.solve(*pose, near)
            assert np.all(np.abs(found) <= limits)
            assert np.linalg.norm(found - near) == pytest.approx(expected, abs=1e-7)
        else:
            with pytest.raises(InverseKinematicsError, match="outside its range"):
                ik.solve(*pose, near)
    assert outcomes == {True, False}


def test_a_posture_on_its_limit_is_inside():
    limits = (1.0, 1.0, 1.2, 1.0, 1.0, 1.0)
    ik = InverseKinematics(changed(UR5E, "limits", position=limits))
    for signs in itertools.product((-1.0, 1.0), repeat=6):
        q = np.array(signs) * limits
        found = ik.solve(*pose_of(UR5E, q), np.zeros(6))
        assert np.all(np.abs(found) <= limits)


def test_twists_that_are_nearly_right_angles_are_made_good():
    """A file may give them with fewer digits; then there is no closed form, but for the rounding of the last ones."""
    for digits, closed in ((5, False), (10, True)):
        alpha = tuple(round(value, digits) for value in UR5E.kinematics.alpha)
        description = changed(UR5E, "kinematics", alpha=alpha)
        ik, rng = InverseKinematics(description), np.random.default_rng(9)
        assert ik._closed == closed
        for _ in range(10):
            q = rng.uniform(-3, 3, 6)
            pose = pose_of(description, q)
            found = ik.solve(*pose, q)
            assert error(description, pose, found) <= 1e-10
            np.testing.assert_allclose(found, q, rtol=0, atol=1e-6)


def test_arrays_of_any_layout_are_taken():
    ik, q = InverseKinematics(UR5E), np.array([0.3, -1.0, 1.2, 0.4, 0.6, 0.7])
    rotation, position = pose_of(UR5E, q)
    expected, given = ik.solve(rotation, position, q), q.copy()
    given.flags.writeable = False
    matrix = np.eye(4, order="F")
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    np.testing.assert_array_equal(ik.solve(matrix[:3, :3], matrix[:3, 3], given), expected)
    np.testing.assert_array_equal(given, q)


def test_a_robot_compiles_for_no_other_layout_or_type_of_arrays():
    """Else a program's first `get_inverse_kin` would hold up the tick for seconds."""
    pose = [np.ascontiguousarray(part) for part in pose_of(UR5E, np.full(6, 0.5))]
    InverseKinematics(UR5E).solve(*pose, np.full(6, 0.4))
    known = set(closest.overloads)
    other = [np.asfortranarray(part, dtype=np.float32) for part in pose]
    InverseKinematics(UR5E).solve(*other, np.full(6, 0.4))
    assert set(closest.overloads) == known
