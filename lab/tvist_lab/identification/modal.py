"""From a few ring-downs with one or two payloads to modes at any configuration with any payload."""

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version

import numpy as np

from tvist_client.arm import Arm
from tvist_client.errors import ClientError
from tvist_client.robot import Robot
from tvist_controller.calibrations.modal import modal_estimator
from tvist_controller.collision import CollisionModel
from tvist_controller.setup import body, paper_payload
from tvist_lab.collect import collect
from tvist_lab.identification.design import choose
from tvist_lab.identification.fit import spread
from tvist_lab.identification.identify import IdentificationError
from tvist_lab.identification.modal_fit import (
    MODES,
    ModalFit,
    OwnPoles,
    describe,
    fit_from_many,
    fit_modal,
    own_poles,
)
from tvist_lab.identification.ring_downs import Jog, Ringing, listen
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats, RecordingError
from tvist_lab.workspace import IDENTIFIED
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration, ModalModel, Provenance, RingDownFit, Spread
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info
from tvist_protocol.values import Payload
from tvist_shaping.errors import EstimatorError

RING_DOWNS = 12
LEAST = 4
"""Ring-downs below which the model is little more than its guesses."""
CANDIDATES = 60
"""Configurations that are looked at, to choose from."""
SPARE = 4
"""Ring-downs that are planned for each that is wanted: some the arm cannot reach."""
QUIET = 2.0
"""A ring-down whose rms is less than this times its noise says nothing [-]."""
CONTRADICTION = 0.2
"""Share of a ring-down that its own poles explain and the others' do not, from which on it contradicts them ... [-]"""
SIGNIFICANT = 60.0
"""... where noise alone does not make that; see `OwnPoles.significance` [-]."""
SUSPECTS = 3
"""Ring-downs that are left out for a trial."""
GUILTY = 3
"""More than one in so many, and it cannot be said which are wrong."""
TOLD = 3
"""Modes whose errors are told."""
CERTAIN = (0.05, 0.2)
"""Deviation of a ring-down's own f_d and ζ up to which a model is judged by them [-]."""
UNSEEN = 60
"""Configurations and payloads at which the truth is asked for, where there is one."""
WORKSPACE = 200
"""Configurations in which the range of the modes is looked for."""
MARGIN = 0.85
"""Margin on the lowest frequency found over the workspace, and on the distance to the highest damping ratio [-]."""

Progress = Callable[[], None]


@dataclass(frozen=True)
class ModalPlan:
    """What to measure."""

    ring_downs: int = RING_DOWNS
    """In all, the same number with each payload, one more where it does not divide."""
    payloads: tuple[Payload, ...] = ()
    """Carried one after the other by a simulated arm; none: what it carries, which is what is declared."""
    seed: int = 0
    """Seed of the candidates."""
    jog: Jog = field(default_factory=Jog)


@dataclass(frozen=True)
class ModeErrors:
    """Errors of one mode [%]."""

    f_d: Spread
    zeta: Spread


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
        errors = await _against_truth(robot, control, calibration, description, plan, info)
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


def check(plan: ModalPlan, payloads: int) -> None:
    """Check that there are enough ring-downs, before the arm moves.

    Raises:
        IdentificationError: There are not.
    """
    least = max(LEAST, payloads)
    if plan.ring_downs < least:
        raise IdentificationError(
            f"{plan.ring_downs} ring-downs with {payloads} payloads are too few for springs and drives: "
            f"at least {least} are needed, 12 are recommended"
        )


def free_configurations(
    description: RobotDescription, payloads: Sequence[Payload], count: int, plan: ModalPlan
) -> list[Floats]:
    """Configurations in which the arm meets nothing, at either end of the jog, whatever it carries."""
    joints = description.joints
    models = [CollisionModel(description, body(payload)) for payload in payloads]
    jog = plan.jog.of(joints)
    found: list[Floats] = []
    for q in IDENTIFIED.spread(20 * count, joints, plan.seed):
        if len(found) == count:
            break
        if all(model.meeting(end) is None for model in models for end in (q, q - jog)):
            found.append(q)
    return found


def calibrate(
    arm: ArmModes,
    ringings: Sequence[Ringing],
    info: Info,
    plan: ModalPlan,
    rejected: int,
    *,
    name: str,
    command: str,
) -> Calibration:
    """Fit, judge and put down.

    Raises:
        IdentificationError: The ring-downs contradict each other.
    """
    _check_contradictions(arm, ringings, fit_modal(arm, ringings))
    fit = fit_from_many(arm, ringings)
    unseen = _cross_validate(arm, ringings, fit)
    first = np.array(
        [np.ravel(describe(fit.drivetrain.poles(arm.mass(r.q, r.payload))[0][:1])) for r in ringings]
    )
    noise = float(np.sqrt(np.mean([r.noise**2 for r in ringings])))
    f_d_min, zeta_max = _range(arm, fit, info.limits.payload)
    model = ModalModel(
        parameters=arm.parameters(fit.logarithms, fit.deviations),
        f_d_min=f_d_min,
        zeta_max=zeta_max,
        payloads=arm.payloads,
        ring_downs=tuple(
            RingDownFit(q=tuple(r.q.tolist()), payload=r.payload, rms=r.rms, residual_to_noise=float(ratio))
            for r, ratio in zip(ringings, fit.residual_to_noise, strict=True)
        ),
        noise=noise,
        residual_to_noise=float(np.sqrt(np.mean(fit.residual_to_noise**2))),
        cross_validated_f_d_percent=tuple(None if mode is None else mode.f_d for mode in unseen),
        cross_validated_zeta_percent=tuple(None if mode is None else mode.zeta for mode in unseen),
    )
    (low_f, low_z), (high_f, high_z) = first.min(axis=0).tolist(), first.max(axis=0).tolist()
    return Calibration(
        name=name,
        robot=info.model,
        payload=max(arm.payloads, key=lambda payload: payload.mass),
        modal=model,
        provenance=Provenance(
            command=command,
            version=version("tvist"),
            seed=plan.seed,
            configurations=len({r.q.tobytes() for r in ringings}),
            ring_downs=len(ringings),
            rejected=rejected,
            measured_f_d_range=(low_f, high_f),
            measured_zeta_range=(low_z, high_z),
            arm=info.arm,
        ),
    )


def _check_contradictions(arm: ArmModes, ringings: Sequence[Ringing], fit: ModalFit) -> None:
    """Find what no springs and drives can explain together.

    A ring-down that is wrong spoils the fit of the others, too. So of those that are explained worst the one is left
    out without which the rest fits best, until all that is left agrees.
    """
    rest = list(range(len(ringings)))
    guilty: list[int] = []
    while len(guilty) <= len(ringings) // GUILTY:
        explained = {number: _own(arm, ringings[number], fit) for number in rest}
        worst = sorted(rest, key=lambda number: -explained[number].share)[:SUSPECTS]
        if all(own.share < CONTRADICTION or own.significance < SIGNIFICANT for own in explained.values()):
            break
        without = {
            number: fit_modal(arm, [ringings[other] for other in rest if other != number], fit.logarithms)
            for number in worst
        }
        removed = min(worst, key=lambda number: without[number].cost)
        guilty.append(removed)
        rest.remove(removed)
        fit = without[removed]
    else:
        raise IdentificationError(
            f"the {len(ringings)} ring-downs contradict each other: no springs and drives explain them together. Was "
            "the payload the declared one each time, is the robot the one of the file, and did nothing shake it?"
        )
    if guilty:
        names = "; ".join(
            f"number {number + 1} with {arm.payloads[ringings[number].payload].mass:g} kg at q = "
            f"{ringings[number].q.round(2).tolist()}"
            for number in sorted(guilty)
        )
        raise IdentificationError(
            f"ring-downs that contradict the other {len(rest)}: {names}. Was the payload the declared one, and was "
            "the arm free? Check this and measure again, or use another seed for other configurations"
        )


def _own(arm: ArmModes, ringing: Ringing, fit: ModalFit) -> OwnPoles:
    """A ring-down's own poles beside those of a fit."""
    return own_poles(arm, ringing, fit.drivetrain.poles(arm.mass(ringing.q, ringing.payload))[0][:MODES])


def _cross_validate(arm: ArmModes, ringings: Sequence[Ringing], fit: ModalFit) -> list[ModeErrors | None]:
    """Errors of each mode by fits that did not see a configuration, where its own ring-down is certain enough."""
    pairs: list[list[tuple[float, float, float, float]]] = [[] for _ in range(TOLD)]
    for place in {r.q.tobytes() for r in ringings}:
        others = [r for r in ringings if r.q.tobytes() != place]
        unseen = fit_modal(arm, others, fit.logarithms)
        for ringing in (r for r in ringings if r.q.tobytes() == place):
            f_d, zeta = describe(unseen.drivetrain.poles(arm.mass(ringing.q, ringing.payload))[0][:MODES])
            own = _own(arm, ringing, unseen)
            for mode in range(TOLD):
                if own.f_d_error[mode] < CERTAIN[0] and own.zeta_error[mode] < CERTAIN[1]:
                    pairs[mode].append((f_d[mode], own.f_d[mode], zeta[mode], own.zeta[mode]))
    errors: list[ModeErrors | None] = []
    for pair in pairs:
        if len(pair) < LEAST - 1:
            errors.append(None)
            continue
        f_d, own_f_d, zeta, own_zeta = np.array(pair).T
        errors.append(ModeErrors(spread(f_d, own_f_d), spread(zeta, own_zeta)))
    return errors


def _range(arm: ArmModes, fit: ModalFit, rated: float) -> tuple[float, float]:
    """Lowest f_d and highest ζ that a filter has to count on, with some room."""
    description = arm.description
    everywhere = IDENTIFIED.spread(WORKSPACE, description.joints, 0)
    lowest, highest = np.inf, 0.0
    whole = ArmModes(description, (paper_payload(description, 0.0), paper_payload(description, rated)))
    for payload in range(2):
        for q in everywhere:
            f_d, zeta = describe(fit.drivetrain.poles(whole.mass(q, payload))[0][:MODES])
            lowest, highest = min(lowest, float(f_d.min())), max(highest, float(zeta.max()))
    return MARGIN * lowest, 1.0 - MARGIN * (1.0 - highest)


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


async def _against_truth(
    robot: Robot,
    control: Arm,
    calibration: Calibration,
    description: RobotDescription,
    plan: ModalPlan,
    info: Info,
) -> tuple[ModeErrors, ...] | None:
    """Errors where nothing was measured, at random; None where the robot tells no truth.

    With random payloads, too, where the arm was made to carry some; else with what is declared.
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
