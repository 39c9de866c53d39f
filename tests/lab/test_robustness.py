"""Reduction on arms that differ from the calibration: right where nothing is wrong, and less where much is."""

import numpy as np
import polars as pl
import pytest
from tools.tables.pages import FINE, page_of

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.report import study_figures
from tvist_lab.studies.robustness import ERRORS, PLANT, cells, errors, study
from tvist_lab.study.arms import PERTURBED
from tvist_lab.study.case import Case
from tvist_lab.study.catalogue import some
from tvist_lab.study.columns import p5
from tvist_lab.study.held_out import JUDGING, MIN_MOVES, TUNING, said
from tvist_lab.study.method import Task
from tvist_lab.study.moves import Move
from tvist_lab.study.request import StudyRequest
from tvist_lab.study.work import measure
from tvist_plant.variants import hidden_variant


def asked(ur5e, *names, **more):
    methods = some(names, ur5e, load_calibration("ur5e_modal"))
    start = np.array(ur5e.poses["Q1"])
    move = Move(tuple(start), tuple(start + np.array([0.3, 0.2, 0.3, 0.0, 0.0, 0.0])), 4.0)
    facts = {"seed": 0, "moves_made": 1, "robot": "ur5e"}
    return StudyRequest(
        description=ur5e, moves=[move], methods=methods, named=len(methods), facts=facts, **more
    )


@pytest.fixture(scope="module")
def made(ur5e):
    return study(asked(ur5e, "zv_3_modes_frozen_at_end", "elastic"))


@pytest.fixture(scope="module")
def rows(made):
    return made.frame([row for job in made.jobs() for row in measure(job)])


def test_large_frequency_error_costs_reduction(made, rows):
    values = made.result(rows, {}).values
    found = {
        kind: {(one["shaper"], one["error"]): one for one in those} for kind, those in cells(values).items()
    }
    for one in values["summary"]:
        right = found["stiffness"][one["shaper"], "+0 %"]
        assert right == found["payload"][one["shaper"], "+0 %"]
        assert right["beyond_waiting_percent_median"] < right["reduction_percent_median"]
    wrong, right = (found["stiffness"]["elastic", error] for error in ("-30 %", "+0 %"))
    assert wrong["reduction_percent_median"] < right["reduction_percent_median"]


def test_report_is_ordered_by_delay_and_lists_omissions(made, rows):
    result = made.result(rows, {})
    assert [one["shaper"] for one in result.values["summary"]] == ["elastic", "zv_3_modes_frozen_at_end"]
    first = cells(result.values)["stiffness"][0]
    assert (first["error"], first["counted"]) == ("-30 %", 1)
    assert first["reduction_percent_p5"] is None  # of one move
    quiet = made.result(rows.with_columns(reduction_percent=pl.lit(None, pl.Float64)), {}).values["cells"][0]
    assert quiet["counted"] == 0
    for name in ("reduction_percent", "beyond_waiting_percent"):
        assert quiet[f"{name}_median"] is quiet[f"{name}_p5"] is None
    written = page_of("robustness", result.values)
    named = {f"{100 * error:+.0f} %" for errors in ERRORS.values() for error in errors}
    assert all(name in written for name in named - {*FINE})
    assert all(f"| {name} |" in written for name in PERTURBED)
    assert "these moves are not held out" in written
    assert len(study_figures(result)["robustness"][0].axes) == len(ERRORS)


def test_hidden_robot_is_a_plant_with_its_seed_in_its_name(ur5e):
    assert list(errors([hidden_variant(7)])[PLANT]) == [*PERTURBED, "hidden-7"]
    wanted = study(asked(ur5e, "zv", arms=[hidden_variant(7)]))
    assert "hidden-7" in {one.name for case in wanted.cases for one in case.arms}


def test_few_moves_give_no_5th_percentile_and_seeds_are_held_out():
    values = pl.DataFrame({"x": [float(one) for one in range(MIN_MOVES)]})
    assert values.select(p5("x", MIN_MOVES)).item() == pytest.approx(0.95)
    assert values[1:].select(p5("x", MIN_MOVES)).item() is None
    assert not set(JUDGING.values()).intersection(TUNING)
    assert "Nothing is tuned on seed 20261123" in said(JUDGING["robustness"])


def test_smoothing_uses_the_elastic_shapers_path_without_feed_forward(ur5e):
    wanted = asked(ur5e, "smoothing", "elastic")
    task = Task(ur5e, wanted.moves[0], Case(ur5e, wanted.moves[0]).reference())
    alone, elastic = (method.shaped(task) for method in wanted.methods)
    np.testing.assert_array_equal(alone.q, elastic.q)
    assert alone.elastic is None
    assert elastic.elastic is not None
