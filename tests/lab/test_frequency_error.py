"""Settling for a wrong frequency agrees with the catalogue and with a simulated mode."""

import numpy as np
import pytest

from tvist_lab.frequency_error import ALLOWED, settling_time
from tvist_shaping import SHAPERS


@pytest.mark.parametrize("name", ["zv", "zvd", "ei", "ei3"])
def test_mode_with_the_right_frequency_settles_at_the_stop(name):
    shaper = SHAPERS[name]
    assert settling_time(shaper, 8.0, 0.1, 0.0) == pytest.approx(shaper.impulses(8.0, 0.1).duration)


def test_undamped_residual_never_decays():
    assert settling_time(SHAPERS["zv"], 8.0, 0.0, 0.2) == np.inf
    assert np.isfinite(settling_time(SHAPERS["zv"], 8.0, 0.0, 0.0))


def test_settling_time_is_that_of_the_impulse_response():
    shaper, f_d, zeta, error = SHAPERS["zv"], 8.0, 0.1, 0.15
    omega = 2.0 * np.pi * f_d
    sigma = omega * zeta / np.sqrt(1.0 - zeta**2)
    still = []
    for wrong in (1.0 - error, 1.0 + error):
        impulses = shaper.impulses(wrong * f_d, zeta)
        after = np.exp((sigma - 1j * omega) * impulses.tau) @ impulses.A  # the envelope, seen from t = 0
        still.append(np.log(abs(after) / ALLOWED) / sigma)
    assert settling_time(shaper, f_d, zeta, error) == pytest.approx(max(still), rel=1e-3)
