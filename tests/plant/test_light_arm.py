"""The lightly damped arm rings as the real UR5 that it is fitted to; `tests/lab/data/NOTICE` names the recordings."""

import numpy as np
import pytest

from tvist_controller.api.line import respond
from tvist_lab.metrics.ring_down import RingDownSignal
from tvist_lab.study.line import RESTING, ControlLine
from tvist_plant.description import Payload, load
from tvist_plant.flexible_arm import FlexibleArm, combined
from tvist_plant.imperfections import Imperfections

ARM = load("ur5-light")
SENSOR = Payload(mass=0.4, com=(0.0, 0.0, 0.04), inertia=(4e-4, 0.0, 0.0, 4e-4, 0.0, 4e-4))
"""What the recorded arm carried, about."""
A, B, C = (np.array(ARM.poses[name]) for name in "ABC")
ELSEWHERE = A + np.array([0.45, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Where the slow move to C begins here; nobody has recorded that."""
SLOW, FAST = (1.05, 1.4), (3.2, 25.0)
"""Velocity [rad/s] and acceleration [rad/s^2] of the joint that moves farthest."""
STOPS = {
    "A slow": (B, A, SLOW, 13.5, (10.0, 20.0)),
    "A fast": (B, A, FAST, 12.83, (10.0, 20.0)),
    "B slow": (A, B, SLOW, 11.88, (7.0, 10.5)),
    "B fast": (A, B, FAST, 8.84, (10.0, 14.0)),
    "C slow": (ELSEWHERE, C, SLOW, 9.2, (10.0, 14.0)),
}
"""Start, end, limits, the f_d that dominates in the recordings [Hz], and where a second mode is looked for [Hz]."""


def commanded(start, end, limits):
    """What the drives get for a trapezoid of velocity, and the row in which it ends."""
    way, (v, a) = np.abs(end - start).max(), limits
    lasts, t = way / v + v / a, np.arange(0.0, way / v + v / a + 0.002, 0.002)
    s = np.where(t < v / a, 0.5 * a * t**2, 0.5 * v**2 / a + v * (t - v / a))
    s = np.where(t < lasts - v / a, s, way - 0.5 * a * np.maximum(lasts - t, 0.0) ** 2)
    reference = start + (end - start) * (s / way)[:, None]
    return ControlLine(ARM, start, SENSOR).follow(reference, reference), RESTING + len(reference)


def ringing(name):
    """Acceleration of the flange from the stop on, in world axes, shape (T, 3) [m/s^2]."""
    start, end, limits, *_ = STOPS[name]
    following, stop = commanded(start, end, limits)
    found = respond(FlexibleArm(ARM, SENSOR), following._driven, 0)
    felt = np.einsum("tij,tj->ti", found.flange_rotation, found.specific_force) - [0.0, 0.0, 9.81]
    return felt[stop:] + 0.03 * np.random.default_rng(0).standard_normal(felt[stop:].shape)


def modes(alpha, begin, window, guesses):
    """Modes between two moments after the stop, as amplitude, f_d and damping ratio, the strongest first."""
    first = round(begin / 0.002)
    signal = RingDownSignal(alpha[first:], 0.002 * np.arange(len(alpha) - first), 0.002, (0.0,)).cut(window)
    found, _ = signal.modes_at(signal.refine(np.ravel([[f_d, 0.03] for f_d in guesses]))[1])
    return sorted(((one.amplitude, one.f_d, one.zeta) for one in found), reverse=True)


def linear(q):
    """Its two lowest modes without hysteresis, which adds some percent [Hz]."""
    found = FlexibleArm(ARM, SENSOR).modes(q)
    return 1.05 * found.f_d[found.zeta < 0.3][:2]


@pytest.mark.parametrize("name", STOPS)
def test_stop_rings_with_the_recorded_frequency_and_damping(name, measured):
    _, end, _, wanted, second = STOPS[name]
    (size, f_d, zeta), (other, beside, _) = modes(ringing(name), 0.12, 0.55, linear(end))
    measured(f"{name}: f_d [Hz], recorded {wanted}", f_d)
    measured(f"{name}: damping ratio", zeta)
    measured(f"{name}: second mode over the first", other / size)
    assert f_d == pytest.approx(wanted, rel=0.1)
    assert 0.013 <= zeta <= 0.065
    assert second[0] < beside < second[1]
    assert other > 0.05 * size


@pytest.mark.parametrize("name", ["A fast", "B fast"])
def test_frequency_rises_and_damping_falls_during_the_decay(name, measured):
    alpha, guesses = ringing(name), linear(STOPS[name][1])
    _, early, damped = modes(alpha, 0.0, 0.25, guesses)[0]
    _, late, less = modes(alpha, 0.42, 0.25, guesses)[0]
    measured(f"{name}: rise of f_d [%]", 100.0 * (late / early - 1.0))
    assert 1.01 < late / early < 1.08
    assert less < 0.85 * damped


def test_given_imperfections_override_those_of_the_robot_file():
    assert ARM.imperfections == Imperfections(hysteresis=0.14, hysteresis_torque=0.003, rotor=3.0)
    both = combined(ARM, Imperfections(breakaway=1.5, hysteresis=0.3))
    assert both == Imperfections(hysteresis=0.3, hysteresis_torque=0.003, rotor=3.0, breakaway=1.5)
