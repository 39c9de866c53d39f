"""Fit a twin: a robot file with which a simulated arm moves like the arm in logs.

Springs and drives start from values fitted to ring-downs. Then all parameters are fitted by simulating each
motion of the logs again, like a served robot, and comparing the tool's acceleration around the stop, joint
angles and torques (output error; Ljung, System Identification, 1999, ch. 7). Gauss-Newton steps have a prior
that holds parameters without information in the logs at the robot file's values.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tvist_lab.identification.calibrate import agreeing, check_logs
from tvist_lab.identification.modal_fit import fit_from_many
from tvist_lab.identification.observed import Observed, apart, felt_by, mounting_of, observe, repeated
from tvist_lab.identification.ring_downs import CONTRADICTS, IdentificationError, Log, Progress, RingDownStop
from tvist_lab.identification.twin_parameters import FITTED_BELOW, TwinParameters
from tvist_lab.identification.unknowns import FURTHEST
from tvist_lab.metrics import motions
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD, Response
from tvist_protocol.calibration import ModalParameter

DIFFERENCE_STEP = 1e-3  # step for finite differences, relative to a number's deviation before the fit [-]
ROUNDS = 5  # largest number of computations of derivatives
DAMPERS = (0.0, 0.3, 3.0)  # weights of the step's length; each is used until steps no longer help [-]
ENOUGH = 0.01  # relative decrease of the cost below which a step does not help [-]
FEWEST = 4  # smallest number of motions; with fewer, the twin would be little more than the robot file
AUDIBLE = 1.5  # smallest residual for comparison, relative to the noise of three axes [-]


@dataclass(frozen=True)
class Prediction:
    """Residual vibration of a motion that was not used in the fit."""

    log: str
    motion: int
    measured: float  # rms of the tool's acceleration from 10 ms to half a second after the stop [m/s²]
    twin: float  # rms that the twin predicts [m/s²]


@dataclass(frozen=True)
class Twin:
    """A fitted robot file, and how well it predicts."""

    parameters: TwinParameters
    values: Floats  # the fitted numbers, shape (P,)
    deviations: Floats  # their standard deviations, shape (P,)
    payload: int  # index of the payload that was declared last
    motions: int  # number of motions that were repeated
    others: tuple[RingDownStop, ...]  # motions that were not repeated, with reasons
    predictions: tuple[Prediction, ...]  # predictions of motions that were not used in the fit
    quiet: int  # number of further such motions that vibrate too little to compare
    checked: bool  # whether such motions are from separate logs; else each is left out of the fit in turn
    late_ms: tuple[float, ...]  # lag of another controller's arm behind the twin, by motion [ms]

    @property
    def robot(self) -> RobotDescription:
        """The robot file."""
        return self.parameters.robot(self.values, self.payload)

    @property
    def told(self) -> list[bool]:
        """Whether the logs determine each number."""
        return [bool(told) for told in self.deviations < FITTED_BELOW * self.parameters.deviation]

    def error_percent(self, share: float) -> float | None:
        """Return a quantile of the errors of the predicted residual [%]; None without predictions."""
        errors = [100.0 * abs(one.twin / one.measured - 1.0) for one in self.predictions]
        return float(np.quantile(errors, share)) if errors else None


class _Fit:
    """Recorded motions, and deviations of simulated ones from them for any values of the fitted numbers."""

    def __init__(self, parameters: TwinParameters, seen: Sequence[Observed]) -> None:
        self.parameters, self.seen = parameters, tuple(seen)
        self._torque = np.array(parameters.description.limits.torque)
        self.mountings: dict[str, Floats] = {}

    def mount(self, values: Floats, motions: Sequence[Observed]) -> None:
        """Find the mounting of each log's accelerometer; in our recordings its axes are the flange's."""
        pairs: dict[str, list[tuple[Floats, Floats]]] = {}
        for one in motions:
            self.mountings[one.log] = np.eye(3)
            if one.foreign:
                felt = felt_by(self.repeat(values, one), one, np.eye(3))
                pairs.setdefault(one.log, []).append((felt, one.felt[1]))
        self.mountings |= {log: mounting_of(own) for log, own in pairs.items()}

    def repeat(self, values: Floats, motion: Observed) -> Response:
        payload = self.parameters.payload(values, motion.payload)
        return repeated(self.parameters.robot(values, motion.payload), payload, motion)

    def apart(self, values: Floats, motion: Observed) -> Floats:
        return apart(self.repeat(values, motion), motion, self.mountings[motion.log], self._torque)

    def left(self, values: Floats) -> list[Floats]:
        return [self.apart(values, motion) for motion in self.seen]

    def slopes(self, values: Floats, left: Sequence[Floats]) -> list[Floats]:
        """Return the derivatives of each motion's differences, shape (samples, P)."""
        found = [np.zeros((len(one), len(values))) for one in left]
        for number, entry in enumerate(self.parameters.entries):
            step = DIFFERENCE_STEP * entry.deviation
            moved = values.copy()
            moved[number] += step
            for place, motion in enumerate(self.seen):
                if entry.table != "payload" or entry.places[0] == motion.payload:
                    found[place][:, number] = (self.apart(moved, motion) - left[place]) / step
        return found

    def predict(self, values: Floats, motion: Observed) -> float:
        return motion.residual_of(felt_by(self.repeat(values, motion), motion, self.mountings[motion.log]))


def fit_twin(
    description: RobotDescription, logs: Sequence[Log], checks: Sequence[Log], progress: Progress
) -> Twin:
    """Fit a robot file to logs with targets, and predict the motions of `checks`.

    Without `checks`, each motion is predicted by a fit without it.
    """
    check_logs(description, [*logs, *checks])
    stops, arm, ring_downs = agreeing(description, logs, progress)
    progress("fitting springs and drives to the stops")
    modal = arm.parameters(fit_from_many(arm, ring_downs).logarithms)
    carried = (log.carried(motion.shaped_stop) for log in checks for motion in motions(log.recording))
    payloads = tuple(dict.fromkeys((*arm.payloads, *carried)))
    wrong = {(stop.log, stop.motion) for stop in stops if stop.reason == CONTRADICTS}
    seen, others = observe(logs, payloads)
    seen = [one for one in seen if (one.log, one.motion) not in wrong]
    if len(seen) < FEWEST:
        raise IdentificationError(
            f"{len(seen)} motions can be repeated, at least {FEWEST} are needed: record more"
        )
    parameters = TwinParameters(description, payloads)
    fit = _Fit(parameters, seen)
    values = _begin(parameters, modal)
    fit.mount(values, seen)
    values, left, slopes = _descend(fit, values, progress)
    excess = max(sum(float(one @ one) for one in left) / sum(map(len, left)), 1.0)
    prior = np.diag(parameters.deviation**-2.0)
    whole = sum((slope.T @ slope for slope in slopes), np.zeros_like(prior)) / excess + prior
    progress("predicting motions that the fit has not seen")
    # Approximate the fit without a motion by one Gauss-Newton step that removes the motion's contribution.
    moved = [
        np.linalg.solve(whole - slope.T @ slope / excess, slope.T @ one / excess)
        for slope, one in zip(slopes, left, strict=True)
    ]
    unseen = [(one, values + step) for one, step in zip(seen, moved, strict=True)]
    if checks:
        more, _ = observe(checks, payloads)
        fit.mount(values, more)
        unseen = [(one, values) for one in more]
    jackknife = (len(seen) - 1) / len(seen) * np.sum(np.square(moved), axis=0)
    loud = [(one, own) for one, own in unseen if one.measured_residual > AUDIBLE * np.sqrt(3.0) * one.noise]
    return Twin(
        parameters=parameters,
        values=values,
        deviations=np.sqrt(np.maximum(np.diag(np.linalg.inv(whole)), jackknife)),
        payload=seen[-1].payload,
        motions=len(seen),
        others=(*others, *(stop for stop in stops if (stop.log, stop.motion) in wrong)),
        predictions=tuple(
            Prediction(one.log, one.motion, one.measured_residual, fit.predict(own, one)) for one, own in loud
        ),
        quiet=len(unseen) - len(loud),
        checked=bool(checks),
        late_ms=tuple(1e3 * PERIOD * one.late for one in seen),
    )


def _begin(parameters: TwinParameters, modal: Sequence[ModalParameter]) -> Floats:
    """Return the numbers that correspond to the springs and drives fitted to ring-downs, shape (P,)."""
    values = np.zeros(len(parameters.entries))
    drives, links = parameters.description.drives, parameters.description.link_flexibility
    for one in modal:
        for joint in one.joints:
            table, key, place = "drives", str(one.quantity), joint
            if one.quantity == "bending_stiffness":
                table, key, place = "link_flexibility", "stiffness", links.links.index(joint)
            number = parameters.index(table, key, place)
            if number is None:
                continue
            guess = getattr(getattr(parameters.description, table), key)[place]
            if one.quantity == "position_gain":
                guess += drives.integral_gain[place]
            if guess > 0.0:
                limit = FURTHEST * parameters.deviation[number]
                values[number] = np.clip(np.log(one.value / guess), -limit, limit)
    return values


def _descend(fit: _Fit, values: Floats, progress: Progress) -> tuple[Floats, list[Floats], list[Floats]]:
    """Fit the numbers; also return the differences of each motion and their derivatives, shape (samples, P)."""
    # Computing derivatives takes far longer than differences, so derivatives are used for several steps.
    deviation = fit.parameters.deviation
    limit = FURTHEST * deviation

    def cost(values: Floats, left: Sequence[Floats]) -> float:
        return sum(float(one @ one) for one in left) + float(np.sum((values / deviation) ** 2))

    left = fit.left(values)
    slopes: list[Floats] = []
    for number in range(1, ROUNDS + 1):
        progress(f"repeating {len(fit.seen)} motions, round {number} of at most {ROUNDS}")
        before = cost(values, left)
        slopes = fit.slopes(values, left)
        whole = sum((slope.T @ slope for slope in slopes), np.diag(deviation**-2.0))
        dampers = list(DAMPERS)
        while dampers and number < ROUNDS:
            pull = sum(
                (slope.T @ one for slope, one in zip(slopes, left, strict=True)), values / deviation**2
            )
            step = np.linalg.solve(whole + dampers[0] * np.diag(np.diag(whole)), -pull)
            tried = np.clip(values + np.clip(step, -deviation, deviation), -limit, limit)
            then, now = fit.left(tried), cost(values, left)
            if cost(tried, then) > (1.0 - ENOUGH) * now:
                dampers.pop(0)
                continue
            values, left = tried, then
        if cost(values, left) > (1.0 - ENOUGH) * before:
            break
    return values, left, slopes
