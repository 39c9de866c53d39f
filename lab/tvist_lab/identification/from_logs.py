"""Identification from logs alone: what everyday stops tell of springs and drives, and which moves would tell more."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from msgspec.structs import replace as with_fields

from tvist_controller.api.line import CollisionModel, MotionLimits, body
from tvist_lab.identification.design import choose
from tvist_lab.identification.everyday_stops import CONTRADICTS, Log, Stop, stops_of
from tvist_lab.identification.fit import FitError, check_count, fit_polynomials
from tvist_lab.identification.forecast import Forecast, Known
from tvist_lab.identification.identify import DEGREES, IdentificationError
from tvist_lab.identification.modal_calibration import Origin, calibrated, contradicting
from tvist_lab.identification.modal_plan import LEAST, ModalPlan, free_configurations, jog_of
from tvist_lab.identification.ring_downs import MODES, SHARE, Ringing
from tvist_lab.identification.unknowns import ArmModes, unknowns_near
from tvist_lab.metrics import SLOW_POLE, fit_ring_down
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified, ranges
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import Calibration
from tvist_protocol.values import Payload

PLACES = 100
"""Number of configurations of the workspace at which the calibration's accuracy is determined."""
KNOWN = 5.0
"""A configuration is known if the 95 % interval of the lowest f_d is within this of it [%]."""
PROPOSED = 3
CANDIDATES = 40
"""Number of configurations among which moves are proposed."""
SPARE = 3
"""Number of candidates that are ordered for each proposal, since the way to some is not free."""
STEP = 0.03
"""Angle of the fastest joint between two postures in which a way is checked [rad]."""
ROUGH = 10.0
"""A polynomial is kept if it misses at most this in nine of ten stops that it did not see [%]."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Proposal:
    """A move that would tell much: a jog to a configuration, after free ways to its start."""

    way: tuple[Floats, ...]
    """Postures to go to one after the other, the last of which is the jog's start, each of shape (n,) [rad]."""
    q: Floats
    """End of the jog, where the arm rings, shape (n,) [rad]."""
    limits: MotionLimits


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
    progress("fitting springs and drives")
    fingerprints = {getattr(log.recording.info, "arm", None) for log in logs}
    origin = Origin(
        name, command, description.robot.model, None, fingerprints.pop() if len(fingerprints) == 1 else None
    )
    calibration, forecast = calibrated(arm, agreeing, origin, len(stops) - len(agreeing))
    calibration, no_polynomial = _with_polynomials(calibration, arm, agreeing)
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
        proposals=propose(description, forecast, ringings[-1]),
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


def propose(description: RobotDescription, forecast: Forecast, last: Ringing) -> tuple[Proposal, ...]:
    """Choose the jogs that would tell most of springs and drives, with free ways to them from the last stop.

    Args:
        description: The robot.
        forecast: What is known of it.
        last: The last ring-down: the arm stands there, with its payload.
    """
    arm, plan = forecast.arm, ModalPlan(jog=jog_of(description))
    payload: Payload = arm.payloads[last.payload]
    candidates = free_configurations(description, (payload,), CANDIDATES, plan)
    counts = [SPARE * PROPOSED if number == last.payload else 0 for number in range(len(arm.payloads))]
    order = choose(arm, candidates, plan.jog, counts, (forecast.fit.logarithms, forecast.covariance))
    collisions, jog = CollisionModel(description, body(payload)), plan.jog.of(description.joints)
    upright = np.zeros(description.joints)
    upright[[joint for joint in (1, 3) if joint < description.joints]] = -np.pi / 2

    def free(*postures: Floats) -> bool:
        """Whether the straight ways from posture to posture, in the space of the joints, are clear."""
        for before, after in pairwise(postures):
            steps = max(int(np.ceil(np.max(np.abs(after - before)) / STEP)), 1)
            if any(
                collisions.meeting(before + (after - before) * k / steps) is not None
                for k in range(steps + 1)
            ):
                return False
        return True

    found: list[Proposal] = []
    at = last.q
    for number, _ in order:
        q = candidates[number]
        ways = ((q - jog,), (upright, q - jog))
        way = next((way for way in ways if free(at, *way, q)), None)
        if way is not None and len(found) < PROPOSED:
            found.append(Proposal(way, q, plan.jog.limits))
            at = q
    return tuple(found)
