"""How well a robot follows a payload that nobody has declared; `following` prints the tables of the documentation."""

import numpy as np
import pytest
from tests.paper.following import CASES, SEED, followed, unchanged

LARGEST_OFF = 0.35  # largest error of a mass after a lesson [kg]


def judged(cases, how, first):
    rows = [row for seed in range(first, first + cases) if (row := followed(seed, **how)) is not None]
    behind, errors = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
    taught = errors[:, -1] != errors[:, 0]
    assert taught.mean() > 0.6
    assert np.abs(errors[taught, -1]).max() < LARGEST_OFF
    assert np.median(behind[:, 0]) > 5.0
    assert np.median(behind[:, 1]) < 1.0
    return behind


def test_payload_is_found_in_one_motion_and_kept_if_unchanged():
    judged(3, CASES["friction"], first=100)
    assert unchanged(100, 2, masses=0.03)[0] == 0


@pytest.mark.nightly
@pytest.mark.parametrize("name", CASES)
def test_one_motion_corrects_most_arms_and_unchanged_ones_nothing(name):
    behind = judged(10, CASES[name], first=SEED)
    assert np.mean(behind[:, 1:] <= 2.0) >= 0.85
    told, found = zip(*(unchanged(SEED + seed, 3, **CASES[name]) for seed in range(4)), strict=True)
    assert sum(told) == 0
    assert np.abs(np.concatenate(found)).max() < LARGEST_OFF
