"""The modes that are found after a stop, beside those of matrix pencils and of made-up stops whose modes are known."""

import numpy as np
import pytest
from tests.lab.made_up import SPEEDS, made_up
from tests.lab.matrix_pencil import WINDOW, matrix_pencil
from tests.lab.test_real_arm import RECORDED

from tvist_lab.metrics.felt import felt
from tvist_lab.metrics.motion import motions
from tvist_lab.metrics.table import ring_down_of
from tvist_lab.recordings import read

RIGHT = 0.03
"""Largest difference of f_d [-]."""
AS_STRONG = 0.85
"""Smallest amplitude over the largest one with which a mode is about as strong [-]."""


def rung(random, modes, rate=266.0):
    time = np.arange(0.0, 1.0, 1.0 / rate)
    alpha = 0.02 * random.standard_normal((len(time), 3))
    for f_d, zeta, amplitude in modes:
        sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
        axis = random.normal(size=3)
        wave = np.exp(-sigma * (time - WINDOW[0])) * np.cos(
            2.0 * np.pi * f_d * time + random.uniform(0.0, 6.0)
        )
        alpha += amplitude * np.outer(wave, axis / np.linalg.norm(axis))
    return time, alpha


@pytest.mark.parametrize("seed", range(10))
def test_matrix_pencils_find_the_modes_of_a_linear_ring(seed):
    random = np.random.default_rng(seed)
    f_d = random.uniform(7.0, 15.0)
    modes = [(f_d, 0.04, 1.0), (f_d + random.uniform(2.0, 4.0), 0.03, 0.6)]
    found = matrix_pencil(*rung(random, modes))
    for (f_d, zeta, amplitude), mode in zip(modes, found[:2], strict=True):
        assert mode.f_d == pytest.approx(f_d, rel=0.01)
        assert mode.zeta == pytest.approx(zeta, abs=0.01)
        assert mode.amplitude == pytest.approx(amplitude, rel=0.2)


def test_matrix_pencils_find_no_mode_in_noise_or_in_too_short_a_rest():
    random = np.random.default_rng(3)
    assert matrix_pencil(*rung(random, [])) == []
    time, alpha = rung(random, [(9.0, 0.04, 1.0)])
    assert matrix_pencil(time[:100], alpha[:100]) == []


@pytest.mark.parametrize("name", SPEEDS)
def test_a_made_up_stop_is_one_motion_with_its_stop_and_like_modes(name):
    for seed in range(10):
        made = made_up(SPEEDS[name], seed)
        (motion,) = motions(made.recording)
        assert made.recording.time[motion.shaped_stop] == pytest.approx(made.stop, abs=0.02)
        f_d = np.sort([mode.f_d for mode in made.modes])
        assert 1 <= len(f_d) <= 4
        assert np.all((np.diff(f_d) > 1.8) & (np.diff(f_d) < 4.2))
        assert all(0.013 < mode.zeta < 0.06 for mode in made.modes)


def holds(interval, value):
    return interval[0] <= value <= interval[1]


@pytest.mark.parametrize("name", SPEEDS)
def test_the_laboratory_finds_the_strongest_mode_of_made_up_stops(name, measured):
    right, f_d_held, zeta_held, several = [], [], [], []
    for seed in range(400, 410):
        made = made_up(SPEEDS[name], seed)
        fit = ring_down_of(made.recording, motions(made.recording)[-1])
        assert fit.ok
        strong = [mode for mode in made.modes if mode.amplitude >= AS_STRONG * made.modes[0].amplitude]
        right.append(any(abs(fit.f_d / mode.f_d - 1.0) <= RIGHT for mode in strong))
        nearest = min(made.modes, key=lambda mode: abs(mode.f_d - fit.f_d))
        f_d_held.append(holds(fit.f_d_interval, nearest.f_d))
        zeta_held.append(holds(fit.zeta_interval, nearest.zeta))
        if len(made.modes) > 1:
            several.append(len(fit.found) > 1)
    shares = [100.0 * np.mean(one) for one in (right, f_d_held, zeta_held, several)]
    for what, share, least in zip(
        ("one as strong", "f_d held", "ζ held", "two found"), shares, (95.0, 90.0, 85.0, 95.0), strict=True
    ):
        measured(f"{what} [%]", f"{share:.4g}")
        assert share >= least


def test_matrix_pencils_find_what_the_laboratory_does_in_stops_of_a_real_arm():
    recording = read(RECORDED)
    found = motions(recording)
    assert len(found) == 7
    for motion in found:
        time, alpha = felt(recording, motion, slice(motion.shaped_stop, motion.end))
        modes = matrix_pencil(time - recording.time[motion.shaped_stop], alpha)
        fit = ring_down_of(recording, motion)
        assert fit.f_d == pytest.approx(modes[0].f_d, rel=RIGHT)
        assert holds(fit.f_d_interval, modes[0].f_d)
        assert holds(fit.zeta_interval, modes[0].zeta)
        assert len(fit.found) > 1 or len(modes) == 1
