"""The verdict on a motion without and with a shaper if the network has lost messages."""

import numpy as np
import pytest

from tvist_cli.judging import judge
from tvist_view.request_handler import MotionRecord


def verdict(tracks, seed, share):
    random = np.random.default_rng(seed)
    runs = [
        MotionRecord(track._states, [truth for truth in track._truths.values() if random.random() >= share])
        for track in tracks
    ]
    return judge(*runs)


@pytest.fixture(scope="module")
def whole(tracks):
    return verdict(tracks, 0, 0.0)


@pytest.mark.parametrize("seed", range(3))
def test_verdict_holds_if_a_tenth_of_the_truths_is_lost(tracks, whole, seed):
    part = verdict(tracks, seed, 0.1)
    assert part["less_percent"] == pytest.approx(whole["less_percent"], abs=1.0)
    assert part["earlier_ms"] == pytest.approx(whole["earlier_ms"], abs=10.0)


def test_verdict_without_truths_uses_the_accelerometer(tracks):
    assert verdict(tracks, 0, 1.0)["less_percent"] > 50.0
