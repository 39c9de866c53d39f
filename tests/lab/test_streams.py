"""Streams at the limits to the last digit, as others plan them, through filters of constant mean delay."""

import numpy as np
import pytest
import ruckig

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.study.line import PAPER
from tvist_lab.study.recipes import Recipe, longest_mean_delay
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_shaping.steady import ProductDesign, SteadyFilter

UR5E = load("ur5e")
MODAL = load_calibration("ur5e_modal")
MASSES = (0.0, 1.25, 2.5, 3.75, 5.0)
SECONDS = 90.0  # of each stream: ten of them are a quarter of an hour
RETARGETED = (0.1, 1.5)
"""Shortest and longest time after which a stream turns to a new target, whether or not it has arrived [s]."""


def retargeted(seconds, seed, *, together=False):
    """A stream whose joints go to random targets and are called away from them, often before they are there.

    The two outer joints of the wrist rest at zero; all joints may arrive at the same time.
    """
    random, joints = np.random.default_rng(seed), UR5E.joints
    ends = np.zeros((2, joints))
    ends[:, : len(WORKSPACE.low)] = WORKSPACE.low, WORKSPACE.high
    generator = ruckig.Ruckig(joints, PERIOD)
    state, following = ruckig.InputParameter(joints), ruckig.OutputParameter(joints)
    state.max_velocity = [PAPER.velocity] * joints
    state.max_acceleration = [PAPER.acceleration] * joints
    state.max_jerk = [PAPER.jerk] * joints
    state.synchronization = ruckig.Synchronization.Time if together else ruckig.Synchronization.No
    state.current_position = random.uniform(*ends).tolist()
    out, left = np.empty((round(seconds / PERIOD), joints)), 0
    for tick in range(len(out)):
        out[tick] = state.current_position
        if left == 0:
            state.target_position = random.uniform(*ends).tolist()
            left = round(random.uniform(*RETARGETED) / PERIOD)
        generator.update(state, following)
        following.pass_to_input(state)
        left -= 1
    return out


def peaks(q):
    """Return the peaks of velocity and acceleration, over the limits of the reference."""
    qd, qdd = (float(np.abs(np.diff(q, order, axis=0)).max()) / PERIOD**order for order in (1, 2))
    return qd / PAPER.velocity, qdd / PAPER.acceleration


def streamed(tvist, reference):
    """Return a stream after a filter that does not know where it will end, shape (T, n) [rad]."""
    tvist.reset(reference[0])
    tvist.aim(None)
    return np.array([tvist.filter(q) for q in reference])


def made(name, mass):
    if name != "product":
        return Recipe(name, MODAL).make(UR5E, mass)
    recipe = Recipe("zv", MODAL)
    longest = longest_mean_delay(recipe, UR5E, (0.0, UR5E.limits.payload), 3)
    return SteadyFilter(ProductDesign(longest), recipe.estimator(UR5E, mass, 3), joints=UR5E.joints)


def test_filter_without_a_target_follows_a_stream():
    tvist = made("auto-target", 5.0)
    before = tvist.estimator.estimate(np.zeros(6))[0][0]
    stream = retargeted(4.0, 3)
    shaped = streamed(tvist, stream)
    assert abs(tvist.f_d[0] - before) > 0.02
    assert tvist.f_d[0] == pytest.approx(tvist.estimator.estimate(shaped[-1])[0][0], rel=0.02)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "most"), [("auto", 1.011), ("short", 1.009), ("auto-target", 1.009), ("product", 1.004)]
)
def test_long_streams_keep_velocity_and_99_percent_of_acceleration(name, most):
    """The rest is half the second derivative of the delays' variance: most for independent joints."""
    for number, mass in enumerate(MASSES):
        for together in (False, True):
            stream = retargeted(SECONDS, 1000 + 10 * number + together, together=together)
            velocity, acceleration = peaks(streamed(made(name, mass), stream))
            assert velocity <= 1.00001, (mass, together)
            assert acceleration <= most, (mass, together)
