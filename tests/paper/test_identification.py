"""Polynomials as in section 3.3 of the paper: from ring-downs all over the workspace."""

import asyncio

import msgspec
import numpy as np
import pytest

from tvist_controller.sources.calibrations import estimator_of
from tvist_lab.identification.calibrate import calibrate
from tvist_lab.identification.jogs import make_jogs, plan_jogs
from tvist_lab.identification.polynomials import fit_polynomials
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.studies.paper.published import pose
from tvist_plant.description import load
from tvist_protocol.calibration import calibration_from_json, calibration_to_json

ROBOT = load("ur5e")


@pytest.mark.nightly
def test_a_small_identification_with_another_seed_is_already_near_the_truth():
    async def run():
        setup = free_setup(calibration="none", seed=11)
        async with robot_in_process(setup) as robot, robot.control("test") as arm:
            plan = await plan_jogs(robot, ROBOT, 160, seed=11)
            return await make_jogs(robot, arm, plan, lambda _: None)

    found = calibrate(ROBOT, asyncio.run(run()), name="test", command="a test", progress=lambda _: None)
    calibration = found.calibration
    assert found.no_polynomial == ""
    assert calibration.provenance.cross_validated_f_d_percent.median < 8.0
    again = calibration_from_json(calibration_to_json(calibration))
    assert again == calibration
    estimator = estimator_of(again)
    for name, f_d in (("Q1", 6.73), ("Q3", 14.93)):
        assert estimator.estimate(np.array(pose(name)))[0][0] == pytest.approx(f_d, rel=0.1)


def test_polynomials_that_are_in_the_basis_are_found_exactly():
    rng = np.random.default_rng(1)
    q = rng.uniform(-np.pi, np.pi, (80, 6))
    f_d = 10.0 + np.cos(q[:, 1]) - 2.0 * np.sin(q[:, 1] + q[:, 2])
    zeta = 0.2 + 0.05 * np.cos(2.0 * q[:, 3])
    fit = fit_polynomials(q, f_d, zeta, joints=(1, 2, 3), degree=2)
    assert fit.cross_validated_f_d.p90 < 1e-6
    model = msgspec.structs.asdict(fit.model)
    from tvist_shaping import Polynomial

    given = {name: value for name, value in model.items() if name not in ("basis", "scale")}
    estimated = Polynomial(**given).estimate(q[0])
    assert estimated[0][0] == pytest.approx(f_d[0], rel=1e-9)
