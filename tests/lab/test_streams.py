"""Streams at the limits to the last digit, as others plan them, through filters of constant mean delay."""

import numpy as np
import pytest

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.study.line import PAPER
from tvist_lab.study.recipes import Recipe, longest_mean_delay
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_shaping.steady import ProductDesign, SteadyFilter

from .retargeted import peaks, retargeted, streamed

UR5E = load("ur5e")
MODAL = load_calibration("ur5e_modal")
MASSES = (0.0, 1.25, 2.5, 3.75, 5.0)
SECONDS = 190.0
"""Of each stream: ten of them are more than half an hour."""


def made(name, mass):
    if name != "product":
        return Recipe(name, MODAL).make(UR5E, mass)
    recipe = Recipe("zv", MODAL)
    longest = longest_mean_delay(recipe, UR5E, (0.0, UR5E.limits.payload), 3)
    return SteadyFilter(ProductDesign(longest), recipe.estimator(UR5E, mass, 3), joints=UR5E.joints)


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize("wrists", [False, True])
def test_a_stream_uses_its_limits_to_the_full_and_no_more(together, wrists):
    stream = retargeted(6, 20.0, 3, wrists=wrists, together=together)
    largest = peaks(stream)
    assert largest.velocity == pytest.approx(1.0, abs=1e-9)
    assert largest.acceleration == pytest.approx(1.0, abs=1e-8)
    jerk = np.abs(np.diff(stream, 3, axis=0)).max() / PERIOD**3
    assert jerk <= PAPER.jerk * (1.0 + 1e-6)
    assert wrists == stream[:, 4:].any()
    np.testing.assert_array_equal(stream, retargeted(6, 20.0, 3, wrists=wrists, together=together))


def test_a_filter_that_could_be_told_the_end_follows_the_arm_where_nobody_tells_it():
    tvist = made("auto-target", 5.0)
    before = tvist.estimator.estimate(np.zeros(6))[0][0]
    stream = retargeted(6, 4.0, 3, wrists=False)
    streamed(tvist, stream)
    assert abs(tvist.f_d[0] - before) > 0.02
    assert tvist.f_d[0] == pytest.approx(tvist.estimator.estimate(tvist._q_star)[0][0], rel=0.02)


@pytest.mark.nightly
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    ("name", "acceleration"), [("auto", 1.011), ("short", 1.009), ("auto-target", 1.009), ("product", 1.004)]
)
def test_half_an_hour_of_streams_keeps_velocity_and_all_but_a_hundredth_of_acceleration(name, acceleration):
    """What is left is half the second derivative of the delays' variance; independent joints make the most of it."""
    for number, mass in enumerate(MASSES):
        for together in (False, True):
            stream = retargeted(
                UR5E.joints, SECONDS, 1000 + 10 * number + together, wrists=False, together=together
            )
            largest = peaks(streamed(made(name, mass), stream))
            assert largest.velocity <= 1.00001, (mass, together)
            assert largest.acceleration <= acceleration, (mass, together)
