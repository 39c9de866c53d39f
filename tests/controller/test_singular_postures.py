"""Inverse kinematics where postures merge or a joint is free, and its kernels against their Python source."""

import importlib
import itertools
import pkgutil

import numpy as np
import pytest
from tests.controller.postures import (
    FREE,
    PUMA,
    UR5E,
    error,
    every,
    improved,
    pose_of,
    wrapped,
)
from tests.plant.arms import chain, frames

import tvist_controller.kinematics
from tvist_controller.kinematics import choice
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.choice import closest, search
from tvist_controller.kinematics.inverse import InverseKinematics, InverseKinematicsError
from tvist_controller.kinematics.least_squares import approach
from tvist_controller.kinematics.postures import arm_table


@pytest.mark.parametrize("case", FREE)
def test_the_nearest_posture_is_found_where_postures_merge_or_a_joint_is_free(case):
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
        for start in near + rng.uniform(-np.pi, np.pi, (32, 6)):
            if approach(links, *pose, near, start) < 1e-9 and np.all(
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
        postures = every(description, (rotation, position + distance * outwards))
        return [p for p in postures if np.abs(wrapped(p - q)).max() < 0.2]

    for distance in (0.0, 1e-16, 1e-11, -1e-6):
        assert close(distance)
    for distance in (1e-8, 1e-3, 10.0):
        assert not close(distance)
    with pytest.raises(InverseKinematicsError) as refusal:
        ik.solve(rotation, position + 10.0 * outwards, q)
    assert (refusal.value.code, refusal.value.limit) == ("no_solution", None)


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
    links = Arm(description).chain
    one, other = np.empty((2, 6))
    expected = improved(table, links, pose, near)
    status = closest(table, links, *pose, near, one)
    uncompile(monkeypatch)
    found = improved(table, links, pose, near)
    assert choice.closest(table, links, *pose, near, other) == status
    assert status % choice.ON_CURVE == choice.FOUND
    exist = ~np.isnan(expected[:, 0])
    np.testing.assert_array_equal(~np.isnan(found[:, 0]), exist)
    np.testing.assert_allclose(found[exist], expected[exist], rtol=0, atol=1e-7)
    np.testing.assert_allclose(other, one, rtol=0, atol=1e-7)


def test_the_compiled_search_equals_its_python_source(monkeypatch):
    description, q = chain(4), np.array([0.5, -1.0, 1.2, 0.4])
    table, pose, near = arm_table(description), pose_of(description, q), q + 0.1
    links = Arm(description).chain
    starts = np.random.default_rng(10).uniform(-3, 3, (5, 4))
    expected, found = np.empty((2, 12, 4))
    best = search(table, links, starts, *pose, near, expected)
    uncompile(monkeypatch)
    assert choice.search(table, links, starts, *pose, near, found) == best
    np.testing.assert_allclose(found[best], expected[best], rtol=0, atol=1e-9)
