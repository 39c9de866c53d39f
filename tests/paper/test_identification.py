"""Identification as a client: ring-downs all over the workspace to a calibration."""

import asyncio

import msgspec
import numpy as np
import pytest

from tvist_controller.sources.calibrations import estimator_of
from tvist_lab.identification.fit import FitError, fit_polynomials
from tvist_lab.identification.identify import MeasurementPlan, identify
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.studies.paper.published import pose
from tvist_protocol.calibration import calibration_from_json, calibration_to_json


def measured(plan: MeasurementPlan):
    async def run():
        setup = free_setup(calibration="none", seed=plan.seed)
        async with robot_in_process(setup) as robot, robot.control("test") as arm:
            return await identify(robot, arm, plan, name="test", command="a test", progress=lambda: None)

    return asyncio.run(run())


@pytest.mark.nightly
def test_a_small_identification_with_another_seed_is_already_near_the_truth():
    plan = MeasurementPlan(configurations=45, anchors=(pose("Q1"), pose("Q3")), repeats=2, seed=11)
    done = measured(plan)
    assert done.true_f_d is not None
    assert done.error_f_d.median < 8.0
    for row in done.poses():
        assert row["estimated_f_d_hz"] == pytest.approx(row["f_d_hz"], rel=0.08)
    at_q1, at_q3 = done.poses()
    assert at_q1["f_d_hz"] == pytest.approx(6.73, rel=0.05)
    assert at_q3["f_d_hz"] == pytest.approx(14.93, rel=0.05)
    again = calibration_from_json(calibration_to_json(done.calibration))
    assert again == done.calibration
    estimator_of(again)


def test_too_few_configurations_are_refused_before_the_arm_moves():
    with pytest.raises(FitError, match="at least 38 are needed"):
        measured(MeasurementPlan(configurations=10))


def test_polynomials_that_are_in_the_basis_are_found_exactly():
    rng = np.random.default_rng(1)
    q = rng.uniform(-np.pi, np.pi, (80, 6))
    f_d = 10.0 + np.cos(q[:, 1]) - 2.0 * np.sin(q[:, 1] + q[:, 2])
    zeta = 0.2 + 0.05 * np.cos(2.0 * q[:, 3])
    fit = fit_polynomials(q, f_d, zeta, np.ones(80), joints=(1, 2, 3), degree=2)
    assert fit.cross_validated_f_d.p90 < 1e-6
    model = msgspec.structs.asdict(fit.model)
    from tvist_shaping import Polynomial

    given = {name: value for name, value in model.items() if name not in ("basis", "scale")}
    estimated = Polynomial(**given).estimate(q[0])
    assert estimated[0][0] == pytest.approx(f_d[0], rel=1e-9)
