"""Two methods compared: intervals that hold what they promise, verdicts that follow from them, and the same moves."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binomtest

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.studies.match import NEITHER, TOO_FEW, exact_interval, study, verdict
from tvist_lab.study.catalogue import some
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.request import StudyRequest
from tvist_lab.study.study import StudyError
from tvist_lab.study.work import measure
from tvist_plant.variants import variant

PLANTS = [variant("calibrated"), variant("hidden-4")]


@pytest.fixture(scope="module")
def make(ur5e):
    """The study of two shapers on these plants."""
    pair = some(("auto", "zv"), ur5e, load_calibration("ur5e_modal"))

    def made(moves):
        drawn = draw_moves(ur5e, moves, 3, (0.0, 5.0)).moves
        return study(StudyRequest(description=ur5e, moves=drawn, methods=pair, named=2, arms=PLANTS, seed=3))

    return made


@pytest.mark.parametrize("count", [20, 60])
def test_interval_contains_the_median_at_its_confidence(count):
    """At least 95 %, and not much more, for a distribution that no normal interval would suit."""
    random = np.random.default_rng(1)
    drawn = [exact_interval(random.exponential(1.0, count) - np.log(2.0)) for _ in range(4000)]
    held = np.mean([low <= 0.0 <= high for low, high in drawn])
    assert 0.95 - 3.0 * np.sqrt(0.05 * 0.95 / 4000) <= held < 0.985


def test_verdict_agrees_with_the_sign_test():
    """An end of the interval is where the exact test begins to reject; equal values are no difference."""
    random = np.random.default_rng(2)
    for shift in np.linspace(-1.0, 1.0, 41):
        differences = random.normal(shift, 1.0, 25)
        shown = verdict(differences, "first", "second")
        assert (shown != NEITHER) == (binomtest(int((differences > 0.0).sum()), 25).pvalue < 0.05)
        assert shown in {NEITHER, "first better" if np.median(differences) > 0.0 else "second better"}
    assert verdict(np.zeros(30), "first", "second") == NEITHER


def entries(made, differences, base=90.0):
    """Entries of two methods on two plants, of which the second moves too little."""
    rows = [
        {"arm": plant.name, "shaper": name, "move": move, "delay_ms": delay, "status": "measured",
         "reduction_percent": None if weak and move > 4 else base + more * sign}
        for plant, weak in zip(PLANTS, (False, True), strict=True)
        for name, delay, sign in (("auto", 80.0, 1.0), ("zv", 50.0, 0.0))
        for move, more in enumerate(differences)
    ]  # fmt: skip
    return made.summary(made.frame(rows))


def test_report_pairs_moves_and_gives_no_verdict_on_too_few(make):
    differences, made = np.linspace(0.5, 3.0, 24), make(20)
    clear, few = entries(made, differences)
    assert clear["difference_median"] == pytest.approx(np.median(differences))
    assert clear["difference_median_interval"][0] > 0.0
    assert (clear["verdict"], few["verdict"], few["moves"]) == ("auto better", TOO_FEW, 5)
    assert few["difference_median_interval"] is few["difference_p5"] is None
    assert (clear["first_delay_ms_median"], clear["second_delay_ms_median"]) == (80.0, 50.0)
    cells = [[column.text(entry) for column in made.table_of([entry]).columns] for entry in (clear, few)]
    assert [one[-1] for one in cells] == ["auto better", TOO_FEW]
    other, _ = entries(made, -differences)
    assert other["verdict"] == "zv better"
    low, high = other["difference_p5_interval"]
    assert low <= other["difference_p5"] <= high < 0.0


def test_both_shapers_make_the_same_moves_on_the_same_arms(make):
    """A method compared with itself differs nowhere, not in the last bit; and nineteen moves are refused."""
    job = next(make(20).jobs())
    found = measure(replace(job, methods=job.methods[:1] * 2))
    assert [row["arm"] for row in found] == ["calibrated", "hidden-4"] * 2
    assert found[:2] == found[2:]
    with pytest.raises(StudyError, match=r"only 19 of 19 moves .* at least 20 are needed"):
        make(19)
