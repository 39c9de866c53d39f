"""Which filter shapes, and where it has its modes from: changed on the line, and watched."""

from tvist_protocol.values import Payload
from tvist_server.calibrations import fits
from tvist_server.cycle import ControlCycle
from tvist_server.events import Emit
from tvist_server.planning.basis import FilterBasis
from tvist_server.planning.filter_planner import FilterPlanner, PlannedFilter
from tvist_server.refusal import RefusalError
from tvist_server.setup import Setup
from tvist_shaping.base import Filter


class Filters:
    """The control line's filter.

    Args:
        setup: With the first shaper.
        planner: Makes filters.
        emit: Takes what happens.

    Raises:
        ValueError: There is no such shaper for this robot.
    """

    def __init__(self, setup: Setup, planner: FilterPlanner, emit: Emit) -> None:
        self._emit = emit
        self._clipped = False
        self.source = setup.source()
        """Where the filter's modes come from."""
        try:
            self.source, self.first = planner.choose(setup.shaper, 1, self.source, setup.payload)
        except RefusalError as error:
            raise ValueError(str(error)) from error
        planner.load()

    def attach(self, cycle: ControlCycle) -> None:
        """Say whose filter it is; it has the first one."""
        self._cycle = cycle

    def basis(self, declared: Payload) -> FilterBasis:
        """What another filter depends on.

        Args:
            declared: What the controller believes that the arm carries.
        """
        tvist = self._cycle.tvist
        return FilterBasis(tvist.name, tvist.estimator.modes, self.source, declared)

    def use(self, chosen: PlannedFilter) -> None:
        """Shape with it from now on."""
        before = self.source
        self.source, tvist = chosen
        self._cycle.use(tvist)
        self._emit("shaper_changed", why=f"{tvist.name} with estimator {self.source.name}")
        if self.source is not before:
            self.warn_of_arm()

    def declare(self, payload: Payload, tvist: Filter | None) -> None:
        """The arm carries something else: so it may have other modes.

        Args:
            payload: What the controller believes that it carries.
            tvist: The filter for it; None where its modes are not known to change.
        """
        if tvist is not None:
            self._cycle.use(tvist)
        self.warn_of_payload(payload)

    def warn_of_payload(self, declared: Payload) -> None:
        """Say that modes are of another payload, where they are."""
        calibration = self.source.calibration
        if calibration is not None and not fits(calibration, declared, self.source.name):
            self._emit(
                "warning",
                code="payload_mismatch",
                why=f"calibration {calibration.name!r} was made with "
                f"{calibration.payload.mass:g} kg; {declared.mass:g} kg is declared: "
                "frequencies will be off",
            )

    def warn_of_arm(self) -> None:
        """Say that modes are of another arm of the same model, where they are."""
        calibration = self.source.calibration
        if calibration is not None and self.source.fits_arm is False:
            why = (
                f"calibration {calibration.name!r} was measured on another arm than the robot file describes: "
                "frequencies will be off; tvist identify measures this one"
            )
            self._emit("warning", why=why)

    def watch(self) -> None:
        """Say when the filter cannot do what it should, once until it can again."""
        clipped = self._cycle.tvist.clipped
        if clipped and not self._clipped:
            name = self._cycle.tvist.name
            why = f"{name} cannot do here what it should: a delay is beyond what it holds, or more is left"
            self._emit("warning", code="out_of_range", why=why)
        self._clipped = clipped
