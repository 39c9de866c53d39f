"""Identification of modes at any configuration with any payload, from a few ring-downs with one or two payloads."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_controller.api.line import modal_estimator, paper_payload
from tvist_lab.collect import collect
from tvist_lab.identification.design import choose
from tvist_lab.identification.fit import spread
from tvist_lab.identification.friction import identify_friction
from tvist_lab.identification.identify import IdentificationError
from tvist_lab.identification.modal_calibration import TOLD, ModeErrors, Origin, calibrate
from tvist_lab.identification.modal_plan import ModalPlan, check, free_configurations
from tvist_lab.identification.ring_downs import Jog, Ringing, listen, or_none
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats, RecordingError
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration, ModalParameter
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info
from tvist_protocol.values import Payload
from tvist_shaping.errors import EstimatorError

CANDIDATES = 60
"""Number of configurations to choose from."""
SPARE = 4
"""Number of ring-downs planned for each one required, since the arm cannot reach some of them."""
QUIET = 2.0
"""A ring-down whose rms is less than this times its noise contains no information [-]."""
Progress = Callable[[], None]
UNSEEN = 60
"""Number of configurations and payloads at which the truth is requested, if there is one."""


@dataclass(frozen=True)
class ModalIdentification:
    """A calibration and the data it was checked with."""

    calibration: Calibration
    ringings: tuple[Ringing, ...]
    errors: tuple[ModeErrors, ...] | None
    """Errors against the truth for configurations and payloads that were not measured, the lowest mode first; None if
    the robot does not publish it.
    """
    no_friction: str = ""
    """Why the calibration has no friction; empty if it has."""


async def identify_modal(
    robot: Robot,
    control: Arm,
    description: RobotDescription,
    plan: ModalPlan,
    *,
    name: str,
    command: str,
    progress: Progress,
) -> ModalIdentification:
    """Identify springs, drives and, where there is room for it, friction as a client.

    Args:
        robot: The robot, on a network or in process.
        control: The arm under control.
        description: Masses and geometry of the arm.
        plan: What to measure.
        name: Name of the calibration.
        command: Command line that the user typed, for the calibration's provenance.
        progress: Called after each ring-down.

    Raises:
        IdentificationError: The description belongs to another arm, or ring-downs are too few, too quiet or
            contradictory; the message says which, and what to do.
    """
    info = await robot.info()
    if info.model != description.robot.model:
        raise IdentificationError(
            f"the robot is a {info.model}, its description of a {description.robot.model}: name its file"
        )
    payloads = plan.payloads or (info.payload,)
    check(plan, len(payloads))
    await control.set_shaper("none")
    arm = ArmModes(description, payloads)
    candidates = free_configurations(description, payloads, CANDIDATES, plan)
    try:
        friction: tuple[ModalParameter, ...] = ()
        no_friction = ""
        try:
            friction = await identify_friction(robot, control, description, candidates)
        except IdentificationError as error:  # springs can be measured all the same
            no_friction = str(error)
        ringings, rejected = await _measure(robot, control, arm, candidates, plan, progress)
        origin = Origin(name, command, info.model, plan.seed, info.arm)
        calibration = calibrate(arm, ringings, origin, rejected, friction=friction)
        errors = await _against_truth(robot, control, calibration, description, plan, info)
    finally:
        if plan.payloads:
            with contextlib.suppress(ClientError, RefusedError):
                await _carry(control, info.payload)
    return ModalIdentification(calibration, tuple(ringings), errors, no_friction)


async def _measure(
    robot: Robot,
    control: Arm,
    arm: ArmModes,
    candidates: Sequence[Floats],
    plan: ModalPlan,
    progress: Progress,
) -> tuple[list[Ringing], int]:
    """Return the most informative ring-downs, and the number of others that were tried."""
    payloads = arm.payloads
    counts = [len(range(number, plan.ring_downs, len(payloads))) for number in range(len(payloads))]
    order = choose(arm, candidates, plan.jog, [SPARE * count for count in counts])
    ringings: list[Ringing] = []
    rejected = 0
    for payload, wanted in enumerate(counts):
        if plan.payloads:
            await _carry(control, plan.payloads[payload])
        found: list[Ringing] = []
        for number in (candidate for candidate, carried in order if carried == payload):
            if len(found) == wanted:
                break
            ringing = await _ringing(robot, control, candidates[number], payload, plan.jog)
            if ringing is None or ringing.rms < QUIET * ringing.noise:
                rejected += 1
                continue
            found.append(ringing)
            progress()
        ringings += found
    if len(ringings) < plan.ring_downs:
        raise IdentificationError(
            f"only {len(ringings)} of {plan.ring_downs} ring-downs could be used, {rejected} configurations were "
            "out of reach or too quiet: check that the arm moves and that its accelerometer works"
        )
    return ringings, rejected


async def _carry(control: Arm, payload: Payload) -> None:
    """Make a simulated arm carry a payload, and declare it."""
    await control.reset(payload=payload)
    await control.set_payload(payload.mass, payload.com, payload.inertia)


async def _ringing(robot: Robot, control: Arm, q: Floats, payload: int, jog: Jog) -> Ringing | None:
    """Measure the ring-down at a configuration; return None if it cannot be reached or was not received completely."""
    try:
        return await or_none(listen(robot, control, q, payload, jog))
    except RecordingError:
        return None


async def _against_truth(
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
