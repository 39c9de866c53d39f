"""Reduction on arms that differ from the calibration: right where nothing is wrong, and less where much is."""

import numpy as np
import pytest

from tvist_controller.calibrations import load as load_calibration
from tvist_lab.figures import robustness_figure
from tvist_lab.studies.pages import page
from tvist_lab.studies.robustness import ERRORS, jobs, report, tables
from tvist_lab.study.arms import stiffer
from tvist_lab.study.catalogue import bench
from tvist_lab.study.moves import Move
from tvist_lab.study.work import measure
from tvist_plant.flexible_arm import FlexibleArm


@pytest.fixture(scope="module")
def done(ur5e):
    methods = bench(ur5e, load_calibration("ur5e_modal"), None, ["zv_3_modes_frozen_at_end", "elastic"])[1:]
    start = np.array(ur5e.poses["Q1"])
    move = Move(tuple(start), tuple(start + np.array([0.3, 0.2, 0.3, 0.0, 0.0, 0.0])), 4.0)
    some = [job for job in jobs(ur5e, methods, [move], 0) if abs(job.case.axes["error"]) in {0.0, 0.3}]
    return methods, [row for job in some for row in measure(job)]


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
    assert entries[0]["stiffness"]["+5 %"] == {
        "moves": 0,
        "reduction_percent": {"median": None, "p5": None},
        "beyond_waiting_percent": {"median": None, "p5": None},
    }
    quiet = [row | {"unshaped_peak_m_s2": 0.1} for row in rows]
    assert report(methods, quiet)[0]["payload"]["+0 %"]["moves"] == 0
    about = {"moves": 1, "seed": 0, "shapers": entries}
    written = page("robustness", about, "a command", tables=tables())
    assert all(f"{100 * error:+.0f} %" in written for errors in ERRORS.values() for error in errors)
    assert len(robustness_figure(entries).axes) == len(ERRORS)
