"""Filters, shapers and estimators by the names that clients use."""

from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.line.limits import arm_limits
from tvist_controller.planning.snapshot import FilterState, PlanningState
from tvist_controller.refusal import RefusalError, invalid, missing
from tvist_controller.setup import Setup, paper_payload
from tvist_controller.sources.calibrations import available, elastic_feed_forward, known_friction, load
from tvist_controller.sources.mode_source import ModeSource, modal_source
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration, calibration_of
from tvist_protocol.commands import SetEstimator
from tvist_protocol.errors import ProtocolError
from tvist_protocol.replies import Code
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter
from tvist_shaping.errors import ShapingError, UnknownShaperError
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.failures import FAILURES
from tvist_shaping.filter import QUICKEST
from tvist_shaping.named import BUILT_IN, AnyShaper, Registry

EXCESSES = deque[tuple[ModeSource, AnyShaper | None, str, int, tuple[float, float]]](maxlen=32)
"""Cache of `excess_at_limits` for all robots: source of modes, own shaper, name, number of modes, result."""
POSTURES = 40  # number of postures at which modes are computed for `excess_at_limits`
HALF_STEP = 0.03  # half the travel over which the modes' change is measured [rad]
TIME = 0.01  # time over which the quickest change of modes is measured [s]
MARGIN = 1.1  # margin for postures not computed [-]
RISE = 15.0  # ratio of largest D̈ to largest Ḋ, twice that of random streams [1/s]
STEADY = 2.0  # ratio of a constant-delay filter's excess in a stream to that in a motion, its `excess` [-]
REHEARSED = 9  # ticks of a rehearsal; some filters update weights only every fourth tick
ESTIMATORS = ("fixed", "polynomial", "modal")


@dataclass(frozen=True)
class FilterChoice:
    """A filter with its source of modes, feed-forward and friction."""

    source: ModeSource  # source of the filter's modes
    tvist: Filter
    elastic: ElasticFeedForward | None  # elastic feed-forward for the drives; None if not used
    law: Floats | None = None  # known friction of the joints, see `known_friction`; None if unknown


class FilterPlanner:
    """Creates the filters of one robot."""

    def __init__(self, setup: Setup) -> None:
        self._setup, self._known = setup, setup.registry
        self._modal = modal_source(setup.description, setup.calibration)

    def first(self) -> FilterChoice:
        """Return the robot's initial filter; raise ValueError if its shaper does not exist."""
        setup = self._setup
        try:
            return self.choose(setup.shaper, 1, setup.source(), setup.payload)
        except RefusalError as error:
            raise ValueError(str(error)) from error

    def choose(
        self, name: str, modes: int, source: ModeSource, declared: Payload, where: str = "shaper"
    ) -> FilterChoice:
        """Return a filter by name for a number of modes to suppress; `where` is the field of the name.

        The filter uses `source`, or the arm's modal estimator if it needs more modes than the source has.
        Raise RefusalError if there is no such filter.
        """
        wanted = wanted_modes(name, modes, where, self._known)
        if wanted > source.most and self._modal is not None:
            source = self._modal
        tvist = self._make(name, wanted, source, declared, where, "modes" if modes > 1 else where)
        _rehearse(tvist)
        return self._with_feed_forward(source, tvist, where)

    def estimate(self, command: SetEstimator, now: PlanningState) -> FilterChoice:
        """Return the present filter with modes of another source, or raise RefusalError."""
        source, present = choose_source(command, self._setup), now.filter
        where = "f_d" if source.calibration is None else "calibration"
        tvist = self._again(present, source, present.declared, where)
        _rehearse(tvist)
        return self._with_feed_forward(source, tvist, where)

    def with_payload(self, payload: Payload, present: FilterState) -> Filter | None:
        """Return the present filter with another payload's modes; None if modes do not depend on payload."""
        return self._again(present, present.source, payload, "mass") if present.source.knows_payload else None

    def like(self, present: FilterState) -> Filter:
        """Return a filter like the present one, at rest at q = 0."""
        return self._again(present, present.source, present.declared, "shaper")

    def _again(self, present: FilterState, source: ModeSource, declared: Payload, where: str) -> Filter:
        return self._make(present.name, present.modes, source, declared, where, where)

    def _make(
        self, name: str, modes: int, source: ModeSource, declared: Payload, where: str, where_modes: str
    ) -> Filter:
        description = self._setup.description
        estimator = make_estimator(source, modes, declared, where_modes)
        tvist = choose_filter(name, estimator, description.joints, where=where, known=self._known)
        tvist.excess_at_limits = self._excess_at_limits(tvist, source)
        return tvist

    def _excess_at_limits(self, tvist: Filter, source: ModeSource) -> tuple[float, float]:
        """Return the filter's largest `excess_at_limits` for all payloads, cached because it takes long."""
        name, modes, own = tvist.name, tvist.estimator.modes, self._known.own.get(tvist.name)
        for known, same, named, with_modes, found in tuple(EXCESSES):
            if same is own and (named, with_modes) == (name, modes) and known == source:
                return found
        masses = (0.0, self._setup.description.limits.payload) if source.knows_payload else (0.0,)
        payloads = [paper_payload(self._setup.description, mass) for mass in masses]
        estimators = [source.estimator(modes, payload) for payload in payloads]
        found = excess_at_limits_of(tvist, estimators, self._setup.description)
        EXCESSES.append((source, own, name, modes, found))
        return found

    def _with_feed_forward(self, source: ModeSource, tvist: Filter, where: str) -> FilterChoice:
        """Add known friction and the feed-forward that a filter needs; raise RefusalError if impossible."""
        known = source if source.knows_payload else self._modal
        with _refusing(where):
            calibration = None if known is None else known.calibration
            law = known_friction(tvist, self._setup.description, calibration)
        if tvist.feed_forward == "rigid":
            return FilterChoice(source, tvist, None, law)
        if tvist.feed_forward == "elastic" and self._setup.positions:
            why = (
                f"{tvist.name} feeds torques forward, and this robot's controller takes positions only: choose one "
                "that shapes positions, such as auto, auto-target, zv or elastic-position"
            )
            raise RefusalError("out_of_range", where, why)
        if known is None or known.calibration is None:
            why = f"{tvist.name} needs the arm's springs: identify them with tvist identify"
            raise RefusalError("out_of_range", where, why)
        with _refusing(where, f"{tvist.name}: "):
            elastic = elastic_feed_forward(tvist, self._setup.description, known.calibration)
        return FilterChoice(source, tvist, elastic, law)


def _rehearse(tvist: Filter) -> None:
    """Run a copy of the filter on a small motion, so that no tick has to load the filter's code."""
    copy = tvist.fork()
    for tick in range(REHEARSED):
        copy.filter(np.full(tvist.joints, 1e-4 * tick))


@contextmanager
def _refusing(where: str, about: str = "", limit: float | None = None) -> Iterator[None]:
    """Make errors of the shaping library refusals of a field; `about` begins their message."""
    try:
        yield
    except ShapingError as error:
        code: Code = "unknown_shaper" if isinstance(error, UnknownShaperError) else "out_of_range"
        raise RefusalError(code, where, f"{about}{error}", limit) from error


def wanted_modes(name: str, modes: int, where: str, known: Registry = BUILT_IN) -> int:
    """Return the number of modes that a filter needs to suppress `modes`; `where` is the field of its name.

    Raise RefusalError if there is no such filter, or if it has a fixed number of modes.
    """
    with _refusing(where):
        own = known.modes_of(name, modes)
    if modes not in {1, own}:
        raise invalid("modes", modes, f"{own} for the filter {name}, or left out", own)
    return own


def make_estimator(source: ModeSource, modes: int, payload: Payload, where: str) -> Estimator:
    """Make the chosen estimator, or raise RefusalError if its source has fewer modes."""
    with _refusing(where, limit=source.most):
        return source.estimator(modes, payload)


def choose_filter(
    name: str, estimator: Estimator, joints: int, *, where: str = "shaper", known: Registry = BUILT_IN
) -> Filter:
    """Make a filter by its name; if that is impossible, raise RefusalError for the field `where`."""
    with _refusing(where):
        return known.make_filter(name, estimator, joints=joints)


def choose_source(command: SetEstimator, setup: Setup) -> ModeSource:
    """Return the source of modes for the requested estimator, or raise RefusalError."""
    if command.name == "fixed":
        return _fixed(command, setup)
    if command.name not in ESTIMATORS:
        must = f"one of {', '.join(ESTIMATORS)}"
        raise invalid("name", repr(command.name), must, code="unknown_estimator")
    for field in ("f_d", "zeta"):
        if getattr(command, field) is not None:
            raise invalid(field, "given", f"left out for the estimator {command.name}")
    calibration = _calibration(command, setup)
    if calibration.robot != setup.description.robot.model:
        must = f"{setup.description.robot.model!r}, this arm's model"
        raise invalid("calibration.robot", repr(calibration.robot), must)
    source = ModeSource("modal" if command.name == "modal" else "polynomial", setup.description, calibration)
    with _refusing("calibration", "calibration: "):
        source.estimator(1, setup.payload)
    return source


def _fixed(command: SetEstimator, setup: Setup) -> ModeSource:
    f_d, zeta = command.f_d, command.zeta
    if f_d is None or zeta is None:
        raise missing("f_d" if f_d is None else "zeta", "the estimator fixed needs f_d and zeta")
    if command.calibration is not None:
        raise invalid("calibration", "given", "left out for the estimator fixed")
    with _refusing("zeta"):
        Fixed(f_d, zeta)
    return ModeSource("fixed", setup.description, f_d=f_d, zeta=zeta)


def _calibration(command: SetEstimator, setup: Setup) -> Calibration:
    if isinstance(command.calibration, dict):
        try:
            return calibration_of(command.calibration)
        except ProtocolError as error:
            raise RefusalError(error.code, error.where, error.why, error.limit) from error
    own = setup.calibration
    if command.calibration is None and command.name == "modal":
        found = modal_source(setup.description, own)
        if found is not None and found.calibration is not None:
            return found.calibration
    if command.calibration is None or (own is not None and own.name == command.calibration):
        if own is None:
            raise missing("calibration", "give one, since this server was started without")
        return own
    if command.calibration not in available():
        must = f"one of {', '.join(available())}"
        raise invalid("calibration", repr(command.calibration), must, code="unknown_calibration")
    return load(command.calibration)


def excess_at_limits_of(
    tvist: Filter, estimators: Iterable[Estimator], description: RobotDescription
) -> tuple[float, float]:
    """Return the shares by which a filter's velocity and acceleration may exceed the reference's limits [-].

    While the mean delay D shrinks, velocity is 1 - Ḋ times the reference's, and acceleration contains (1 -
    Ḋ)² ẍ - ẋ D̈. Modes of a smooth estimator change quickest if all joints move at full speed in the worst
    direction. Modes of an abrupt one change at most as `TvistFilter` allows. Negative weights add at most
    what the acceleration limit permits within the filter's length. There is one of the `estimators` per
    payload.
    """
    limits, peak = arm_limits(description), tvist.peak
    reach = np.minimum(description.limits.position, np.pi)
    hastens = 0.0
    for estimator in estimators:
        random = np.random.default_rng(0)
        if tvist.mean_delay_of(*estimator.settle(np.zeros_like(reach))) is None:
            break
        for _ in range(POSTURES):
            try:
                hastens = max(
                    hastens, _hastens(tvist, estimator, random.uniform(-reach, reach), limits.velocity)
                )
            except FAILURES:  # a user's shaper reports this when it is used
                continue
    hastens *= MARGIN
    hardens = (2.0 + RISE * limits.velocity / limits.acceleration) * hastens + STEADY * tvist.excess
    negative = min(peak - 1.0, limits.acceleration * tvist.delay / (2.0 * limits.velocity))
    return (1.0 + hastens) * (1.0 + negative) - 1.0, (1.0 + hardens) * peak - 1.0


def _hastens(tvist: Filter, estimator: Estimator, q: Floats, velocity: float) -> float:
    """Return the largest -Ḋ at a posture and joint velocity [-]."""

    def delay(f_d: Floats, zeta: Floats) -> float:
        return tvist.mean_delay_of(f_d, zeta) or 0.0

    f_d, zeta = estimator.settle(q)
    if estimator.abrupt:
        higher, change = f_d * (1.0 + QUICKEST[0] * TIME), QUICKEST[1] * TIME
        least = min(delay(higher, np.maximum(zeta + sign * change, 0.0)) for sign in (-1.0, 1.0))
        return (delay(f_d, zeta) - least) / TIME
    steps = HALF_STEP * np.eye(len(q))
    ways = [
        abs(delay(*estimator.estimate(q + step)) - delay(*estimator.estimate(q - step))) for step in steps
    ]
    return sum(ways) * velocity / (2.0 * HALF_STEP)
