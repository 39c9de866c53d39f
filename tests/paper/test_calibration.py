"""The calibration that ships is as good as it says; polynomials as in section 3.3 of the paper."""

import msgspec
import numpy as np
import pytest

from tvist_controller.sources.calibrations import estimator_of, fits
from tvist_controller.sources.calibrations import load as load_calibration
from tvist_lab.identification.calibrate import calibrate
from tvist_lab.identification.jogs import make_jogs, plan_jogs
from tvist_lab.identification.polynomials import fit_polynomials
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.studies.paper.published import pose, published
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.calibration import calibration_from_json, calibration_to_json
from tvist_server.config import ServeConfig
from tvist_shaping import Polynomial

CALIBRATION, ROBOT = load_calibration("ur5e_5kg"), load("ur5e")


@pytest.mark.parametrize("name", ["Q1", "Q2", "Q3"])
def test_calibration_gives_table_1_at_the_papers_poses(name):
    paper = published()["configurations"][name]
    f_d, zeta = estimator_of(CALIBRATION).estimate(np.array(paper["q"]))
    assert f_d[0] == pytest.approx(paper["f_d_hz"], rel=0.05)
    assert zeta[0] == pytest.approx(paper["zeta"], rel=0.10)


def test_calibration_is_accurate_at_random_configurations():
    setup = ServeConfig().setup()
    arm = FlexibleArm(setup.description, setup.description.payload)
    estimator = estimator_of(CALIBRATION)
    errors = []
    for q in WORKSPACE.random(60, 6, seed=2024):
        modes = arm.modes(q)
        f_d, zeta = estimator.estimate(q)
        errors.append((abs(f_d[0] / modes.f_d[0] - 1.0), abs(zeta[0] / modes.zeta[0] - 1.0)))
    f_d_error, zeta_error = np.median(errors, axis=0)
    assert f_d_error < 0.05
    assert zeta_error < 0.10


def test_calibration_has_its_origin_payload_and_frequencies():
    assert CALIBRATION.provenance.command.startswith("tvist identify")
    assert CALIBRATION.provenance.configurations >= 100
    assert fits(CALIBRATION, ServeConfig().setup().payload)
    assert not fits(CALIBRATION, ServeConfig(payload=2.0).setup().payload)
    low, high = CALIBRATION.provenance.measured_f_d_range
    assert low == pytest.approx(6.5, rel=0.05)
    assert high > 15.0


@pytest.mark.nightly
async def test_small_identification_is_near_the_truth():
    setup = free_setup(calibration="none", seed=11)
    async with robot_in_process(setup) as robot, robot.control("test") as arm:
        jogs = await make_jogs(robot, arm, await plan_jogs(robot, ROBOT, 120, seed=11), lambda _: None)
    found = calibrate(ROBOT, jogs, name="test", command="a test", progress=lambda _: None)
    calibration = found.calibration
    assert found.no_polynomial == ""
    assert calibration.provenance.cross_validated_f_d_percent.median < 8.0
    again = calibration_from_json(calibration_to_json(calibration))
    assert again == calibration
    estimator = estimator_of(again)
    for name, f_d in (("Q1", 6.73), ("Q3", 14.93)):
        assert estimator.estimate(np.array(pose(name)))[0][0] == pytest.approx(f_d, rel=0.1)


def test_polynomials_in_the_basis_are_found_exactly():
    rng = np.random.default_rng(1)
    q = rng.uniform(-np.pi, np.pi, (80, 6))
    f_d = 10.0 + np.cos(q[:, 1]) - 2.0 * np.sin(q[:, 1] + q[:, 2])
    zeta = 0.2 + 0.05 * np.cos(2.0 * q[:, 3])
    found, deviations = fit_polynomials(q, f_d, zeta, joints=(1, 2, 3), degree=2)
    assert deviations["cross_validated_f_d_percent"].p90 < 1e-6
    model = msgspec.structs.asdict(found)
    given = {name: value for name, value in model.items() if name not in ("basis", "scale")}
    estimated = Polynomial(**given).estimate(q[0])
    assert estimated[0][0] == pytest.approx(f_d[0], rel=1e-9)
