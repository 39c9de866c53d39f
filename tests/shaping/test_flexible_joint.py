"""One flexible joint: the closed form is the mode of its equation of motion."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_shaping import FlexibleJoint, TvistFilter, flexible_joint, shaper

INERTIA = st.floats(1e-3, 1e3)
STIFFNESS = st.floats(1.0, 1e6)
SHARE = st.floats(0.0, 0.99)
"""Damping over critical damping."""


@examples(100)
@given(INERTIA, STIFFNESS, SHARE)
def test_mode_is_the_eigenvalue_of_the_equation_of_motion(inertia, stiffness, share):
    damping = share * 2.0 * math.sqrt(stiffness * inertia)
    f_d, zeta = flexible_joint(inertia, stiffness, damping)
    poles = np.linalg.eigvals([[0.0, 1.0], [-stiffness / inertia, -damping / inertia]])
    pole = poles[np.argmax(poles.imag)]
    assert f_d == pytest.approx(pole.imag / (2.0 * math.pi), rel=1e-6)
    assert zeta == pytest.approx(-pole.real / abs(pole), abs=1e-9)


@examples(100)
@given(INERTIA, st.floats(1.0, 30.0), STIFFNESS, SHARE)
def test_modes_of_the_inertia_range_stay_within_the_bounds(low, factor, stiffness, share):
    damping = share * 2.0 * math.sqrt(stiffness * low)
    joint = FlexibleJoint(lambda q: q[0], (low, factor * low), stiffness, damping)
    for inertia in np.linspace(low, factor * low, 40):
        f_d, zeta = joint.estimate(np.array([inertia]))
        assert f_d[0] >= joint.f_d_min * (1.0 - 1e-12)
        assert zeta[0] <= joint.zeta_max * (1.0 + 1e-12)


def test_inertia_beyond_the_range_is_clamped_and_reported():
    joint = FlexibleJoint(lambda q: q[0], (0.1, 0.5), 420.0, 1.05)
    within, beyond = joint.estimate(np.array([0.5])), joint.estimate(np.array([2.0]))
    assert joint.clipped
    np.testing.assert_array_equal(beyond, within)
    joint.estimate(np.array([0.3]))
    assert not joint.clipped


def test_filter_delay_follows_the_inertia_at_the_shaped_reference():
    joint = FlexibleJoint(lambda q: 0.27 + 0.18 * math.cos(q[1]), (0.09, 0.45), 420.0, 1.05)
    tvist = TvistFilter(shaper("zv"), joint, joints=2)
    for elbow in (0.0, 1.0, 2.5):
        tvist.reset([0.3, elbow])
        tvist.filter([0.3, elbow])
        f_d, _ = flexible_joint(0.27 + 0.18 * math.cos(elbow), 420.0, 1.05)
        assert tvist.delay == pytest.approx(0.5 / f_d, rel=1e-9)
