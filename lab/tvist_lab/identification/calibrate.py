"""Fit a calibration to ring-downs: springs, drives, accuracies; polynomials if the workspace is covered."""

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.metadata import version

import numpy as np
from msgspec.structs import replace as with_fields

from tvist_controller.api.line import body, modal_estimator, paper_payload
from tvist_lab.identification.design import free_configurations
from tvist_lab.identification.forecast import (
    ForecastModes,
    LeftOut,
    ModeForecast,
    contradicting,
    cross_validate,
)
from tvist_lab.identification.jogs import MIN_RING_DOWNS, Jog, RingDownLogs, plan_ways
from tvist_lab.identification.modal_fit import (
    ModalFit,
    describe,
    fit_from_many,
    lowest_poles,
    of_masses,
    softened,
)
from tvist_lab.identification.polynomials import FitError, polynomials, spread
from tvist_lab.identification.ring_downs import (
    CONTRADICTS,
    IdentificationError,
    Log,
    Progress,
    RingDownData,
    RingDownStop,
    stops_of,
    unused,
)
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_protocol.calibration import Calibration, ModalModel, Provenance, RingDownFit, Spread
from tvist_protocol.values import Payload
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.drivetrain import Drivetrain

REPORTED_MODES = 3  # number of modes whose errors are reported
MAX_RING_DOWNS = 48  # number of ring-downs that are fitted; more add little
WORKSPACE = 200  # number of configurations over which the range of the modes is determined
MARGIN = 0.85  # margin on the lowest frequency and on the highest damping ratio [-]
PLACES = 100  # number of configurations over which the calibration's accuracy is determined
UNSEEN = 60  # number of configurations at which a calibration is compared with the truth
KNOWN = 5.0  # largest half-width of the interval of a known configuration's lowest f_d [%]
PROPOSED = 3
CANDIDATES = 40  # number of configurations from which proposed moves are chosen


@dataclass(frozen=True)
class ModeErrors:
    """Errors of one mode [%]."""

    f_d: Spread
    zeta: Spread


@dataclass(frozen=True)
class CalibrationResult:
    """A calibration from ring-downs, and its accuracy."""

    calibration: Calibration
    stops: tuple[RingDownStop, ...]
    """All stops; those that were not used have a reason, for example that they contradict others."""
    left: tuple[LeftOut, ...]  # the fitted ring-downs, with their modes from fits without them
    forecast: ModeForecast
    known_percent: float
    """Share of the workspace in which the lowest f_d is known within `KNOWN` with the heaviest payload [%]."""
    least_known: tuple[Floats, ForecastModes]  # configuration with the least known mode
    proposals: tuple[Jog, ...]  # jogs that would add most information
    no_polynomial: str  # why the calibration has no polynomials; empty if it has

    @property
    def used(self) -> int:
        """Number of stops that were used."""
        return sum(stop.ring_down is not None for stop in self.stops)

    @property
    def modes(self) -> int:
        """Number of reported modes: `REPORTED_MODES`, or fewer if fewer were found in ring-downs."""
        return min(REPORTED_MODES, *(len(one.f_d) for one in self.left))

    @property
    def lowest_mode(self) -> tuple[Floats, Floats]:
        """f_d [Hz] and ζ [-] of ring-downs that determine them, and from fits without each, shapes (2, N)."""
        sure = [one for one in self.left if 0 in one.own.certain]
        return (
            np.array([(one.own.f_d[0], one.own.zeta[0]) for one in sure]).reshape(-1, 2).T,
            np.array([(one.f_d[0], one.zeta[0]) for one in sure]).reshape(-1, 2).T,
        )

    @property
    def amplitudes(self) -> list[float | None]:
        """Median initial |α| at which each reported mode was measured [m/s²]."""
        own = [
            [one.own.amplitude[k] for one in self.left if k in one.own.certain] for k in range(REPORTED_MODES)
        ]
        return [float(np.median(one)) if one else None for one in own]


def calibrate(
    description: RobotDescription, measured: RingDownLogs, *, name: str, command: str, progress: Progress
) -> CalibrationResult:
    """Fit springs and drives to all ring-downs that agree, and polynomials if they cover the workspace.

    The search starts at the springs and drives of the robot file; `command` is the typed command line. Raises
    IdentificationError if too few stops are usable or they disagree, RecordingError if a log is unusable.
    """
    stops, arm, ring_downs = agreeing(description, measured.logs, progress)
    progress("fitting springs and drives")
    fit = fit_from_many(arm, ring_downs)
    left, jackknife = cross_validate(arm, ring_downs, fit)
    masses = of_masses(arm, ring_downs, fit)
    forecast = ModeForecast(arm, fit, fit.covariance + jackknife, masses).widened(left)
    deviations = np.sqrt(
        np.maximum(np.diag(fit.covariance), np.diag(jackknife)) + np.sum(forecast.moved**2, axis=1)
    )
    first = np.array(
        [np.ravel(describe(lowest_poles(fit.drivetrain, arm.mass(r.q, r.payload))[:1])) for r in ring_downs]
    )
    (low_f, low_z), (high_f, high_z) = first.min(axis=0).tolist(), first.max(axis=0).tolist()
    f_d_min, zeta_max = mode_range(description, fit.drivetrain)
    unseen = _errors(left)
    used = [stop.ring_down for stop in stops if stop.ring_down is not None]
    arms = {getattr(log.recording.info, "arm", None) for log in measured.logs}
    calibration = Calibration(
        name=name,
        robot=description.robot.model,
        payload=max(arm.payloads, key=lambda payload: payload.mass),
        modal=ModalModel(
            parameters=(*arm.parameters(fit.logarithms, deviations), *measured.friction),
            f_d_min=f_d_min,
            zeta_max=zeta_max,
            payloads=arm.payloads,
            ring_downs=tuple(
                RingDownFit(
                    q=tuple(r.q.tolist()), payload=r.payload, rms=r.rms(), residual_to_noise=float(ratio)
                )
                for r, ratio in zip(ring_downs, fit.residual_to_noise, strict=True)
            ),
            noise=float(np.sqrt(np.mean([r.noise**2 for r in ring_downs]))),
            residual_to_noise=float(np.sqrt(np.mean(fit.residual_to_noise**2))),
            cross_validated_f_d_percent=tuple(None if mode is None else mode.f_d for mode in unseen),
            cross_validated_zeta_percent=tuple(None if mode is None else mode.zeta for mode in unseen),
        ),
        servo_lag_s=None if measured.servo is None else measured.servo.lag,
        servo_gain=None if measured.servo is None else measured.servo.gain,
        provenance=Provenance(
            command=command[:500],
            version=version("tvist"),
            seed=measured.seed,
            configurations=len({one.q.tobytes() for one in used}),
            ring_downs=len(used),
            rejected=len(stops) - len(used) + measured.refused,
            measured_f_d_range=(low_f, high_f),
            measured_zeta_range=(low_z, high_z),
            arm=arms.pop() if len(arms) == 1 else None,
        ),
    )
    every = [replace(one, softening=ring_downs[0].softening) for one in used]
    calibration, no_polynomial = _with_polynomials(calibration, arm, every, fit)
    progress("looking for moves that would tell more")
    places = identified(description).spread(PLACES, description.joints, 1)
    heaviest = max(range(len(arm.payloads)), key=lambda number: arm.payloads[number].mass)
    known = [forecast.at(q, heaviest) for q in places]
    half = np.array([one.f_d_percent[0] for one in known])
    worst = int(np.argmax(half))
    return CalibrationResult(
        calibration=calibration,
        stops=tuple(stops),
        left=tuple(left),
        forecast=forecast,
        known_percent=100.0 * float(np.mean(half <= KNOWN)),
        least_known=(places[worst], known[worst]),
        proposals=more_jogs(forecast, ring_downs[-1]),
        no_polynomial=no_polynomial,
    )


def agreeing(
    description: RobotDescription, logs: Sequence[Log], progress: Progress
) -> tuple[list[RingDownStop], ArmModes, list[RingDownData]]:
    """Return all stops, the arm with their payloads, and at most `MAX_RING_DOWNS` ring-downs that agree."""
    # Set in the ring-downs the gear hysteresis that explains all of them best.
    check_logs(description, logs)
    progress("looking for stops")
    stops, payloads = stops_of(logs)
    usable = [number for number, stop in enumerate(stops) if stop.ring_down is not None]
    if len(usable) < MIN_RING_DOWNS:
        why = "; ".join(f"{count}: {reason}" for reason, count in unused(stops).items())
        raise IdentificationError(
            f"{len(usable)} of {len(stops)} stops can be used: at least {MIN_RING_DOWNS} are needed"
            + (f" ({why})" if why else "")
            + ". Record motions of the unshaped robot, as by tvist move --shaper none, each with half a second of rest"
        )
    progress("comparing ring-downs")
    arm = ArmModes(description, payloads)
    count = min(len(usable), MAX_RING_DOWNS)
    fitted = [usable[k * len(usable) // count] for k in range(count)]
    ring_downs = softened(arm, [one for number in fitted if (one := stops[number].ring_down) is not None])
    wrong = contradicting(arm, ring_downs)
    for number in wrong:
        stops[fitted[number]] = replace(stops[fitted[number]], ring_down=None, reason=CONTRADICTS)
    return stops, arm, [ring_down for number, ring_down in enumerate(ring_downs) if number not in wrong]


def check_logs(description: RobotDescription, logs: Sequence[Log]) -> None:
    """Check that the logs are of this arm."""
    for log in logs:
        info, joints = log.recording.info, log.recording.joints
        if info is not None and info.model != description.robot.model:
            raise IdentificationError(
                f"{log.name} is of a {info.model}, the robot file of a {description.robot.model}: name its file"
            )
        if joints != description.joints:
            raise IdentificationError(
                f"{log.name} has {joints} joints, a {description.robot.model} has {description.joints}: name the "
                "robot's file"
            )


def more_jogs(forecast: ModeForecast, last: RingDownData) -> tuple[Jog, ...]:
    """Propose jogs that add most information; the first way starts where the last ring-down was recorded."""
    arm = forecast.arm
    counts = [PROPOSED if number == last.payload else 0 for number in range(len(arm.payloads))]
    candidates = free_configurations(arm.description, (arm.payloads[last.payload],), CANDIDATES, 0)
    return tuple(plan_ways(arm, candidates, last.q, counts, (forecast.fit.logarithms, forecast.covariance)))


def _with_polynomials(
    calibration: Calibration, arm: ArmModes, ring_downs: Sequence[RingDownData], springs: ModalFit
) -> tuple[Calibration, str]:
    """Add polynomials for the payload with most ring-downs; if they do not fit well, return the reason."""
    counted = Counter(r.payload for r in ring_downs)
    payload = max(counted, key=lambda number: (counted[number], arm.payloads[number].mass))
    try:
        model, deviations = polynomials(arm, [r for r in ring_downs if r.payload == payload], springs)
    except FitError as error:
        return calibration, f"with {arm.payloads[payload].mass:g} kg, {error}"
    provenance = with_fields(calibration.provenance, **deviations)
    held = arm.payloads[payload]
    return with_fields(calibration, polynomial=model, payload=held, provenance=provenance), ""


def _errors(left: Sequence[LeftOut]) -> list[ModeErrors | None]:
    """Return the errors of each mode, from ring-downs that determine the mode accurately enough."""
    errors: list[ModeErrors | None] = []
    for k in range(REPORTED_MODES):
        sure = [
            (one.f_d[k], one.own.f_d[k], one.zeta[k], one.own.zeta[k]) for one in left if k in one.own.certain
        ]
        f_d, own_f_d, zeta, own_zeta = np.array(sure).reshape(-1, 4).T
        enough = len(sure) >= MIN_RING_DOWNS - 1
        errors.append(ModeErrors(spread(f_d, own_f_d), spread(zeta, own_zeta)) if enough else None)
    return errors


def true_errors(
    description: RobotDescription,
    calibration: Calibration,
    payloads: Sequence[Payload],
    seed: int,
    modes: int = REPORTED_MODES,
) -> list[ModeErrors]:
    """Return the errors against the true modes of the robot file's arm, at configurations not used before."""
    pairs = []
    for payload in payloads:
        estimator = modal_estimator(calibration, description, payload, modes)
        plant = FlexibleArm(description, body(payload))
        for q in free_configurations(description, (payload,), UNSEEN // len(payloads), seed + 1):
            true = plant.modes(q)
            with suppress(EstimatorError):  # fewer modes vibrate there
                pairs.append((*estimator.estimate(q), true.f_d[:modes], true.zeta[:modes]))
    f_d, zeta, true_f_d, true_zeta = np.array(pairs).transpose(1, 2, 0)
    return [ModeErrors(spread(f_d[k], true_f_d[k]), spread(zeta[k], true_zeta[k])) for k in range(len(f_d))]


def mode_range(description: RobotDescription, drivetrain: Drivetrain) -> tuple[float, float]:
    """Return the lowest f_d and highest ζ that a filter must support up to the rated payload, with a margin."""
    everywhere = identified(description).spread(WORKSPACE, description.joints, 0)
    masses = (0.0, description.limits.payload)
    whole = ArmModes(description, [paper_payload(description, mass) for mass in masses])
    poles = [lowest_poles(drivetrain, whole.mass(q, payload)) for payload in range(2) for q in everywhere]
    f_d, zeta = describe(np.concatenate(poles))
    return MARGIN * float(f_d.min()), 1.0 - MARGIN * (1.0 - float(zeta.max()))
