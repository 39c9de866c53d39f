"""Two methods compared: intervals that hold what they promise, verdicts that follow from them, and the same moves."""

import numpy as np
import pytest
from scipy.stats import binomtest

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.studies.match import (
    FIRST,
    NEITHER,
    SECOND,
    TOO_FEW,
    exact_interval,
    jobs,
    report,
    table,
    verdict,
)
from tvist_lab.study.case import LIMITS
from tvist_lab.study.catalogue import some
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.work import measure
from tvist_plant.variants import variant

PLANTS = [variant("calibrated"), variant("hidden-4")]


@pytest.fixture(scope="module")
def pair(ur5e):
    return some(("auto", "zv"), ur5e, load_calibration("ur5e_modal"))


@pytest.mark.parametrize("count", [20, 33, 60])
def test_the_interval_contains_the_median_of_a_skewed_distribution_as_often_as_it_promises(count):
    """At least 95 %, and not much more, for a distribution that no normal interval would suit."""
    random, found = np.random.default_rng(1), []
    for _ in range(4000):
        low, high = exact_interval(random.exponential(1.0, count) - np.log(2.0))
        found.append(low <= 0.0 <= high)
    assert np.mean(found) + 3.0 * np.sqrt(0.05 * 0.95 / len(found)) >= 0.95
    assert np.mean(found) < 0.985


def test_a_verdict_agrees_with_the_sign_test():
    """An end of the interval is where the exact test begins to reject; equal values are no difference."""
    random = np.random.default_rng(2)
    for shift in np.linspace(-1.0, 1.0, 41):
        differences = random.normal(shift, 1.0, 25)
        shown = verdict(exact_interval(differences))
        assert (shown != NEITHER) == (binomtest(int((differences > 0.0).sum()), 25).pvalue < 0.05)
        assert shown in {NEITHER, FIRST if np.median(differences) > 0.0 else SECOND}
    assert verdict(exact_interval(np.zeros(30))) == NEITHER


def rows(differences, base=90.0):
    """Rows of two methods on two plants, of which the second moves too little."""
    return [
        {"arm": plant.name, "shaper": name, "move": move, "delay_ms": delay,
         "reduction_percent": None if weak and move > 4 else base + more * sign}
        for plant, weak in zip(PLANTS, (False, True), strict=True)
        for name, delay, sign in (("auto", 80.0, 1.0), ("zv", 50.0, 0.0))
        for move, more in enumerate(differences)
    ]  # fmt: skip


def test_the_report_pairs_moves_and_says_nothing_of_too_few(pair):
    differences = np.linspace(0.5, 3.0, 24)
    clear, few = report(pair, PLANTS, rows(differences))
    assert clear["difference"]["median"] == pytest.approx(np.median(differences))
    assert clear["difference"]["median_interval"][0] > 0.0
    assert (clear["verdict"], few["verdict"], few["moves"]) == (FIRST, TOO_FEW, 5)
    assert few["difference"]["median_interval"] is few["difference"]["p5"] is None
    assert (clear["first"]["delay_ms"], clear["second"]["delay_ms"]) == (80.0, 50.0)
    cells = [[column.text(entry) for column in table("auto", "zv")] for entry in (clear, few)]
    assert cells[0][-1] == "auto better"
    assert cells[1][-1] == TOO_FEW
    other, _ = report(pair, PLANTS, rows(-differences))
    assert other["verdict"] == SECOND
    low, high = other["difference"]["p5_interval"]
    assert low <= other["difference"]["p5"] <= high < 0.0


def test_both_make_the_same_moves_on_the_same_arms(ur5e, pair):
    """A method compared with itself differs nowhere, not in the last bit; and nineteen moves are refused."""
    moves = draw_moves(ur5e, 20, 3, (0.0, 5.0)).moves
    todo = jobs(ur5e, (pair[0], pair[0]), PLANTS, moves, 3, LIMITS["gentle"])
    found = measure(todo[0])
    assert [row["arm"] for row in found] == ["calibrated", "hidden-4"] * 2
    assert found[:2] == found[2:]
    with pytest.raises(ValueError, match="there are 19 moves: must be at least 20"):
        jobs(ur5e, pair, PLANTS, moves[:19], 3, LIMITS["gentle"])
