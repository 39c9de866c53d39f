"""Filters by the names that clients use."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.elastic_feed_forward import ElasticFeedForward
from tvist_controller.planning.choices import choose_filter, choose_source, make_estimator, wanted_modes
from tvist_controller.planning.snapshot import FilterState, Snapshot
from tvist_controller.planning.surplus import surplus_of
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup, paper_payload
from tvist_controller.sources.calibrations import elastic_feed_forward, known_friction
from tvist_controller.sources.mode_source import ModeSource, modal_source
from tvist_protocol.commands import SetEstimator
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter
from tvist_shaping.errors import EstimatorError
from tvist_shaping.named import AnyShaper

SURPLUSES = deque[tuple[ModeSource, AnyShaper | None, str, int, tuple[float, float]]](maxlen=32)
"""`surplus` of the latest filters of all robots: source of modes, own shaper, name, number of modes, what was found."""
REHEARSED = 9
"""Ticks of a rehearsal: some filters compute new weights at every fourth tick alone."""


@dataclass(frozen=True)
class PlannedFilter:
    """A filter with what it needs."""

    source: ModeSource
    """Source of its modes."""
    tvist: Filter
    """The filter."""
    elastic: ElasticFeedForward | None
    """Elastic feed-forward for the drives; None if the filter does without."""
    law: Floats | None = None
    """Known friction of the joints, see `known_friction`; None if it is not known."""


class FilterPlanner:
    """Creates the filters of one robot."""

    def __init__(self, setup: Setup) -> None:
        self._setup, self._known = setup, setup.registry
        self._modal = modal_source(setup.description, setup.calibration)

    def first(self) -> PlannedFilter:
        """Return the robot's initial filter.

        Raises:
            ValueError: There is no such shaper for this robot.
        """
        setup = self._setup
        try:
            return self.choose(setup.shaper, 1, setup.source(), setup.payload)
        except RefusalError as error:
            raise ValueError(str(error)) from error

    def choose(
        self, name: str, modes: int, source: ModeSource, declared: Payload, where: str = "shaper"
    ) -> PlannedFilter:
        """Return a filter by name, which comes from the field `where`, for a number of modes to suppress.

        It uses the source that was chosen, or the arm's own modal estimator if the filter needs more modes.

        Raises:
            RefusalError: There is no such filter for this robot.
        """
        wanted = wanted_modes(name, modes, where, self._known)
        if wanted > source.most and self._modal is not None:
            source = self._modal
        tvist = self._make(name, wanted, source, declared, where, "modes" if modes > 1 else where)
        _rehearse(tvist)
        return self._with_feed_forward(source, tvist, where)

    def estimate(self, command: SetEstimator, now: Snapshot) -> PlannedFilter:
        """Return the present filter with modes from another source.

        Raises:
            RefusalError: The source does not work with this filter.
        """
        source, present = choose_source(command, self._setup), now.filter
        where = "f_d" if source.calibration is None else "calibration"
        tvist = self._again(present, source, present.declared, where)
        _rehearse(tvist)
        return self._with_feed_forward(source, tvist, where)

    def with_payload(self, payload: Payload, present: FilterState) -> Filter | None:
        """Return the present filter with the modes for another payload; None if these are not known."""
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
        tvist.surplus = self._surplus(tvist, source)
        return tvist

    def _surplus(self, tvist: Filter, source: ModeSource) -> tuple[float, float]:
        """The filter's `surplus` with any payload. It takes long, so that it is kept for robots that are alike."""
        name, modes, own = tvist.name, tvist.estimator.modes, self._known.own.get(tvist.name)
        for known, same, named, with_modes, found in tuple(SURPLUSES):
            if same is own and (named, with_modes) == (name, modes) and known == source:
                return found
        masses = (0.0, self._setup.description.limits.payload) if source.knows_payload else (0.0,)
        payloads = [paper_payload(self._setup.description, mass) for mass in masses]
        estimators = [source.estimator(modes, payload) for payload in payloads]
        found = surplus_of(tvist, estimators, self._setup.description)
        SURPLUSES.append((source, own, name, modes, found))
        return found

    def _with_feed_forward(self, source: ModeSource, tvist: Filter, where: str) -> PlannedFilter:
        """Add friction and the feed-forward that a filter needs, of its source or else of the robot's calibration.

        Raises:
            RefusalError: The springs are not known, or the friction is wrong.
        """
        known = source if source.knows_payload else self._modal
        try:
            calibration = None if known is None else known.calibration
            law = known_friction(tvist, self._setup.description, calibration)
        except EstimatorError as error:
            raise RefusalError("out_of_range", where, str(error)) from error
        if tvist.feed_forward == "rigid":
            return PlannedFilter(source, tvist, None, law)
        if tvist.feed_forward == "elastic" and self._setup.positions:
            why = (
                f"{tvist.name} feeds torques forward, and this robot's controller takes positions only: choose one "
                "that shapes positions, such as auto, auto-target, zv or elastic-position"
            )
            raise RefusalError("out_of_range", where, why)
        if known is None or known.calibration is None:
            why = f"{tvist.name} needs the arm's springs: identify them with tvist identify --model modal"
            raise RefusalError("out_of_range", where, why)
        try:
            elastic = elastic_feed_forward(tvist, self._setup.description, known.calibration)
        except EstimatorError as error:
            raise RefusalError("out_of_range", where, f"{tvist.name}: {error}") from error
        return PlannedFilter(source, tvist, elastic, law)


def _rehearse(tvist: Filter) -> None:
    """Shape a small motion with a copy, so that a tick of the robot loads none of the code that the filter needs."""
    copy = tvist.fork()
    for tick in range(REHEARSED):
        copy.filter(np.full(tvist.joints, 1e-4 * tick))
