"""Modes on which several fits agree are those of the arm, through coloured noise and neighbours."""

import numpy as np
import pytest

from tvist_lab.metrics.agreed_modes import agreed_modes


def rung(random, modes, rate, correlation):
    time = np.arange(int(1.5 * rate)) / rate
    alpha = np.zeros((len(time), 3))
    for f_d, zeta, amplitude in modes:
        axis = random.normal(size=3)
        sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
        wave = (
            amplitude * np.exp(-sigma * time) * np.cos(2.0 * np.pi * f_d * time + random.uniform(0.0, 6.28))
        )
        alpha += np.outer(wave, axis / np.linalg.norm(axis))
    noise = random.standard_normal((len(time), 3))
    for row in range(1, len(noise)):
        noise[row] = correlation * noise[row - 1] + np.sqrt(1.0 - correlation**2) * noise[row]
    return alpha + 0.03 * noise, time


@pytest.mark.parametrize("correlation", [0.0, 0.9])
@pytest.mark.parametrize("count", [10, pytest.param(200, marks=pytest.mark.nightly)])
def test_two_modes_near_each_other_are_inside_their_intervals(count, correlation, measured):
    inside, found = [], 0
    for seed in range(count):
        random = np.random.default_rng([seed, 7])
        f_d = random.uniform(6.0, 18.0)
        modes = [
            (f_d, random.uniform(0.01, 0.06), 1.0),
            (f_d + random.uniform(2.0, 4.0), random.uniform(0.01, 0.06), random.uniform(0.4, 0.9)),
        ]
        rate = random.choice([125.0, 266.0, 500.0])
        fit = agreed_modes(*rung(random, modes, rate, correlation), 1.0 / rate, 0.006)
        assert fit.ok, fit.reason
        for mode in fit.found:
            true = min(modes, key=lambda one: abs(one[0] - mode.f_d))
            assert mode.f_d == pytest.approx(true[0], rel=0.05)
            inside += [
                mode.f_d_interval[0] <= true[0] <= mode.f_d_interval[1],
                mode.zeta_interval[0] <= true[1] <= mode.zeta_interval[1],
            ]
            found += 1
    measured("coverage", f"{np.mean(inside):.3f} of {found} modes")
    assert np.mean(inside) > 0.85


def test_intervals_hold_what_changes_while_a_mode_decays(measured):
    """f_d rises by 3 % and ζ falls to a half with the amplitude; the truth is the mean over the energy."""
    inside = []
    for seed in range(10):
        random = np.random.default_rng([seed, 11])
        f_d, zeta, step = random.uniform(7.0, 18.0), random.uniform(0.03, 0.06), 5e-4
        amplitude, phase, courses = 1.0, 0.0, []
        while len(courses) < 2000:
            now = f_d * (1.0 - 0.03 * amplitude), zeta * (0.5 + 0.5 * amplitude)
            courses.append((amplitude, phase, *now))
            phase += 2.0 * np.pi * now[0] * step
            amplitude *= np.exp(-2.0 * np.pi * now[0] * now[1] * step)
        course = np.array(courses)
        true = np.average(course[:, 2:], axis=0, weights=course[:, 0] ** 2)
        rings, axis = course[::8], random.normal(size=3)
        alpha = np.outer(4.0 * rings[:, 0] * np.cos(rings[:, 1]), axis / np.linalg.norm(axis))
        alpha += 0.03 * random.standard_normal(alpha.shape)
        # One that is loud must not be taken for two at the same place.
        fit = agreed_modes(alpha, 8 * step * np.arange(len(alpha)), 8 * step, 0.006)
        assert len(fit.found) == 1, fit.reason
        for (low, high), value in zip((fit.f_d_interval, fit.zeta_interval), true, strict=True):
            inside.append(low <= value <= high)
            assert high - low < value
    measured("coverage", f"{np.mean(inside):.2f}")
    assert np.mean(inside) > 0.85


def test_of_two_modes_that_is_the_strongest_which_is_so_after_the_first_tenth_of_a_second():
    for seed in range(6):
        random = np.random.default_rng([seed, 13])
        modes = [
            (9.0, 0.03, 1.0),
            (13.0, 0.09, 1.5),
        ]  # equal after 0.1 s, the second by far larger at the stop
        fit = agreed_modes(*rung(random, modes, 266.0, 0.0), 1.0 / 266.0, 0.04)
        assert fit.f_d == pytest.approx(9.0, rel=0.02)
        assert fit.found[1].f_d == pytest.approx(13.0, rel=0.03)
        assert fit.found[1].amplitude > fit.amplitude


def test_noise_alone_is_refused():
    for seed in range(4):
        random = np.random.default_rng(seed)
        assert not agreed_modes(*rung(random, [], 266.0, 0.0), 1 / 266.0, 0.006).ok
