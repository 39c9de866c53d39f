"""From a few ring-downs with one or two payloads to modes at any configuration with any payload."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_lab.identification.design import choose
from tvist_lab.identification.identify import IdentificationError
from tvist_lab.identification.modal_calibration import ModeErrors, calibrate
from tvist_lab.identification.modal_plan import ModalPlan, check, free_configurations
from tvist_lab.identification.modal_truth import against_truth
from tvist_lab.identification.ring_downs import Jog, Ringing, listen
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats, RecordingError
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_protocol.errors import RefusedError
from tvist_protocol.values import Payload

CANDIDATES = 60
"""Configurations that are looked at, to choose from."""
SPARE = 4
"""Ring-downs that are planned for each that is wanted: some the arm cannot reach."""
QUIET = 2.0
"""A ring-down whose rms is less than this times its noise says nothing [-]."""
Progress = Callable[[], None]


@dataclass(frozen=True)
class ModalIdentification:
    """A calibration and what it was checked against."""

    calibration: Calibration
    ringings: tuple[Ringing, ...]
    errors: tuple[ModeErrors, ...] | None
    """Against the truth at configurations and with payloads that were not measured, the lowest mode first; None where
    the robot does not tell it."""


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
    """Identify springs and drives as a client.

    Args:
        robot: The robot, on a network or in process.
        control: The arm under control.
        description: Its masses and geometry.
        plan: What to measure.
        name: Name of the calibration.
        command: What the user typed, for the calibration's provenance.
        progress: Told of each ring-down done.

    Raises:
        IdentificationError: The description is of another arm, ring-downs are too few, too quiet or contradict each
            other; the sentence says which, and what to do.
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
        ringings, rejected = await _measure(robot, control, arm, candidates, plan, progress)
        calibration = calibrate(arm, ringings, info, plan, rejected, name=name, command=command)
        errors = await against_truth(robot, control, calibration, description, plan, info)
    finally:
        if plan.payloads:
            with contextlib.suppress(ClientError, RefusedError):
                await _carry(control, info.payload)
    return ModalIdentification(calibration, tuple(ringings), errors)


async def _measure(
    robot: Robot,
    control: Arm,
    arm: ArmModes,
    candidates: Sequence[Floats],
    plan: ModalPlan,
    progress: Progress,
) -> tuple[list[Ringing], int]:
    """The ring-downs that say most, and how many more were tried."""
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
    """Have a simulated arm carry something, and say so."""
    await control.reset(payload=payload)
    await control.set_payload(payload.mass, payload.com, payload.inertia)


async def _ringing(robot: Robot, control: Arm, q: Floats, payload: int, jog: Jog) -> Ringing | None:
    """What rings at a configuration; None where it cannot be reached or was not heard whole."""
    try:
        return await listen(robot, control, q, payload, jog)
    except RecordingError:
        return None
    except RefusedError as error:
        if error.reply.code != "collision":
            raise
        return None
