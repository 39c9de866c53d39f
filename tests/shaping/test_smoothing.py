"""Filters that only smooth have their length in their name."""

from dataclasses import replace

import numpy as np
import pytest

from tvist_shaping.catalogue import SHAPERS
from tvist_shaping.errors import DesignError, UnknownShaperError
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.named import BUILT_IN, SMOOTHINGS, Registry, make_filter

MODE = Fixed([10.0], [0.1])


@pytest.mark.parametrize("kind", ["elastic", "elastic-position"])
@pytest.mark.parametrize("length", SMOOTHINGS)
def test_the_length_is_that_of_the_name(kind, length):
    smooth = make_filter(f"{kind}-{length}", MODE, joints=1)
    assert (smooth.name, smooth.feed_forward) == (f"{kind}-{length}", kind)
    assert smooth.delay == pytest.approx(length / 1000.0)
    weights = smooth.filter_all(np.eye(1, length // 2 + 1).T)
    assert weights.sum() == pytest.approx(1.0)
    assert (weights > 0.0).all()
    assert weights == pytest.approx(weights[::-1])


def test_without_a_length_it_is_40_ms():
    reference = np.cumsum(np.random.default_rng(1).normal(size=(200, 1)), axis=0)
    short, long = (make_filter(name, MODE, joints=1) for name in ("elastic", "elastic-40"))
    assert np.array_equal(short.filter_all(reference), long.filter_all(reference))


@pytest.mark.parametrize("name", ["elastic-7", "elastic-6", "elastic-62", "elastic-position-9", "elastic-0"])
def test_a_length_that_no_filter_has_is_refused_with_the_lengths_that_there_are(name):
    with pytest.raises(DesignError, match=r"even, from 8 to 60 ms, as in elastic(-position)?-16"):
        BUILT_IN.check(name)


@pytest.mark.parametrize(
    "name",
    [
        "elastic-",
        "elastic-x",
        "elastic-16-16",
        "auto-16",
        "zv-16",
        "elastic-016",
        "elastic-\uff11\uff16",
        f"elastic-{'9' * 5000}",
    ],
)
def test_any_other_name_is_unknown(name):
    with pytest.raises(UnknownShaperError):
        BUILT_IN.check(name)


def test_nobody_else_may_have_such_a_name():
    with pytest.raises(DesignError, match="a name that no other shaper has"):
        Registry([replace(SHAPERS["zv"], name="elastic-16")])
