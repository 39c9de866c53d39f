"""Inverse kinematics against forward kinematics, against a numerical search, and at degenerate postures."""

import importlib
import itertools
import pkgutil

import numpy as np
import pytest
from tests.controller.robots import cut
from tests.examples import share
from tests.plant.arms import chain, changed, forward_kinematics, frames

import tvist_controller.kinematics
from tvist_controller.kinematics import choice
from tvist_controller.kinematics.choice import closest, improved_postures, search
from tvist_controller.kinematics.denavit_hartenberg import dh_table, kinematics
from tvist_controller.kinematics.geometry import arm_table
from tvist_controller.kinematics.inverse import STARTS, InverseKinematics, InverseKinematicsError
from tvist_controller.kinematics.least_squares import approach, descend
from tvist_plant.description import load

UR5E = load("ur5e")
NO_TOOL = np.eye(3), np.zeros(3)
RIGHT = np.pi / 2


def arm(a, d, alpha, limit=2 * np.pi):
    """A description with these parameters."""
    joints = len(a)
    base = UR5E if joints == 6 else chain(joints)
    base = changed(base, "kinematics", a=tuple(a), d=tuple(d), alpha=tuple(alpha))
    return changed(base, "limits", position=(limit,) * joints)


def random_ur(rng):
    """An arm with parallel axes 2, 3, 4 and lengths of any sign, some of them zero."""
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    a[[1, 2]] += np.sign(a[[1, 2]]) * 0.1
    a[4] = 0.0
    a[[0, 3, 5]] *= rng.integers(0, 2, 3)
    d *= rng.integers(0, 2, 6)
    d[3] += 0.1
    signs = rng.choice([-1, 1], 3) * RIGHT
    straight = rng.choice([0.0, np.pi, -np.pi], 2)
    return arm(a, d, (signs[0], *straight, signs[1], signs[2], rng.uniform(-np.pi, np.pi)))


def random_spherical(rng):
    """An arm with a spherical wrist and lengths of any sign, some of them zero."""
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    a[1] += np.sign(a[1]) * 0.1
    d[3] += np.sign(d[3]) * 0.1
    a[[3, 4]] = d[4] = 0.0
    a[[0, 2, 5]] *= rng.integers(0, 2, 3)
    d[[0, 1, 2, 5]] *= rng.integers(0, 2, 4)
    signs = rng.choice([-1, 1], 4) * RIGHT
    straight = rng.choice([0.0, np.pi, -np.pi])
    return arm(a, d, (signs[0], straight, *signs[1:], rng.uniform(-np.pi, np.pi)))


PUMA = arm(
    (0.0, 0.43, -0.02, 0.0, 0.0, 0.0),
    (0.67, 0.0, 0.15, 0.43, 0.0, 0.06),
    (RIGHT, 0.0, -RIGHT, RIGHT, -RIGHT, 0.0),
)
CENTRED = arm(
    (0.0, 0.4, 0.0, 0.0, 0.0, 0.0), (0.3, 0.0, 0.0, 0.4, 0.0, 0.1), (RIGHT, 0.0, -RIGHT, RIGHT, -RIGHT, 0.0)
)
EVEN_UR = arm(
    (0.0, -0.4, -0.4, 0.0, 0.0, 0.0),
    (0.2, 0.1, -0.3, 0.2, 0.1, 0.1),
    (RIGHT, 0.0, 0.0, RIGHT, -RIGHT, 0.0),
)


def pose_of(description, q):
    rotation, position, _ = kinematics(dh_table(description), *NO_TOOL, np.asarray(q, dtype=float))
    return rotation, position


def error(description, pose, q):
    """Largest error of position [m] and rotation [rad], by the textbook's products."""
    found = forward_kinematics(description, q)
    return max(np.linalg.norm(found[:3, 3] - pose[1]), np.linalg.norm(found[:3, :3] - pose[0]) / np.sqrt(2))


def wrapped(difference):
    return np.remainder(difference + np.pi, 2 * np.pi) - np.pi


def nearest(postures, near, limit):
    """The smallest distance, of all postures and all their representations in the range."""
    least = np.inf
    for posture in postures:
        total = 0.0
        for angle, wish, most in zip(posture, near, limit, strict=True):
            turned = angle + 2 * np.pi * np.arange(-3, 4)
            turned = turned[np.abs(turned) <= most]
            total += np.min((turned - wish) ** 2, initial=np.inf)
        least = min(least, total)
    return np.sqrt(least)


def missed(description, ik, pose, rng, starts=64):
    """Postures that a numerical search finds and `all` does not have."""
    dh, known = dh_table(description), ik.all(*pose)
    for start in rng.uniform(-np.pi, np.pi, (starts, description.joints)):
        q = start.copy()
        if descend(dh, *pose, q, 0.0, 100, q) < 1e-10:
            distances = np.abs(wrapped(known - q)).max(axis=1)
            if distances.min(initial=np.inf) > 1e-4:
                yield q


def test_forward_of_inverse_is_the_pose_and_the_nearest_posture_is_returned(measured):
    rng, ik, worst = np.random.default_rng(1), InverseKinematics(UR5E), 0.0
    limit = UR5E.limits.position
    assert ik.closed_form
    for _ in range(share(10_000)):
        q, near = rng.uniform(-2 * np.pi, 2 * np.pi, (2, 6))
        pose = pose_of(UR5E, q)
        found = ik.solve(*pose, near)
        worst = max(worst, error(UR5E, pose, found))
        assert np.all(np.abs(found) <= limit)
        assert np.linalg.norm(found - near) == pytest.approx(nearest(ik.all(*pose), near, limit), abs=1e-7)
        np.testing.assert_allclose(ik.solve(*pose, q), q, rtol=0, atol=1e-6)
    measured("largest error of 10,000 poses [m, rad]", worst)
    assert worst <= 1e-12


@pytest.mark.parametrize("number", [200, pytest.param(2000, marks=pytest.mark.slow)])
def test_no_posture_is_missed(number):
    rng, ik = np.random.default_rng(2), InverseKinematics(UR5E)
    for _ in range(number):
        pose = pose_of(UR5E, rng.uniform(-np.pi, np.pi, 6))
        assert not list(missed(UR5E, ik, pose, rng))


@pytest.mark.parametrize("make", [random_ur, random_spherical])
def test_arms_with_any_lengths_and_signs_are_solved_in_closed_form(make, measured):
    rng, worst = np.random.default_rng(3), 0.0
    for _ in range(share(200)):
        description = make(rng)
        ik = InverseKinematics(description)
        assert ik.closed_form
        for _ in range(5):
            q, near = rng.uniform(-2 * np.pi, 2 * np.pi, (2, 6))
            pose = pose_of(description, q)
            postures = ik.all(*pose)
            assert len(postures) <= 8
            assert np.abs(wrapped(postures - q)).max(axis=1).min() < 1e-6
            found = ik.solve(*pose, near)
            worst = max(
                worst, error(description, pose, found), *(error(description, pose, p) for p in postures)
            )
            assert np.linalg.norm(found - near) == pytest.approx(
                nearest(postures, near, description.limits.position), abs=1e-7
            )
        assert not list(missed(description, ik, pose, rng, 32))
    measured("largest error [m, rad]", worst)
    assert worst <= 1e-12


OTHERS = [load("one-joint"), *(chain(n) for n in range(1, 8)), *(cut(n) for n in range(1, 6))]


@pytest.mark.parametrize("description", OTHERS, ids=lambda arm: f"{arm.robot.name}-{arm.joints}")
def test_other_arms_are_solved_numerically(description):
    rng, ik = np.random.default_rng(4), InverseKinematics(description)
    assert not ik.closed_form
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
        for posture in ik.all(*pose):
            assert error(description, pose, posture) <= 1.001e-9


def test_a_redundant_arm_moves_as_little_as_it_can():
    """At the nearest posture, the way to the wish is perpendicular to all motions that keep the pose."""
    rng, description = np.random.default_rng(5), chain(7)
    ik, dh = InverseKinematics(description), dh_table(description)
    for _ in range(10):
        q = rng.uniform(-2, 2, 7)
        near = q + 0.1 * rng.normal(size=7)
        found = ik.solve(*pose_of(description, q), near)
        kept = np.linalg.svd(kinematics(dh, *NO_TOOL, found)[2])[2][6]
        assert abs(kept @ (near - found)) < 1e-5


FREE = {
    "ur5e, Q1": (UR5E, UR5E.poses["Q1"]),
    "ur5e, Q2": (UR5E, UR5E.poses["Q2"]),
    "ur5e, Q3": (UR5E, UR5E.poses["Q3"]),
    "ur5e, wrist folded": (UR5E, (0.3, -1.0, 1.2, 0.4, np.pi, 0.7)),
    "ur5e, elbow folded": (UR5E, (0.3, -1.0, np.pi, 0.4, 0.6, 0.7)),
    "ur5e, stretched": (UR5E, (0.3, -1.0, 0.0, 0.4, 0.6, 0.7)),
    "ur, wrist on axis 1": (EVEN_UR, (0.3, -0.5, 1.0, -0.5 + RIGHT, 0.4, 0.7)),
    "ur, wrist on axis 2": (EVEN_UR, (0.3, -1.0, np.pi, 0.4, 0.6, 0.7)),
    "puma, wrist straight": (PUMA, (0.3, -1.0, 0.5, 0.4, 0.0, 0.7)),
    "puma, wrist folded": (PUMA, (0.3, -1.0, 0.5, 0.4, np.pi, 0.7)),
    "centred, wrist on axis 1": (CENTRED, (0.3, RIGHT, 0.0, 0.4, 0.6, 0.7)),
    "centred, upright": (CENTRED, (0.3, RIGHT, RIGHT, 0.4, 0.0, 0.7)),
    "centred, above": (CENTRED, (0.3, 1.0, 2 * (RIGHT - 1.0) + RIGHT, 0.4, 0.6, 0.7)),
    "centred, wrist on axis 2": (CENTRED, (0.3, 0.5, -RIGHT, 0.4, 0.6, 0.7)),
}


@pytest.mark.parametrize("case", FREE)
def test_the_nearest_posture_is_found_where_postures_merge_or_a_joint_is_free(case):
    description, q = FREE[case]
    q, rng, ik = np.array(q), np.random.default_rng(6), InverseKinematics(description)
    dh, pose = dh_table(description), pose_of(description, q)
    np.testing.assert_allclose(ik.solve(*pose, q), q, rtol=0, atol=1e-6)
    for scale in (1e-3, 0.1, 1.0, 3.0):
        near = np.clip(q + scale * rng.normal(size=6), -6, 6)
        found = ik.solve(*pose, near)
        assert error(description, pose, found) <= 1e-10
        distance = np.linalg.norm(found - near)
        assert distance <= np.linalg.norm(q - near) + 1e-6
        for start in near + rng.uniform(-np.pi, np.pi, (32, 6)):
            if approach(dh, *pose, near, start) < 1e-9 and np.all(
                np.abs(start) <= description.limits.position
            ):
                assert distance <= np.linalg.norm(start - near) + 1e-4, (found, start)


@pytest.mark.parametrize("case", FREE)
def test_postures_close_to_degenerate_ones_are_found(case):
    description, q = FREE[case]
    rng, ik = np.random.default_rng(7), InverseKinematics(description)
    for exponent, _ in itertools.product(range(-16, -1), range(10)):
        moved = q + 10.0**exponent * rng.normal(size=6) * rng.integers(0, 2, 6)
        pose = pose_of(description, moved)
        found = ik.solve(*pose, moved)
        assert error(description, pose, found) <= 1e-9
        assert np.linalg.norm(found - moved) < 1e-3


@pytest.mark.parametrize(
    ("description", "elbow", "end"),
    [(UR5E, 0.0, 3), (PUMA, -np.arctan2(0.43, -0.02), 4)],
    ids=["ur", "puma"],
)
def test_the_border_of_the_reach_belongs_to_it_and_nothing_beyond(description, elbow, end):
    """The flange is moved along the stretched arm, whose forearm ends at the origin of frame `end`."""
    q = np.array([0.3, -1.0, elbow, 0.4, 0.6, 0.7])
    ik, (rotation, position) = InverseKinematics(description), pose_of(description, q)
    chained = frames(description, q)
    axis, outwards = chained[1][:3, 2], (chained[end] - chained[1])[:3, 3]
    outwards = outwards - axis * (axis @ outwards)
    outwards /= np.linalg.norm(outwards)

    def close(distance):
        postures = ik.all(rotation, position + distance * outwards)
        return [p for p in postures if np.abs(wrapped(p - q)).max() < 0.2]

    for distance in (0.0, 1e-16, 1e-11, -1e-6):
        assert close(distance)
    for distance in (1e-8, 1e-3, 10.0):
        assert not close(distance)
    with pytest.raises(InverseKinematicsError) as refusal:
        ik.solve(rotation, position + 10.0 * outwards, q)
    assert (refusal.value.code, refusal.value.joint) == ("no_solution", None)


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
    assert refusal.value.joint == int(np.argmax(np.abs(q)))
    assert refusal.value.limit == 0.1
    assert refusal.value.value == pytest.approx(q[refusal.value.joint], abs=1e-6)
    assert narrow.robot.joints[refusal.value.joint] in str(refusal.value)


def test_a_posture_within_the_ranges_is_preferred_to_a_nearer_one_outside():
    rng = np.random.default_rng(8)
    limits = (2.0, 2.5, 3.0, 2.0, 3.5, 6.0)
    ik, wide = InverseKinematics(changed(UR5E, "limits", position=limits)), InverseKinematics(UR5E)
    outcomes = set()
    for _ in range(300):
        pose = pose_of(UR5E, rng.uniform(-np.pi, np.pi, 6))
        near = rng.uniform(-1, 1, 6) * limits
        expected = nearest(wide.all(*pose), near, limits)
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
        assert ik.closed_form == closed
        for _ in range(10):
            q = rng.uniform(-3, 3, 6)
            pose = pose_of(description, q)
            found = ik.solve(*pose, q)
            assert error(description, pose, found) <= 1e-10
            np.testing.assert_allclose(found, q, rtol=0, atol=1e-6)


def test_arrays_of_any_layout_are_taken_and_others_refused():
    ik, q = InverseKinematics(UR5E), np.array([0.3, -1.0, 1.2, 0.4, 0.6, 0.7])
    rotation, position = pose_of(UR5E, q)
    expected, given = ik.solve(rotation, position, q), q.copy()
    given.flags.writeable = False
    matrix = np.eye(4, order="F")
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    np.testing.assert_array_equal(ik.solve(matrix[:3, :3], matrix[:3, 3], given), expected)
    np.testing.assert_array_equal(given, q)
    with pytest.raises(TypeError):
        ik.solve(rotation.astype(np.float32), position, q)


def uncompile(monkeypatch):
    """Have every kernel of the package call the Python source of the others."""
    package = tvist_controller.kinematics
    for found in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{found.name}")
        for name, value in list(vars(module).items()):
            if hasattr(value, "py_func"):
                monkeypatch.setattr(module, name, value.py_func)


@pytest.mark.parametrize("case", ["general", "ur5e, Q3", "puma, wrist straight", "centred, wrist on axis 2"])
def test_the_compiled_kernels_equal_their_python_source(case, monkeypatch):
    description, q = FREE.get(case, (UR5E, (0.5, -1.0, 1.2, 0.4, 0.6, 0.7)))
    table, pose, near = arm_table(description), pose_of(description, q), np.array(q) + 0.1
    expected, found = np.empty((2, 9, 6))
    one, other = np.empty((2, 6))
    improved_postures(table, *pose, near, expected)
    status = closest(table, *pose, near, one)
    uncompile(monkeypatch)
    choice.improved_postures(table, *pose, near, found)
    assert choice.closest(table, *pose, near, other) == status == choice.FOUND
    exist = ~np.isnan(expected[:, 0])
    np.testing.assert_array_equal(~np.isnan(found[:, 0]), exist)
    np.testing.assert_allclose(found[exist], expected[exist], rtol=0, atol=1e-7)
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-7)


def test_the_compiled_search_equals_its_python_source(monkeypatch):
    description, q = chain(4), np.array([0.5, -1.0, 1.2, 0.4])
    table, pose, near = arm_table(description), pose_of(description, q), q + 0.1
    starts = np.random.default_rng(10).uniform(-3, 3, (5, 4))
    expected, found = np.empty((2, 12, 4))
    best = search(table, starts, *pose, near, expected)
    uncompile(monkeypatch)
    assert choice.search(table, starts, *pose, near, found) == best
    np.testing.assert_allclose(found[best], expected[best], rtol=0, atol=1e-9)
    assert len(starts) < STARTS
