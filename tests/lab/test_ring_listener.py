"""The factor by which a ring-down differs from the model's is found, with an error that is true."""

import numpy as np
import pytest

from tvist_controller.setup import body, paper_payload
from tvist_lab.metrics.ring_listener import BASES, FIRST, RingListener
from tvist_plant.description import load

ROBOT = load("ur5e")
PAYLOAD = body(paper_payload(ROBOT, 2.0))


def ring_down(listener, base, q, factor, amplitude, random):
    f_d, zeta = listener._models[base].settle(q)
    time, alpha = (
        0.002 * np.arange(150)[:, None],
        np.array([0.0, 0.0, 9.81]) + 0.03 * random.normal(size=(150, 3)),
    )
    for f, z in zip(factor * f_d[:2], zeta[:2], strict=True):
        wave = np.exp(-2 * np.pi * f * z / np.sqrt(1 - z * z) * time)
        alpha += (
            amplitude
            * wave
            * np.cos(2 * np.pi * f * time + random.uniform(0, 6, 3))
            * random.uniform(0.3, 1, 3)
        )
    return alpha


def poses(random):
    return random.uniform([-3, -3, -2.5, -3, -2, -2], [3, 0, 2.5, 0, 2, 2])


@pytest.mark.parametrize("base", [0, 12])
def test_factor_and_base_are_found(base):
    random = np.random.default_rng(base)
    listener, first = RingListener(ROBOT, PAYLOAD), []
    for _ in range(FIRST):
        q = poses(random)
        assert not first
        first = listener.study(ring_down(listener, base, q, 1.05, 0.8, random), q)
    assert len(first) >= FIRST - 2
    assert abs(np.log(BASES[listener._base] / BASES[base])) < 0.5
    later = []
    for _ in range(10):
        q = poses(random)
        later += listener.study(ring_down(listener, base, q, 0.85, 0.8, random), q)
    values, errors = np.array(later).T
    assert np.median(values) == pytest.approx(np.log(0.85), abs=0.03)
    assert np.mean(np.abs(values - np.log(0.85)) < 3.0 * errors + 0.02) > 0.7


def test_a_stop_that_does_not_ring_says_nothing():
    random = np.random.default_rng(1)
    listener, found = RingListener(ROBOT, PAYLOAD), []
    for _ in range(FIRST + 10):
        q = poses(random)
        found += listener.study(ring_down(listener, 0, q, 1.0, 0.0, random), q)
    assert len(found) <= 2


def test_a_stop_with_missing_readings_says_nothing_and_does_not_count():
    random = np.random.default_rng(2)
    listener, found = RingListener(ROBOT, PAYLOAD), []
    for stop in range(FIRST + 1):
        q = poses(random)
        alpha = ring_down(listener, 12, q, 1.0, 0.8, random)
        alpha[20, 0] = np.nan if stop == 0 else alpha[20, 0]
        found += listener.study(alpha, q)
    assert len(found) >= FIRST - 2
    assert abs(np.log(BASES[listener._base] / BASES[12])) < 0.5
