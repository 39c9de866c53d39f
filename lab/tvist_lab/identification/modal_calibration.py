"""Fit and check of ring-downs, and the resulting calibration."""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from tvist_controller.api.line import paper_payload
from tvist_lab.identification.fit import spread
from tvist_lab.identification.forecast import Forecast, LeftOut
from tvist_lab.identification.identify import IdentificationError
from tvist_lab.identification.modal_fit import (
    MODES,
    ModalFit,
    OwnPoles,
    describe,
    fit_from_many,
    fit_modal,
    of_masses,
    own_poles,
)
from tvist_lab.identification.modal_plan import LEAST
from tvist_lab.identification.ring_downs import Ringing
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified, ranges
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import (
    Calibration,
    ModalModel,
    ModalParameter,
    Provenance,
    RingDownFit,
    Spread,
)
from tvist_shaping.estimators.drivetrain import Drivetrain

CONTRADICTION = 0.2
"""A ring-down contradicts the others if this share of it is explained only by its own poles [-]."""
SIGNIFICANT = 60.0
"""Significance that is required for a contradiction, to exclude noise; see `OwnPoles.significance` [-]."""
SUSPECTS = 3
"""Number of ring-downs that are left out in turn."""
GUILTY = 3
"""If more than one ring-down in this number is wrong, the wrong ones cannot be determined."""
TOLD = 3
"""Number of modes whose errors are reported."""
SINGLY = 14
"""Largest number of configurations that are left out one by one."""
FOLDS = 10
"""Number of parts of more of them."""
WORKSPACE = 200
"""Number of configurations in which the range of the modes is determined."""
MARGIN = 0.85
"""Margin on the lowest frequency found over the workspace, and on the distance to the highest damping ratio [-]."""


@dataclass(frozen=True)
class Origin:
    """What a calibration says of its making."""

    name: str
    """Name of the calibration."""
    command: str
    """Command line that the user typed."""
    model: str
    """Model of the arm."""
    seed: int | None
    """Seed of the choice of configurations; None if they were not chosen."""
    arm: str | None
    """Fingerprint of the arm; None if unknown."""


@dataclass(frozen=True)
class ModeErrors:
    """Errors of one mode [%]."""

    f_d: Spread
    zeta: Spread


def calibrate(
    arm: ArmModes,
    ringings: Sequence[Ringing],
    origin: Origin,
    rejected: int,
    *,
    friction: tuple[ModalParameter, ...] = (),
) -> Calibration:
    """Fit, check and create a calibration of springs and drives, to which the identified friction is added.

    Raises:
        IdentificationError: The ring-downs contradict each other.
    """
    guilty = contradicting(arm, ringings)
    if guilty:
        names = "; ".join(
            f"number {number + 1} with {arm.payloads[ringings[number].payload].mass:g} kg at q = "
            f"{ringings[number].q.round(2).tolist()}"
            for number in guilty
        )
        raise IdentificationError(
            f"ring-downs that contradict the other {len(ringings) - len(guilty)}: {names}. Was the payload the "
            "declared one, and was the arm free? Check this and measure again, or use another seed for other "
            "configurations"
        )
    return calibrated(arm, ringings, origin, rejected, friction=friction)[0]


def calibrated(
    arm: ArmModes,
    ringings: Sequence[Ringing],
    origin: Origin,
    rejected: int,
    *,
    friction: tuple[ModalParameter, ...] = (),
) -> tuple[Calibration, Forecast]:
    """Fit ring-downs that agree, and create a calibration; also return what it knows of any configuration."""
    fit = fit_from_many(arm, ringings)
    left, jackknife = _cross_validate(arm, ringings, fit)
    forecast = Forecast(arm, fit, fit.covariance + jackknife, of_masses(arm, ringings, fit)).widened(left)
    deviations = np.sqrt(
        np.maximum(np.diag(fit.covariance), np.diag(jackknife)) + np.sum(forecast.moved**2, axis=1)
    )
    first = np.array(
        [np.ravel(describe(fit.drivetrain.poles(arm.mass(r.q, r.payload))[0][:1])) for r in ringings]
    )
    noise = float(np.sqrt(np.mean([r.noise**2 for r in ringings])))
    f_d_min, zeta_max = mode_range(arm.description, fit.drivetrain)
    unseen = _errors(left)
    model = ModalModel(
        parameters=(*arm.parameters(fit.logarithms, deviations), *friction),
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
    calibration = Calibration(
        name=origin.name,
        robot=origin.model,
        payload=max(arm.payloads, key=lambda payload: payload.mass),
        modal=model,
        provenance=Provenance(
            command=origin.command,
            version=version("tvist"),
            seed=origin.seed,
            configurations=len({r.q.tobytes() for r in ringings}),
            ring_downs=len(ringings),
            rejected=rejected,
            measured_f_d_range=(low_f, high_f),
            measured_zeta_range=(low_z, high_z),
            arm=origin.arm,
        ),
    )
    return calibration, forecast


def contradicting(arm: ArmModes, ringings: Sequence[Ringing]) -> list[int]:
    """Find ring-downs that no springs and drives can explain together with the others.

    A wrong ring-down also spoils the fit of the others. So among the worst explained ones, the one whose omission
    gives the best fit is left out, until the remaining ones agree.

    Returns:
        Their numbers, from 0, in order.

    Raises:
        IdentificationError: So many contradict each other that the wrong ones cannot be determined.
    """
    fit = fit_modal(arm, ringings)
    rest = list(range(len(ringings)))
    guilty: list[int] = []
    while len(guilty) <= len(ringings) // GUILTY:
        explained = {number: _own(arm, ringings[number], fit) for number in rest}
        worst = sorted(rest, key=lambda number: -explained[number].share)[:SUSPECTS]
        if all(own.share < CONTRADICTION or own.significance < SIGNIFICANT for own in explained.values()):
            return sorted(guilty)
        without = {
            number: fit_modal(arm, [ringings[other] for other in rest if other != number], fit.logarithms)
            for number in worst
        }
        removed = min(worst, key=lambda number: without[number].cost)
        guilty.append(removed)
        rest.remove(removed)
        fit = without[removed]
    raise IdentificationError(
        f"the {len(ringings)} ring-downs contradict each other: no springs and drives explain them together. Was "
        "the payload the declared one each time, is the robot the one of the file, and did nothing shake it? The "
        "search begins at springs and drives of robot arms of 5 kg payload: for another kind of arm, use --model "
        "polynomial"
    )


def _own(arm: ArmModes, ringing: Ringing, fit: ModalFit) -> OwnPoles:
    """Fit a ring-down's own poles, starting from those of a fit."""
    return own_poles(arm, ringing, fit.drivetrain.poles(arm.mass(ringing.q, ringing.payload))[0][:MODES])


def _cross_validate(
    arm: ArmModes, ringings: Sequence[Ringing], fit: ModalFit
) -> tuple[list[LeftOut], Floats]:
    """Fit without each configuration in turn, or without each of `FOLDS` parts of many configurations.

    Returns:
        The modes of each ring-down, and the covariance of the parameters' logarithms by the jackknife, shape (P, P),
        which sees what the model leaves out as well as noise.
    """
    places = {place: number for number, place in enumerate(dict.fromkeys(r.q.tobytes() for r in ringings))}
    folds = len(places) if len(places) <= SINGLY else FOLDS
    logarithms, left = [], []
    for fold in range(folds):
        out = [r for r in ringings if places[r.q.tobytes()] % folds == fold]
        others = [r for r in ringings if places[r.q.tobytes()] % folds != fold]
        unseen = fit_modal(arm, others, fit.logarithms)
        logarithms.append(unseen.logarithms)
        for ringing in out:
            poles = unseen.drivetrain.poles(arm.mass(ringing.q, ringing.payload))[0][:MODES]
            left.append(LeftOut(ringing, *describe(poles), _own(arm, ringing, unseen)))
    apart = np.array(logarithms) - np.mean(logarithms, axis=0)
    return left, (folds - 1) / folds * apart.T @ apart


def _errors(left: Sequence[LeftOut]) -> list[ModeErrors | None]:
    """Errors of each mode, from configurations whose own ring-down is accurate enough."""
    errors: list[ModeErrors | None] = []
    for mode in range(TOLD):
        pairs = [
            (one.f_d[mode], one.own.f_d[mode], one.zeta[mode], one.own.zeta[mode])
            for one in left
            if mode in one.certain
        ]
        if len(pairs) < LEAST - 1:
            errors.append(None)
            continue
        f_d, own_f_d, zeta, own_zeta = np.array(pairs).T
        errors.append(ModeErrors(spread(f_d, own_f_d), spread(zeta, own_zeta)))
    return errors


def mode_range(description: RobotDescription, drivetrain: Drivetrain) -> tuple[float, float]:
    """Lowest f_d and highest ζ that a filter has to support up to the rated payload, with a margin.

    Args:
        description: The robot.
        drivetrain: Its springs and drives.
    """
    everywhere = identified(ranges(description)).spread(WORKSPACE, description.joints, 0)
    lowest, highest = np.inf, 0.0
    payloads = [paper_payload(description, mass) for mass in (0.0, description.limits.payload)]
    whole = ArmModes(description, payloads)
    for payload in range(2):
        for q in everywhere:
            f_d, zeta = describe(drivetrain.poles(whole.mass(q, payload))[0][:MODES])
            lowest, highest = min(lowest, float(f_d.min())), max(highest, float(zeta.max()))
    return MARGIN * lowest, 1.0 - MARGIN * (1.0 - highest)
