"""Comparison of a modal calibration with the truth of a simulated arm, away from the measurements."""

from dataclasses import replace

import numpy as np

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_controller.api.line import modal_estimator, paper_payload
from tvist_lab.collect import collect
from tvist_lab.identification.fit import spread
from tvist_lab.identification.modal_calibration import TOLD, ModeErrors
from tvist_lab.identification.modal_plan import ModalPlan, free_configurations
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_protocol.info import Info
from tvist_shaping.errors import EstimatorError

UNSEEN = 60
"""Number of configurations and payloads at which the truth is requested, if there is one."""


async def against_truth(
    robot: Robot,
    control: Arm,
    calibration: Calibration,
    description: RobotDescription,
    plan: ModalPlan,
    info: Info,
) -> tuple[ModeErrors, ...] | None:
    """Errors at random configurations that were not measured; None if the robot does not publish the truth.

    If the arm was made to carry several payloads, the payloads are random, too; otherwise the declared one is used.
    """
    with collect(robot) as collected:
        start = (await robot.state()).target_q
        await robot.advance(2)
    if not collected.truths:
        return None
    rng = np.random.default_rng(plan.seed + 1)
    places = free_configurations(
        description,
        (paper_payload(description, description.limits.payload),),
        UNSEEN,
        replace(plan, seed=plan.seed + 1),
    )
    pairs = []
    for q in places:
        payload = info.payload
        if plan.payloads:
            payload = paper_payload(description, float(rng.uniform(0.0, description.limits.payload)))
        with collect(robot) as collected:
            await control.reset(q=q, payload=payload if plan.payloads else None)
            await robot.advance(1)
        truth = collected.truths[-1]
        try:
            f_d, zeta = modal_estimator(calibration, description, payload, TOLD).estimate(q)
        except EstimatorError:
            continue
        pairs.append((f_d, truth.f_d[:TOLD], zeta, truth.zeta[:TOLD]))
    await control.reset(q=start)
    f_d, true_f_d, zeta, true_zeta = np.array(pairs).transpose(1, 2, 0)
    return tuple(ModeErrors(spread(f_d[k], true_f_d[k]), spread(zeta[k], true_zeta[k])) for k in range(TOLD))
