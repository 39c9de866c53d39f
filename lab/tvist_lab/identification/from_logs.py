"""Identification from logs alone: what everyday stops tell of springs and drives, and which moves would tell more."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec.structs import replace as with_fields

from tvist_lab.identification.everyday_stops import CONTRADICTS, Log, Stop, stops_of
from tvist_lab.identification.fit import FitError, check_count, fit_polynomials
from tvist_lab.identification.forecast import Forecast, Known
from tvist_lab.identification.identify import DEGREES, IdentificationError
from tvist_lab.identification.modal_calibration import Origin, calibrated, contradicting
from tvist_lab.identification.modal_plan import LEAST, ModalPlan, free_configurations, jog_of
from tvist_lab.identification.proposals import Proposal, propose
from tvist_lab.identification.ring_downs import MODES, SHARE, Ringing
from tvist_lab.identification.unknowns import ArmModes, unknowns_near
from tvist_lab.metrics import SLOW_POLE, fit_ring_down
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified, ranges
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import Calibration

PLACES = 100
"""Number of configurations of the workspace at which the calibration's accuracy is determined."""
KNOWN = 5.0
"""A configuration is known if the 95 % interval of the lowest f_d is within this of it [%]."""
PROPOSED = 3
CANDIDATES = 40
"""Number of configurations among which moves are proposed."""
ROUGH = 10.0
"""A polynomial is kept if it misses at most this in nine of ten stops that it did not see [%]."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class FromLogs:
    """A calibration from logs, and how far it goes."""

    calibration: Calibration
    stops: tuple[Stop, ...]
    """All stops; those that contradict others have a reason, too."""
    forecast: Forecast
    known_percent: float
    """Share of the workspace in which f_d of the lowest mode is known within `KNOWN`, with the heaviest payload [%]."""
    least_known: tuple[Floats, Known]
    """Configuration of the workspace at which it is known least, and the mode there."""
    proposals: tuple[Proposal, ...]
    no_polynomial: str
    """Why the calibration has no polynomials; empty if it has."""

    @property
    def used(self) -> int:
        """Number of stops that were used."""
        return sum(stop.ringing is not None for stop in self.stops)

    @property
    def unused(self) -> dict[str, int]:
        """Reason to the number of stops that were not used for it, the most frequent first."""
        return unused(self.stops)


def unused(stops: Sequence[Stop]) -> dict[str, int]:
    """Return each reason with the number of stops that were not used for it, the most frequent first."""
    return dict(Counter(stop.reason for stop in stops if stop.ringing is None).most_common())


def identify_from_logs(
    description: RobotDescription, logs: Sequence[Log], *, name: str, command: str, progress: Progress
) -> FromLogs:
    """Identify springs and drives from the stops of logs, and polynomials where enough configurations are covered.

    Args:
        description: The robot; its springs and drives are what is not told by the logs.
        logs: At least one log.
        name: Name of the calibration.
        command: Command line that the user typed.
        progress: Called before each step with what it does.

    Raises:
        IdentificationError: Too few stops can be used, or they contradict each other; the message says why.
        RecordingError: A log cannot be used.
    """
    check_logs(description, logs)
    stops, arm, ringings, agreeing = usable(description, logs, progress)
    fingerprints = {getattr(log.recording.info, "arm", None) for log in logs}
    origin = Origin(
        name, command, description.robot.model, None, fingerprints.pop() if len(fingerprints) == 1 else None
    )
    return told_by(arm, stops, ringings[-1], agreeing, origin, progress)


def told_by(
    arm: ArmModes,
    stops: Sequence[Stop],
    last: Ringing,
    ringings: Sequence[Ringing],
    origin: Origin,
    progress: Progress,
) -> FromLogs:
    """Return the calibration that ring-downs tell, how far it goes, and the moves that would tell more.

    Args:
        arm: The arm with its payloads.
        stops: All stops.
        last: The last ring-down: the arm stands there, with its payload.
        ringings: The ring-downs that do not contradict each other.
        origin: What the calibration says of its making.
        progress: Called before each step with what it does.
    """
    progress("fitting springs and drives")
    description = arm.description
    calibration, forecast = calibrated(arm, ringings, origin, len(stops) - len(ringings))
    calibration, no_polynomial = _with_polynomials(calibration, arm, ringings)
    progress("looking for moves that would tell more")
    places = identified(ranges(description)).spread(PLACES, description.joints, 1)
    heaviest = max(range(len(arm.payloads)), key=lambda number: arm.payloads[number].mass)
    known = [forecast.at(q, heaviest) for q in places]
    half = np.array([one.f_d_percent[0] for one in known])
    worst = int(np.argmax(half))
    return FromLogs(
        calibration=calibration,
        stops=tuple(stops),
        forecast=forecast,
        known_percent=100.0 * float(np.mean(half <= KNOWN)),
        least_known=(places[worst], known[worst]),
        proposals=more_moves(forecast, last),
        no_polynomial=no_polynomial,
    )


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


def usable(
    description: RobotDescription, logs: Sequence[Log], progress: Progress
) -> tuple[list[Stop], ArmModes, list[Ringing], list[Ringing]]:
    """Return all stops, the arm with their payloads, all ring-downs, and those that do not contradict the others.

    Raises:
        IdentificationError: Too few can be used; the message says why.
    """
    progress("looking for stops")
    stops, payloads = stops_of(logs)
    ringings = [stop.ringing for stop in stops if stop.ringing is not None]
    if len(ringings) < LEAST:
        why = "; ".join(f"{count}: {reason}" for reason, count in unused(stops).items())
        raise IdentificationError(
            f"{len(ringings)} of {len(stops)} stops can be used, at least {LEAST} are needed"
            + (f" ({why})" if why else "")
            + ". Record motions of the unshaped robot, as by tvist move --shaper none, each with half a second of rest"
        )
    progress("comparing stops")
    arm = ArmModes(description, payloads, unknowns_near(description))
    guilty = set(contradicting(arm, ringings))
    wrong = {id(ringings[number]) for number in guilty}
    stops = [
        replace(stop, ringing=None, reason=CONTRADICTS) if id(stop.ringing) in wrong else stop
        for stop in stops
    ]
    return stops, arm, ringings, [r for number, r in enumerate(ringings) if number not in guilty]


def _with_polynomials(
    calibration: Calibration, arm: ArmModes, ringings: Sequence[Ringing]
) -> tuple[Calibration, str]:
    """Add polynomials for the payload with most stops, if they are accurate; else say why not."""
    payload, count = Counter(r.payload for r in ringings).most_common(1)[0]
    joints = tuple(j for j in (1, 2, 3) if j < arm.description.joints) or (0,)
    degree = DEGREES[len(joints) - 1]
    try:
        check_count(count, joints, degree)
        own = [r for r in ringings if r.payload == payload]
        fits = [
            fit_ring_down(
                r.force, PERIOD if r.time is None else float(np.median(np.diff(r.time))), modes=MODES, time=r.time,
                slow_poles=(SLOW_POLE,), offset=True, skip=0.0, share=SHARE,
            )
            for r in own
        ]  # fmt: skip
        kept = [(r.q, fit.f_d, fit.zeta) for r, fit in zip(own, fits, strict=True) if fit.ok]
        check_count(len(kept), joints, degree)
        q, f_d, zeta = (np.array(column) for column in zip(*kept, strict=True))
        fit = fit_polynomials(q, f_d, zeta, np.ones(len(q)), joints=joints, degree=degree)
    except FitError as error:
        return calibration, f"with {arm.payloads[payload].mass:g} kg there are {error}"
    if fit.cross_validated_f_d.p90 > ROUGH:
        return calibration, (
            f"f_d would be off by {fit.cross_validated_f_d.p90:.0f} % and more at one stop in ten: they cover too "
            "little of the workspace"
        )
    provenance = with_fields(
        calibration.provenance,
        residual_f_d_percent=fit.residual_f_d,
        residual_zeta_percent=fit.residual_zeta,
        cross_validated_f_d_percent=fit.cross_validated_f_d,
        cross_validated_zeta_percent=fit.cross_validated_zeta,
    )
    held = arm.payloads[payload]
    return with_fields(calibration, polynomial=fit.model, payload=held, provenance=provenance), ""


def more_moves(forecast: Forecast, last: Ringing) -> tuple[Proposal, ...]:
    """Propose jogs that would tell more than is known, from where the last ring-down was listened to."""
    arm, plan = forecast.arm, ModalPlan(jog=jog_of(forecast.arm.description))
    candidates = free_configurations(arm.description, (arm.payloads[last.payload],), CANDIDATES, plan)
    known = forecast.fit.logarithms, forecast.covariance
    return propose(arm, candidates, plan.jog, (last.q, last.payload), PROPOSED, known)
