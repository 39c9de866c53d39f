"""A change of what each motion measures is told soon, and nothing else is."""

import re
from functools import partial

import numpy as np
import pytest

from tvist_lab.metrics.change_detector import KEPT, ChangeDetector
from tvist_lab.metrics.changes import GEAR, MASS, MODES, _of_gear, _of_mass, _of_modes

SCATTER = 0.05


def detector():
    return ChangeDetector(1.0, SCATTER, 0.1)


def told(values, errors=0.02):
    one = detector()
    errors = np.broadcast_to(errors, len(values))
    return [
        (number, change)
        for number, pair in enumerate(zip(values, errors, strict=True))
        if (change := one.take(*map(float, pair))) is not None
    ]


@pytest.mark.parametrize("draw", ["normal", "heavy tails", "more scatter than expected"])
def test_of_a_hundred_motions_without_a_change_at_most_one_is_told_of(draw):
    random, motions, alarms = np.random.default_rng(3), 0, 0
    for _ in range(60):
        offset = random.normal()
        noise = {
            "normal": lambda: SCATTER * random.normal(size=30),
            "heavy tails": lambda: SCATTER * random.standard_t(3, size=30),
            "more scatter than expected": lambda: 2.0 * SCATTER * random.normal(size=30),
        }[draw]()
        alarms += len(told(offset + noise))
        motions += 30
    assert alarms <= 0.01 * motions


@pytest.mark.parametrize("shift", [-0.4, 0.4])
def test_a_change_is_told_within_three_motions_with_its_size(shift):
    for seed in range(20):
        random = np.random.default_rng(seed)
        values = 0.7 + SCATTER * random.normal(size=13) + shift * (np.arange(13) >= 10)
        ((number, change),) = told(values)
        assert number in (10, 11, 12)
        assert change.after - change.before == pytest.approx(shift, abs=4.0 * change.error)


def test_one_outlier_is_no_change():
    random = np.random.default_rng(5)
    values = SCATTER * random.normal(size=30)
    values[15] = 20.0
    assert not told(values)


def test_what_says_little_counts_little():
    values, errors = np.zeros(12), np.full(12, 0.02)
    values[10:], errors[10:] = 0.4, 0.3
    assert not told(values, errors)


def test_a_change_back_is_told_as_well():
    values = np.repeat([0.0, 0.5, 0.0], 10)
    assert [round(change.after - change.before, 2) for _, change in told(values)] == [0.5, -0.5]


def test_what_is_smaller_than_is_worth_telling_is_not_told():
    assert not told(np.repeat([0.0, 0.09], 10), errors=1e-6)


def test_it_remembers_so_many_and_no_more():
    one = detector()
    for _ in range(3 * KEPT):
        one.take(0.0, 0.02)
    assert len(one._kept) == KEPT


@pytest.mark.parametrize("seed", range(10))
def test_no_warning_of_a_change_names_an_interval_that_holds_none(seed):
    random, said = np.random.default_rng([seed, 54]), []
    for arguments, tell in ((MASS, _of_mass), (GEAR, partial(_of_gear, joint="elbow")), (MODES, _of_modes)):
        for _ in range(25):
            one, count = ChangeDetector(*arguments), int(random.integers(5, 30))
            errors = arguments[1] * 10 ** random.uniform(-1.5, 1.2, count)
            shift = random.choice([-1, 1]) * 10 ** random.uniform(-1.5, 0.7)
            values = errors * random.standard_t(3, size=count) + shift * (np.arange(count) >= count // 2)
            found = map(one.take, values.tolist(), errors.tolist())
            said += [tell(change) for change in found if change is not None]
    assert said
    for one in said:
        size, within = map(
            float, re.search(r"([\d.]+) (?:kg|%) .*\(within ([\d.]+) (?:kg|%)\)", one).groups()
        )
        assert size > within or size == within == 0.0, one
