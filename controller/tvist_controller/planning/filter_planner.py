"""Filters by the names that clients give them."""

import numpy as np

from tvist_controller.choices import choose_filter, choose_source, make_estimator, wanted_modes
from tvist_controller.mode_source import ModeSource, modal_source
from tvist_controller.planning.basis import FilterBasis
from tvist_controller.refusal import RefusalError
from tvist_controller.setup import Setup
from tvist_protocol.commands import SetEstimator
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter
from tvist_shaping.estimators.base import Estimator

PlannedFilter = tuple[ModeSource, Filter]
"""Source of the modes, and the filter."""


class FilterPlanner:
    """Makes the filters of one robot.

    Args:
        setup: How the robot starts.
    """

    def __init__(self, setup: Setup) -> None:
        self._setup, self._known = setup, setup.registry
        self._modal = modal_source(setup.description, setup.calibration)

    def first(self) -> PlannedFilter:
        """The filter that the robot starts with. What is compiled when it is first used is compiled now.

        Raises:
            ValueError: There is no such shaper for this robot.
        """
        setup = self._setup
        try:
            chosen = self.choose(setup.shaper, 1, setup.source(), setup.payload)
        except RefusalError as error:
            raise ValueError(str(error)) from error
        if self._modal is not None:
            _, tvist = self.choose("auto", 1, self._modal, setup.payload)
            tvist.filter(np.zeros(setup.description.joints))
        return chosen

    def choose(
        self, name: str, modes: int, source: ModeSource, declared: Payload, where: str = "shaper"
    ) -> PlannedFilter:
        """A filter by its name.

        It has the estimator that was chosen, or the arm's own modal one where it takes that.

        Args:
            name: Name of the filter.
            modes: Number of modes to suppress.
            source: The estimator that was chosen.
            declared: What the controller believes that the arm carries.
            where: Field that the name comes from.

        Raises:
            RefusalError: There is none for this robot.
        """
        wanted = wanted_modes(name, modes, where, self._known)
        if wanted > source.most and self._modal is not None:
            source = self._modal
        estimator = make_estimator(source, wanted, declared, "modes" if modes > 1 else where)
        return source, self._make(name, estimator, where)

    def estimate(self, command: SetEstimator, basis: FilterBasis) -> PlannedFilter:
        """The present filter with modes from elsewhere.

        Raises:
            RefusalError: That is not possible.
        """
        source = choose_source(command, self._setup)
        where = "f_d" if source.calibration is None else "calibration"
        return source, self._again(basis, source, basis.declared, where)

    def with_payload(self, payload: Payload, basis: FilterBasis) -> Filter | None:
        """The present filter with the modes of the arm with another payload; None where they are not known."""
        return self._again(basis, basis.source, payload, "mass") if basis.source.knows_payload else None

    def present(self, basis: FilterBasis) -> Filter:
        """A filter like the present one, at rest at q = 0."""
        return self._again(basis, basis.source, basis.declared, "shaper")

    def _again(self, basis: FilterBasis, source: ModeSource, declared: Payload, where: str) -> Filter:
        estimator = make_estimator(source, basis.modes, declared, where)
        return self._make(basis.name, estimator, where)

    def _make(self, name: str, estimator: Estimator, where: str) -> Filter:
        joints = self._setup.description.joints
        return choose_filter(name, estimator, joints, where=where, known=self._known)
