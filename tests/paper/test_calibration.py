"""The calibration that ships: made by `tvist identify`, and as good as it says."""

import numpy as np
import pytest

from tvist_controller.sources.calibrations import estimator_of, fits, load
from tvist_lab.studies.paper.published import published
from tvist_lab.workspace import WORKSPACE
from tvist_plant.flexible_arm import FlexibleArm
from tvist_server.config import ServeConfig


@pytest.fixture(scope="module")
def calibration():
    return load("ur5e_5kg")


@pytest.mark.parametrize("name", ["Q1", "Q2", "Q3"])
def test_it_has_table_1_at_the_papers_poses(calibration, name):
    paper = published()["configurations"][name]
    f_d, zeta = estimator_of(calibration).estimate(np.array(paper["q"]))
    assert f_d[0] == pytest.approx(paper["f_d_hz"], rel=0.05)
    assert zeta[0] == pytest.approx(paper["zeta"], rel=0.10)


def test_it_is_right_at_the_median_of_random_configurations_it_never_saw(calibration):
    setup = ServeConfig().setup()
    arm = FlexibleArm(setup.description, setup.description.payload)
    estimator = estimator_of(calibration)
    errors = []
    for q in WORKSPACE.random(300, 6, seed=2024):
        modes = arm.modes(q)
        f_d, zeta = estimator.estimate(q)
        errors.append((abs(f_d[0] / modes.f_d[0] - 1.0), abs(zeta[0] / modes.zeta[0] - 1.0)))
    f_d_error, zeta_error = np.median(errors, axis=0)
    assert f_d_error < 0.05
    assert zeta_error < 0.10


def test_it_says_how_it_was_made_and_fits_the_payload_it_was_made_with(calibration):
    assert calibration.provenance.command.startswith("tvist identify")
    assert calibration.provenance.configurations >= 100
    assert fits(calibration, ServeConfig().setup().payload)
    assert not fits(calibration, ServeConfig(payload=2.0).setup().payload)


def test_it_spans_the_frequencies_of_the_workspace(calibration):
    low, high = calibration.provenance.measured_f_d_range
    assert low == pytest.approx(6.5, rel=0.05)
    assert high > 15.0
