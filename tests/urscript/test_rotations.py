"""Rotations agree with scipy, and near 0 and π with exact values."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from tests.examples import examples

from tvist_urscript import Array, Pose
from tvist_urscript.poses import (
    interpolate_pose,
    pose_add,
    pose_inv,
    pose_sub,
    pose_trans,
    rotvec2rpy,
    rpy2rotvec,
)

NUMBERS = st.floats(-3, 3)
POSES = st.lists(NUMBERS, min_size=6, max_size=6).map(Pose)


def parts(pose):
    return np.array(pose.items[:3]), Rotation.from_rotvec(pose.items[3:])


def is_near(pose, position, rotation, within=1e-12):
    at, turn = parts(pose)
    assert at == pytest.approx(position, abs=within)
    assert (turn * rotation.inv()).magnitude() <= within * 10


@given(POSES, POSES)
@examples(200)
def test_pose_functions_agree_with_scipy(a, b):
    (x, r), (y, s) = parts(a), parts(b)
    is_near(pose_trans(a, b), x + r.apply(y), r * s)
    is_near(pose_inv(a), -r.inv().apply(x), r.inv())
    is_near(pose_add(a, b), x + y, r * s)
    is_near(pose_sub(a, b), x - y, r * s.inv())
    is_near(
        interpolate_pose(a, b, 0.25),
        x + 0.25 * (y - x),
        Rotation.from_rotvec(0.25 * (s * r.inv()).as_rotvec()) * r,
    )


@given(st.lists(NUMBERS, min_size=3, max_size=3))
@examples(100)
def test_roll_pitch_and_yaw_agree_with_scipy(angles):
    turn = Rotation.from_euler("xyz", angles)
    found = Rotation.from_rotvec(rpy2rotvec(Array(angles)).items)
    assert (found * turn.inv()).magnitude() < 1e-12
    again = Rotation.from_euler("xyz", rotvec2rpy(rpy2rotvec(Array(angles))).items)
    # The angles themselves are that sensitive where pitch is π/2.
    assert (again * turn.inv()).magnitude() < 1e-7


@pytest.mark.parametrize(
    "angle", [1e-300, 1e-160, 1e-16, 1e-8, 1e-4, 1.0, 3.0, math.pi - 1e-4, math.pi - 1e-8, math.pi]
)
def test_rotation_vectors_are_accurate_near_0_and_pi(angle):
    for axis in ((1, 0, 0), (0.6, 0, 0.8), (2 / 3, -1 / 3, 2 / 3)):
        vector = [angle * x for x in axis]
        found = pose_trans(Pose([0] * 6), Pose([0, 0, 0, *vector])).items[3:]
        assert found == pytest.approx(vector, rel=4e-15, abs=angle * 2e-16)


def test_an_angle_above_pi_becomes_the_shorter_one():
    found = pose_trans(Pose([0] * 6), Pose([0, 0, 0, 0, 0, 4]))
    assert found.items[5] == pytest.approx(4 - 2 * math.pi, abs=1e-14)
