"""Measure, for any arm alike, how accurately it is identified and how much vibration is suppressed."""

import asyncio
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import numpy as np
import pinocchio as pin

from tvist_controller.api.line import Setup, paper_payload
from tvist_lab.identification.calibrate import calibrate, true_errors
from tvist_lab.identification.design import free_configurations
from tvist_lab.identification.jogs import make_jogs, plan_jogs
from tvist_lab.in_process import robot_in_process
from tvist_lab.studies.moves import study
from tvist_lab.study.catalogue import some
from tvist_lab.study.engine import run
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.request import StudyRequest
from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import rigid_model
from tvist_plant.variants import stiffer
from tvist_protocol.calibration import Calibration

PLACES = 40  # number of random configurations at which the sag is compared
ALONE = 4  # smallest number of joints with which `auto` can be used, since it suppresses four modes
TWIST = 1e-7  # twist below which gravity loads no gear [rad]


def measure(
    description: RobotDescription,
    calibration: Calibration | None,
    *,
    stiffness: float = 1.0,
    moves: int,
    seed: int,
    progress: Callable[[int], None] = lambda _: None,
) -> dict[str, Any]:
    """Measure an arm with gears and links `stiffness` times as stiff, by random `moves` with its payload.

    Without a calibration, the arm is identified first. Returns the factor `stiffness`; `calibration`, its
    name or "identified"; `f_d_error_percent`, the median error of each mode; the numbers of `moves`, of moves
    for which the drives are `too_weak`, and of moves `counted` since they vibrate enough; `reduction_percent`
    of the peak by `auto`; the median `delay_ms`; and `sag_error_percent`, see `sag_error`.
    """
    arm = description if stiffness == 1.0 else stiffer(stiffness, description)
    known = asyncio.run(_identified(arm, seed)) if calibration is None else calibration
    mass = arm.payload.mass
    drawn = draw_moves(arm, moves, seed, (mass, mass)).moves
    asked = StudyRequest(description=arm, moves=drawn, methods=some(["auto"], arm, known), named=1, seed=seed)
    wanted = study(asked)
    weak = len(drawn) - len(wanted.cases)
    progress(weak)
    summary = wanted.summary(run(wanted, progress=lambda _: nullcontext(progress)).rows)[0]
    return {
        "stiffness": stiffness,
        "calibration": "identified" if calibration is None else known.name,
        "f_d_error_percent": [one.f_d.median for one in true_errors(arm, known, (paper_payload(arm),), seed)],
        "moves": len(wanted.cases),
        "too_weak": weak,
        "counted": summary["counted"],
        "reduction_percent": {key: summary[f"reduction_percent_{key}"] for key in ("median", "p5", "min")},
        "delay_ms": summary["delay_ms_median"],
        "sag_error_percent": sag_error(arm, seed),
    }


async def _identified(arm: RobotDescription, seed: int) -> Calibration:
    """Identify an arm in this process, like `tvist identify` by default."""
    carried = tuple(paper_payload(arm, mass) for mass in (0.0, arm.payload.mass))
    setup = Setup(
        description=arm,
        q=next(iter(arm.poses.values())),
        payload=paper_payload(arm),
        calibration=None,
        seed=seed,
        clock="free",
        truth=False,
    )
    async with robot_in_process(setup) as robot, robot.control("robots") as control:
        plan = await plan_jogs(robot, arm, payloads=carried, seed=seed)
        measured = await make_jogs(robot, control, plan, lambda _: None)
    found = calibrate(arm, measured, name="identified", command="tvist robots", progress=lambda _: None)
    return found.calibration


def sag_error(arm: RobotDescription, seed: int) -> float:
    """Compare gear twist at rest with g(q)/K at random configurations.

    Returns the largest difference relative to the largest twist in the pose [%]; 0 if gravity loads no joint.
    """
    plant, rigid = FlexibleArm(arm.clean(), arm.payload), rigid_model(arm, arm.payload)
    data, stiffness = rigid.createData(), np.array(arm.drives.gear_stiffness)
    zero, worst = np.zeros(arm.joints), 0.0
    for q in free_configurations(arm, (paper_payload(arm),), PLACES, seed):
        plant.reset(DriveCommand(q, zero, zero), seed=0)
        expected = -pin.computeGeneralizedGravity(rigid, data, q) / stiffness
        largest = float(np.abs(expected).max())
        if largest > TWIST:
            worst = max(worst, float(np.abs(plant.truth().gear_deflection - expected).max()) / largest)
    return 100.0 * worst
