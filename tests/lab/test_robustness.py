"""Reduction on arms that differ from the calibration: right where nothing is wrong, and less where much is."""

from dataclasses import replace

import numpy as np
import pytest

from tvist_controller.calibrations import load as load_calibration
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.robustness import ERRORS, error_jobs, make, robustness_report, stiffer
from tvist_lab.evaluation.robustness_page import robustness_page
from tvist_lab.evaluation.standing import candidates
from tvist_lab.figures import robustness_figure
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm


@pytest.fixture(scope="module")
def ur5e():
    return load("ur5e")


@pytest.fixture(scope="module")
def done(ur5e):
    standing = candidates(
        ur5e, load_calibration("ur5e_modal"), None, ["zv_3_modes_frozen_at_end", "elastic"]
    )[1:]
    start = np.array(ur5e.poses["Q1"])
    move = Move(tuple(start), tuple(start + np.array([0.3, 0.2, 0.3, 0.0, 0.0, 0.0])), 4.0)
    jobs = [job for job in error_jobs(ur5e, standing, [move], 0) if abs(job.error) in {0.0, 0.3}]
    return standing, jobs, [make(job) for job in jobs]


def test_stiffer_springs_raise_every_frequency(ur5e):
    q = np.array(ur5e.poses["Q3"])
    plain, stiff = (FlexibleArm(one, ur5e.payload).modes(q).f_d for one in (ur5e, stiffer(ur5e, 1.3)))
    assert (stiff[:3] > plain[:3]).all()


def test_an_error_of_nothing_is_the_same_whatever_it_is_of_and_a_large_one_costs_reduction(done):
    _, jobs, found = done
    by_error = {(job.kind, job.error): one for job, one in zip(jobs, found, strict=True)}
    assert by_error["stiffness", 0.0] == by_error["payload", 0.0]
    right, soft = by_error["stiffness", 0.0].reduced, by_error["stiffness", -0.3].reduced
    assert soft["elastic"].less < right["elastic"].less
    for one in right.values():
        assert one.beyond < one.less
    assert right["elastic"].delay < right["zv_3_modes_frozen_at_end"].delay


def test_the_report_is_ordered_by_delay_and_names_what_does_not_count(done):
    standing, jobs, found = done
    rows = robustness_report(standing, jobs, found)
    assert [row["name"] for row in rows] == ["elastic", "zv_3_modes_frozen_at_end"]
    assert rows[0]["stiffness"]["-30 %"]["moves"] == 1
    assert rows[0]["stiffness"]["+5 %"] == {
        "moves": 0,
        "reduction_percent": {"median": None, "p5": None},
        "beyond_waiting_percent": {"median": None, "p5": None},
    }
    quiet = [replace(one, unshaped=0.1) for one in found]
    assert robustness_report(standing, jobs, quiet)[0]["payload"]["+0 %"]["moves"] == 0
    about = {"command": "tvist robustness", "moves": 1, "seed": 0, "shapers": rows}
    assert all(
        f"{100 * error:+.0f} %" in robustness_page(about, "a command")
        for errors in ERRORS.values()
        for error in errors
    )
    assert len(robustness_figure(rows).axes) == len(ERRORS)
