"""Shaped references drive a damped oscillator, solved exactly: the designed mode must come to rest."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

from tvist_shaping import SHAPERS, Fixed, TvistFilter, residual, shaper

ZERO_AT_THE_DESIGN = ["zv", "mzv", "zvd", "zvdd", "zvddd", "ei2", "ei2_exact", "um_zv", "um_zvd"]
V_AT_THE_DESIGN = ["ei_exact", "ei3_exact"]
MODES = [
    (6.7, 0.34),
    (15.0, 0.14),
    (10.5, 0.0),
    (10.0, 0.1),
    (8.0, 0.19),
    (7.0, 0.3),
    (9.0, 0.48),
    (3.0, 0.7),
]


def frequencies(f_d, zeta):
    omega_d = 2.0 * np.pi * f_d
    return omega_d, omega_d / np.sqrt(1.0 - zeta**2)


def amplitude(deflection, velocity, f_d, zeta):
    """Amplitude of the free oscillation from a state."""
    omega_d, omega_n = frequencies(f_d, zeta)
    return np.hypot(deflection, (velocity + zeta * omega_n * deflection) / omega_d)


def amplitude_after_steps(impulses, f_d, zeta):
    """Amplitude left by a step of the reference at each impulse: closed-form step responses, superposed."""
    omega_d, omega_n = frequencies(f_d, zeta)
    late = impulses.tau[-1] - impulses.tau
    envelope = impulses.A * np.exp(-zeta * omega_n * late)
    deflection = -(
        envelope * (np.cos(omega_d * late) + zeta * omega_n / omega_d * np.sin(omega_d * late))
    ).sum()
    velocity = (envelope * omega_n**2 / omega_d * np.sin(omega_d * late)).sum()
    return amplitude(deflection, velocity, f_d, zeta)


def amplitude_by_propagation(impulses, f_d, zeta):
    """The same by the matrix exponential of ẍ = ω_n²(r - x) - 2ζω_n ẋ, from one impulse to the next."""
    _, omega_n = frequencies(f_d, zeta)
    system = np.array([[0.0, 1.0], [-(omega_n**2), -2.0 * zeta * omega_n]])
    state, reference = np.zeros(2), 0.0
    for A, wait in zip(impulses.A, np.append(np.diff(impulses.tau), 0.0), strict=True):
        reference += A
        rest = np.array([reference, 0.0])
        state = rest + expm(system * wait) @ (state - rest)
    return amplitude(state[0] - 1.0, state[1], f_d, zeta)


def valid(names):
    """Each with every mode that it is for."""
    return [(name, *mode) for name in names for mode in MODES if mode[1] < SHAPERS[name].zeta_max]


@pytest.mark.parametrize(("name", "f_d", "zeta"), valid(ZERO_AT_THE_DESIGN))
def test_a_shaped_step_leaves_the_designed_mode_at_rest(name, f_d, zeta):
    impulses = SHAPERS[name].function(f_d, zeta)
    limit = 1e-7 if name == "ei2_exact" else 1e-9
    assert residual(f_d, zeta, impulses) < limit
    assert amplitude_after_steps(impulses, f_d, zeta) < limit
    assert amplitude_by_propagation(impulses, f_d, zeta) < limit


@pytest.mark.parametrize(("name", "f_d", "zeta"), valid(V_AT_THE_DESIGN))
def test_an_exact_hump_leaves_five_percent_of_the_designed_mode_whatever_its_damping(name, f_d, zeta):
    impulses = SHAPERS[name].function(f_d, zeta)
    one_step = amplitude_after_steps(SHAPERS["none"].function(f_d, zeta), f_d, zeta)
    assert residual(f_d, zeta, impulses) == pytest.approx(0.05, abs=1e-7)
    assert amplitude_after_steps(impulses, f_d, zeta) == pytest.approx(0.05 * one_step, abs=1e-7)
    assert amplitude_by_propagation(impulses, f_d, zeta) == pytest.approx(0.05 * one_step, abs=1e-7)


@pytest.mark.parametrize("name", SHAPERS)
@pytest.mark.parametrize(("f", "zeta"), [(5.0, 0.0), (7.1, 0.2), (14.0, 0.14), (9.0, 0.6)])
def test_the_sensitivity_formula_is_what_an_oscillator_of_another_mode_keeps(name, f, zeta):
    impulses = SHAPERS[name].function(9.0, 0.1)
    one_step = amplitude_after_steps(SHAPERS["none"].function(f, zeta), f, zeta)
    left = residual(f, zeta, impulses) * one_step
    assert amplitude_after_steps(impulses, f, zeta) == pytest.approx(left, abs=1e-12)
    assert amplitude_by_propagation(impulses, f, zeta) == pytest.approx(left, abs=1e-9)


@pytest.mark.parametrize("name", [name for name in ZERO_AT_THE_DESIGN if SHAPERS[name].peak == 1.0])
@pytest.mark.parametrize(("f_d", "zeta"), [(6.7, 0.02), (15.0, 0.14), (7.93, 0.05)])
def test_the_sampled_filter_brings_the_oscillator_to_rest_after_a_motion(name, f_d, zeta):
    """The reference between two ticks is a straight line, for which the oscillator is solved exactly."""
    h = 0.002
    _, omega_n = frequencies(f_d, zeta)
    t = np.clip(h * np.arange(500) / 0.1, 0.0, 1.0)  # a motion of 0.1 s: about a period, it rings
    reference = t**4 * (35.0 - 84.0 * t + 70.0 * t**2 - 20.0 * t**3)
    system = np.zeros((4, 4))  # state x, ẋ, r, ṙ
    system[0, 1] = system[2, 3] = 1.0
    system[1] = [-(omega_n**2), -2.0 * zeta * omega_n, omega_n**2, 0.0]
    tick = expm(system * h)

    def left(reference, ticks):
        x = np.zeros(2)
        for now, then in pairwise(reference[: ticks + 1]):
            x = (tick @ np.array([*x, now, (then - now) / h]))[:2]
        return amplitude(x[0] - 1.0, x[1], f_d, zeta)

    tvist = TvistFilter(shaper(name), Fixed([f_d], [zeta]), joints=1, period=h)
    shaped = np.array([tvist.filter([x])[0] for x in reference])
    end = int(np.ceil((0.1 + tvist.delay) / h)) + 2
    assert shaped[end] == 1.0
    assert left(shaped, end) < 1e-4 * left(reference, 50)
