"""The swing of one mass, by which the page for trying shaping is checked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.view.one_mass import STEP, swing

frequencies, dampings = st.floats(3.0, 10.0), st.floats(0.0, 0.3)


@given(frequencies, dampings)
def test_the_right_two_impulses_leave_nothing(f_d, zeta):
    unshaped, shaped = swing(f_d, zeta, None), swing(f_d, zeta, (f_d, zeta))
    assert shaped.left < 2e-3 * np.abs(unshaped.deflection).max()
    assert shaped.reference[-1] == pytest.approx(unshaped.reference[-1], abs=1e-9)


@given(frequencies, dampings)
def test_the_swing_is_the_equations_own(f_d, zeta):
    """δ'' + 2ζω δ' + ω² δ = -q̈ by differences, to the change of q̈ within two samples: it is constant within one."""
    one = swing(f_d, zeta, None)
    omega = 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    second = np.diff(one.deflection, 2) / STEP**2
    first = (one.deflection[2:] - one.deflection[:-2]) / (2.0 * STEP)
    acceleration = np.diff(one.reference, 2) / STEP**2
    rest = second + 2.0 * zeta * omega * first + omega**2 * one.deflection[1:-1] + acceleration
    assert np.abs(rest).max() < 2.0 * np.abs(np.diff(acceleration)).max()
