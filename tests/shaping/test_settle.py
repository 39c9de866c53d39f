"""The lowest modes are taken anew where nothing moves and the delay line holds no motion, and nowhere else."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_shaping import TvistFilter, shaper
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal
from tvist_shaping.steady import ProductDesign, SteadyFilter

H = 0.002
TWO = Drivetrain((9e3, 9e3), (0.3, 0.3), (150.0, 150.0), (15.0, 15.0))
SLOWEST = 4.5
"""Below every mode of the arm [Hz]."""
BEND = np.pi / 3
"""Where the two modes change places [rad]."""


def arm():
    """One joint, two coordinates that know nothing of each other, one as heavy as the joint is bent.

    The lighter one has the higher frequency: the lowest mode is one coordinate's below BEND, the other's above.
    """
    return Modal(lambda q: np.diag([1.0 + np.sin(q[0] / 2.0) * 2.0, 2.0]), TWO, modes=1, f_d_min=SLOWEST)


FILTERS = {
    **{name: lambda name=name: TvistFilter(shaper(name), arm(), joints=1) for name in ("zv", "zvd", "ei3")},
    "product": lambda: SteadyFilter(ProductDesign(0.05, modes=1), arm(), joints=1),
}

LONGEST = {"zv": 0.5 / SLOWEST, "zvd": 1.0 / SLOWEST, "ei3": 2.0 / SLOWEST, "product": 0.26}
"""Longest delay that may be read, whatever the mode [s]."""


def lowest(q):
    return arm().estimate(np.array(q, dtype=float))[0][0]


def run(tvist, reference):
    """Outputs, and for each the f_d it was made with."""
    rows = [(tvist.filter([q])[0], tvist.f_d[0]) for q in reference]
    return np.array(rows).T


def way(start, end, seconds):
    """A smooth way from rest to rest [rad]."""
    s = np.linspace(0.0, 1.0, max(round(seconds / H), 2))
    return start + (end - start) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def motion(random):
    """A few ways with pauses between them, of a tick or of long, and a long rest."""
    places = [0.0, *random.uniform(0.0, 2.5, 4)]
    parts = [np.zeros(300)]
    for start, end in pairwise(places):
        parts.append(way(start, end, random.uniform(0.6, 1.5)))
        parts.append(np.full(random.choice([0, 1, 2, 15, 40, 100, 400]), end))
    parts.append(np.full(600, places[-1]))
    return np.concatenate(parts)


@examples(25)
@given(st.sampled_from(sorted(FILTERS)), st.integers(0, 2**32 - 1))
def test_mode_jumps_only_while_the_reference_rests(name, seed):
    """Wherever the frequency jumps, the reference has been one sample for as long as any delay may be."""
    reference = motion(np.random.default_rng(seed))
    tvist = FILTERS[name]()
    shaped, f_d = run(tvist, reference)
    # Followed, a mode changes by less than 4 % between estimates; exchanged, by more but near the crossing itself.
    for tick in np.flatnonzero(np.abs(np.diff(f_d)) > 0.05 * f_d[1:]) + 1:
        held = reference[max(tick - round(LONGEST[name] / H), 0) : tick + 1]
        assert (held == held[0]).all()
        assert (shaped[tick - 1 : tick + 1] == held[0]).all()


@pytest.mark.parametrize("name", FILTERS)
def test_lowest_mode_is_used_after_a_rest_without_moving_the_output(name):
    tvist = FILTERS[name]()
    out = np.concatenate([way(0.0, 2.0, 0.8), np.full(900, 2.0)])
    shaped, f_d = run(tvist, out)
    ended = np.flatnonzero(shaped != 2.0)[-1] + 1
    assert f_d[ended] > 1.05 * lowest([2.0])  # until then the one it started with is followed
    assert f_d[-1] == lowest([2.0])
    assert (shaped[ended:] == 2.0).all()


def test_short_pause_does_not_switch_modes():
    """The case the others may miss: two equal outputs while a longer delay would still read the motion."""
    tvist = FILTERS["zv"]()
    rests = 50  # ticks: longer than zv lasts with this mode, shorter than it may get
    assert tvist.delay < 0.95 * rests * H < 0.5 / SLOWEST
    shaped, f_d = run(tvist, np.concatenate([way(0.0, 2.0, 0.8), np.full(rests, 2.0)]))
    assert shaped[-1] == shaped[-2] == shaped[-3] == 2.0
    assert f_d[-1] > 1.05 * lowest([2.0])
    tvist.filter([2.0])
    for _ in range(10):
        tvist.filter([2.0])
    assert tvist.f_d[0] == lowest([2.0])


@pytest.mark.parametrize("name", FILTERS)
def test_filter_starts_with_the_lowest_mode(name):
    """At a reset, and where it takes over a motion: then nothing of its output is in force yet."""
    for begin in ("reset", "take over"):
        tvist = FILTERS[name]()
        run(tvist, way(0.0, 2.0, 0.8))
        before = tvist.f_d[0]
        if begin == "reset":
            tvist.reset([tvist._q_star[0] + 0.001])
        else:
            tvist.take_over(tvist.fork())
        assert tvist.f_d[0] == lowest(tvist._q_star) < 0.95 * before
