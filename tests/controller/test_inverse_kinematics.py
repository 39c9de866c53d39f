"""Kinematics against pinocchio, and inverse kinematics against a numerical search."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import share
from tests.plant.arms import chain, changed, forward_kinematics

from tvist_controller.instruments import wrench as module
from tvist_controller.instruments.rigid_body import RigidBody
from tvist_controller.instruments.wrench import DAMPING, NEAR_SINGULAR
from tvist_controller.kinematics import inverse
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.inverse import InverseKinematics, InverseKinematicsError
from tvist_controller.kinematics.least_squares import approach, descend, solve_in_place
from tvist_controller.kinematics.pose import rotation_vector
from tvist_controller.kinematics.postures import ANY, arm_table
from tvist_plant.description import Payload, load
from tvist_plant.model import FLANGE, rigid_model

from .robots import cut

UR5E = load("ur5e")
RIGHT = np.pi / 2


def arm(a, d, alpha, limit=2 * np.pi):
    joints = len(a)
    base = UR5E if joints == 6 else chain(joints)
    base = changed(base, "kinematics", a=tuple(a), d=tuple(d), alpha=tuple(alpha))
    return changed(base, "limits", position=(limit,) * joints)


def random_ur(rng):
    """Return an arm with parallel axes 2, 3, 4 and lengths of any sign, some of them zero."""
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
    """Return an arm with a spherical wrist and lengths of any sign, some of them zero."""
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    a[1] += np.sign(a[1]) * 0.1
    d[3] += np.sign(d[3]) * 0.1
    a[[3, 4]] = d[4] = 0.0
    a[[0, 2, 5]] *= rng.integers(0, 2, 3)
    d[[0, 1, 2, 5]] *= rng.integers(0, 2, 4)
    signs = rng.choice([-1, 1], 4) * RIGHT
    straight = rng.choice([0.0, np.pi, -np.pi])
    return arm(a, d, (signs[0], straight, *signs[1:], rng.uniform(-np.pi, np.pi)))


SPHERICAL = (RIGHT, 0.0, -RIGHT, RIGHT, -RIGHT, 0.0)
PUMA = arm((0.0, 0.43, -0.02, 0.0, 0.0, 0.0), (0.67, 0.0, 0.15, 0.43, 0.0, 0.06), SPHERICAL)
CENTRED = arm((0.0, 0.4, 0.0, 0.0, 0.0, 0.0), (0.3, 0.0, 0.0, 0.4, 0.0, 0.1), SPHERICAL)
LONG = arm((0.0, 0.5, 0.0, 0.0, 0.0, 0.0), (0.3, 0.0, 0.0, 0.4, 0.0, 0.1), SPHERICAL)
EVEN_UR = arm(
    (0.0, -0.4, -0.4, 0.0, 0.0, 0.0), (0.2, 0.1, -0.3, 0.2, 0.1, 0.1), (RIGHT, 0.0, 0.0, RIGHT, -RIGHT, 0.0)
)


def pose_of(description, q):
    return Arm(description).pose(np.asarray(q, dtype=float))


def error(description, pose, q):
    """Return the largest error of position [m] and rotation [rad], by textbook products."""
    found = forward_kinematics(description, q)
    return max(np.linalg.norm(found[:3, 3] - pose[1]), np.linalg.norm(found[:3, :3] - pose[0]) / np.sqrt(2))


def wrapped(difference):
    return np.remainder(difference + np.pi, 2 * np.pi) - np.pi


def every(description, pose):
    """Return the distinct postures of a pose in any range, refined to rounding; of a curve, those next to zero."""
    table, links, zero = arm_table(description), Arm(description).chain, np.zeros(description.joints)
    table[:-1, 4] = 2 * np.pi
    if table[-1, 0] != ANY:
        found = np.empty((8, 6))
        inverse.all_postures(table, links, *pose, zero, found)
        for row in found:
            if not np.isnan(row[0]):
                inverse.represent(table, zero, row)
                worst = inverse.descend(links, *pose, zero, 0.0, 5, row)
                row[0] = np.nan if worst > inverse.ACCURACY else row[0]
    else:
        starts = np.random.default_rng(1).uniform(-np.pi, np.pi, (63, description.joints))
        found = np.empty((128, description.joints))
        inverse.search(table, links, starts, *pose, zero, found)
    kept = []
    for q in found[~np.isnan(found[:, 0])]:
        if all(np.abs(wrapped(q - other)).max() > 1e-6 for other in kept):
            kept.append(q)
    return np.array(kept).reshape(len(kept), description.joints)


def nearest(postures, near, limit):
    """Return the smallest distance over all postures and their representations in range."""
    least = np.inf
    for posture in postures:
        total = 0.0
        for angle, wish, most in zip(posture, near, limit, strict=True):
            turned = angle + 2 * np.pi * np.arange(-3, 4)
            turned = turned[np.abs(turned) <= most]
            total += np.min((turned - wish) ** 2, initial=np.inf)
        least = min(least, total)
    return np.sqrt(least)


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
    "centred, folded": (CENTRED, (0.3, 0.5, RIGHT, -0.8, 0.6, 0.4)),
    "centred, folded upright": (LONG, (1.0, RIGHT, RIGHT, 0.4, 0.0, 0.7)),
    "centred, wrist on axis 2": (CENTRED, (0.3, 0.5, -RIGHT, 0.4, 0.6, 0.7)),
}


def missed(description, pose, rng, starts=64):
    """Return postures that a numerical search finds and the closed form lacks."""
    links, known = Arm(description).chain, every(description, pose)
    for start in rng.uniform(-np.pi, np.pi, (starts, description.joints)):
        q = start.copy()
        if descend(links, *pose, q, 0.0, 100, q) < 1e-10:
            distances = np.abs(wrapped(known - q)).max(axis=1)
            if distances.min(initial=np.inf) > 1e-4:
                yield q


@pytest.mark.parametrize(
    "make", [lambda _: UR5E, random_ur, random_spherical], ids=["ur5e", "ur", "spherical"]
)
def test_closed_form_inverse_kinematics_finds_the_nearest_posture_and_misses_none(make, measured):
    """Arms have any lengths and signs; all their postures are computed in closed form."""
    rng, worst = np.random.default_rng(3), 0.0
    for _ in range(share(50)):
        description = make(rng)
        ik, limit = InverseKinematics(description), description.limits.position
        assert ik._closed
        for _ in range(5):
            q, near = rng.uniform(-2 * np.pi, 2 * np.pi, (2, 6))
            pose = pose_of(description, q)
            postures = every(description, pose)
            assert len(postures) <= 8
            assert np.abs(wrapped(postures - q)).max(axis=1).min() < 1e-6
            found = ik.solve(*pose, near)
            worst = max(worst, *(error(description, pose, each) for each in (found, *postures)))
            assert np.all(np.abs(found) <= limit)
            distance = np.linalg.norm(found - near)
            assert distance == pytest.approx(nearest(postures, near, limit), abs=1e-7)
            np.testing.assert_allclose(ik.solve(*pose, q), q, rtol=0, atol=1e-6)
        assert not list(missed(description, pose, rng))
    measured("largest error [m, rad]", worst)
    assert worst <= 1e-12


OTHERS = [load("one-joint"), *(chain(n) for n in range(1, 8)), *(cut(n) for n in range(1, 6))]


@pytest.mark.parametrize("description", OTHERS, ids=lambda arm: f"{arm.robot.name}-{arm.joints}")
def test_arms_without_closed_form_are_solved_numerically(description):
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


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.3), (0.05, 0.0, 0.5), (3.0, 0.0, 0.0), (np.nan, 0.0, 0.0)])
@pytest.mark.parametrize("description", [UR5E, PUMA, chain(6), cut(4)], ids=["ur", "puma", "chain", "short"])
def test_an_unreachable_pose_has_no_solution(description, place):
    """The first two are closer to the UR's axis 1 than the shoulder's offset."""
    if description in (PUMA, chain(6)) and np.linalg.norm(place) < 1.0:
        place = (0.0, 2.0, 0.0)
    flange = np.array(place) + np.array([0.0, 0.0, UR5E.kinematics.d[5]])
    with pytest.raises(InverseKinematicsError, match="no joint positions reach") as refusal:
        InverseKinematics(description).solve(np.eye(3), flange, np.zeros(description.joints))
    assert refusal.value.code == "no_solution"


@pytest.mark.parametrize("description", [UR5E, chain(4)], ids=["closed", "numerical"])
def test_a_solution_out_of_range_is_distinguished_from_no_solution(description):
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


@pytest.mark.parametrize("case", FREE)
def test_the_nearest_posture_is_found_at_singularities(case):
    description, q = FREE[case]
    q, rng, ik = np.array(q), np.random.default_rng(6), InverseKinematics(description)
    links, pose = Arm(description).chain, pose_of(description, q)
    np.testing.assert_allclose(ik.solve(*pose, q), q, rtol=0, atol=1e-6)
    for scale in (1e-3, 0.1, 1.0, 3.0):
        near = np.clip(q + scale * rng.normal(size=6), -6, 6)
        found = ik.solve(*pose, near)
        assert error(description, pose, found) <= 1e-10
        distance = np.linalg.norm(found - near)
        assert distance <= np.linalg.norm(q - near) + 1e-6
        for start in near + rng.uniform(-np.pi, np.pi, (16, 6)):
            if approach(links, *pose, near, start) < 1e-9 and np.all(
                np.abs(start) <= description.limits.position
            ):
                assert distance <= np.linalg.norm(start - near) + 1e-4, (found, start)


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
        yield with_tool, with_tool.addFrame(frame), tool, rng.uniform(-6.28, 6.28, (3, description.joints))


@pytest.mark.parametrize(
    "description", ARMS, ids=lambda description: f"{description.robot.name}-{description.joints}"
)
def test_tool_kinematics_match_pinocchio(description):
    bare = Arm(description)
    body = RigidBody(description) if description.joints >= 6 else None  # the instruments are of UR's arms
    for model, frame, tool, motion in cases(description):
        data = model.createData()
        pin.forwardKinematics(model, data, *motion)
        placement = pin.updateFramePlacement(model, data, frame)
        expected = pin.getFrameClassicalAcceleration(model, data, frame, AXES).vector.copy()
        tcp, (q, qd, _) = [*tool.translation, *pin.log3(tool.rotation)], motion
        tooled = bare.with_tool(tcp)
        turned, position, jacobian = tooled.located(q)
        np.testing.assert_allclose(turned, placement.rotation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(position, placement.translation, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            jacobian, pin.computeFrameJacobian(model, data, q, frame, AXES), rtol=0, atol=1e-12
        )
        moved, accelerated = tooled.motion(q, qd), tooled.acceleration(*motion)
        np.testing.assert_allclose(moved[:3], position, rtol=0, atol=1e-12)
        np.testing.assert_allclose(pin.exp3(moved[3:6]), turned, rtol=0, atol=1e-12)
        np.testing.assert_allclose(moved[6:], jacobian @ qd, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(accelerated, expected, rtol=1e-12, atol=1e-11)
        assert body is None or body.tool(motion, tcp).tolist() == [*moved, *accelerated]


@pytest.mark.parametrize("solve", [solve_in_place, solve_in_place.py_func], ids=["compiled", "python"])
@given(st.integers(1, 24), st.integers(0, 2**32 - 1))
def test_the_cholesky_solver_matches_lapack(solve, n, seed):
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


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-6, 0.1, 1.0, np.pi - 1e-7, np.pi - 1e-12, np.pi])
def test_a_rotation_vector_converts_back_to_its_rotation(angle):
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
    """Return damped least squares as documented."""
    tall = J.shape[1] <= J.shape[0]
    square = J.T @ J if tall else J @ J.T
    manipulability = np.sqrt(max(np.linalg.det(square), 0.0))
    if manipulability < NEAR_SINGULAR:
        square += np.eye(len(square)) * (DAMPING * (1.0 - manipulability / NEAR_SINGULAR)) ** 2
    return J @ np.linalg.solve(square, torque) if tall else np.linalg.solve(square, J @ torque)


@pytest.mark.parametrize("offset", [(0.0,) * 6, (0.1, -0.2, 0.3, 0.4, -1.0, 2.0)], ids=["flange", "tool"])
def test_the_estimated_force_matches_damped_least_squares(offset):
    arm, random = Arm(UR5E, offset), np.random.default_rng(4)
    for q in (*random.uniform(-2.0, 2.0, (20, 6)), np.array([0.3, -1.0, 0.0, 0.0, 0.0, 0.2])):
        torque, found = random.uniform(-50.0, 50.0, 6), np.empty(6)
        wanted = by_numpy(arm.jacobian(q), torque)
        module.force_at(arm.chain, q, torque, found)
        np.testing.assert_allclose(found, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())
