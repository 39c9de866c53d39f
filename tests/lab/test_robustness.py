"""Reduction on arms that differ from the calibration: right where nothing is wrong, and less where much is."""

import numpy as np
import pytest
from tools.tables.pages import page_of

from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.figures import robustness_figure
from tvist_lab.studies.robustness import ERRORS, PLANT, columns, jobs, report
from tvist_lab.study.arms import PERTURBED, stiffer
from tvist_lab.study.case import Case
from tvist_lab.study.catalogue import bench
from tvist_lab.study.held_out import JUDGING, LEAST, TUNING, median_and_p5, said
from tvist_lab.study.method import Task
from tvist_lab.study.moves import Move
from tvist_lab.study.work import measure
from tvist_plant.flexible_arm import FlexibleArm


@pytest.fixture(scope="module")
def done(ur5e):
    methods = bench(ur5e, load_calibration("ur5e_modal"), None, ["zv_3_modes_frozen_at_end", "elastic"])[1:]
    start = np.array(ur5e.poses["Q1"])
    move = Move(tuple(start), tuple(start + np.array([0.3, 0.2, 0.3, 0.0, 0.0, 0.0])), 4.0)
    return methods, [row for job in jobs(ur5e, methods, [move], 0) for row in measure(job)]


def test_stiffer_springs_raise_every_frequency(ur5e):
    q = np.array(ur5e.poses["Q3"])
    plain, stiff = (FlexibleArm(one, ur5e.payload).modes(q).f_d for one in (ur5e, stiffer(ur5e, 1.3)))
    assert (stiff[:3] > plain[:3]).all()


def test_an_error_of_nothing_is_the_same_whatever_it_is_of_and_a_large_one_costs_reduction(done):
    methods, rows = done
    entries = {one["name"]: one for one in report(methods, rows)}
    for one in entries.values():
        right = one["stiffness"]["+0 %"]
        assert right == one["payload"]["+0 %"]
        assert right["beyond_waiting_percent"]["median"] < right["reduction_percent"]["median"]
    elastic = entries["elastic"]
    less = [elastic["stiffness"][error]["reduction_percent"]["median"] for error in ("-30 %", "+0 %")]
    assert less[0] < less[1]
    assert elastic["delay_ms"] < entries["zv_3_modes_frozen_at_end"]["delay_ms"]


def test_the_report_is_ordered_by_delay_and_names_what_does_not_count(done):
    methods, rows = done
    entries = report(methods, rows)
    assert [one["name"] for one in entries] == ["elastic", "zv_3_modes_frozen_at_end"]
    assert entries[0]["stiffness"]["-30 %"]["moves"] == 1
    assert entries[0][PLANT]["combined"]["reduction_percent"]["p5"] is None  # of one move
    quiet = [row | {"unshaped_peak_m_s2": 0.1} for row in rows]
    assert report(methods, quiet)[0]["payload"]["+0 %"] == {
        "moves": 0,
        "reduction_percent": {"median": None, "p5": None},
        "reduction_percent_interval": {"median": None, "p5": None},
        "beyond_waiting_percent": {"median": None, "p5": None},
    }
    result = {"moves": 1, "seed": 0, "robot": "UR5e", "hidden": [], "shapers": entries}
    written = page_of("robustness", result)
    assert all(f"{100 * error:+.0f} %" in written for errors in ERRORS.values() for error in errors)
    assert all(f"| {name} |" in written for name in PERTURBED)
    assert "these moves are not held out" in written
    assert len(robustness_figure(entries).axes) == len(ERRORS)


def test_a_hidden_robot_is_one_more_plant_whose_seed_stands_in_its_name(ur5e):
    assert list(columns((7,))[PLANT]) == [*PERTURBED, "hidden-7"]
    start = tuple(ur5e.poses["Q1"])
    arms = {one.name for job in jobs(ur5e, [], [Move(start, start, 1.0)], 0, (7,)) for one in job.case.arms}
    assert "hidden-7" in arms


def test_few_moves_have_no_5th_percentile_and_no_published_seed_is_for_tuning():
    values = list(range(LEAST))
    assert median_and_p5(values)["p5"] == pytest.approx(0.95)
    assert median_and_p5(values[1:]) == {"median": 10.0, "p5": None}
    assert not set(JUDGING.values()).intersection(TUNING)
    assert "Nothing is tuned on seed 20261123" in said(JUDGING["robustness"])


def test_the_smoothing_of_elastic_alone_is_its_reference_without_its_feed_forward(ur5e):
    start = np.array(ur5e.poses["Q1"])
    move = Move(tuple(start), tuple(start + np.array([0.3, 0.2, 0.3, 0.0, 0.0, 0.0])), 4.0)
    names = ["smoothing", "elastic"]
    alone, elastic = bench(ur5e, load_calibration("ur5e_modal"), None, names)[1:]
    task = Task(ur5e, move, Case(ur5e, move).reference())
    np.testing.assert_array_equal(alone.shaped(task).q, elastic.shaped(task).q)
    assert alone.shaped(task).elastic is None
    assert elastic.shaped(task).elastic is not None
