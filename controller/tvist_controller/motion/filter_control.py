"""The control line's filter and the source of its modes: changes and supervision."""

from tvist_controller.calibrations import fits
from tvist_controller.commands.events import Emit
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.planning.filter_planner import PlannedFilter
from tvist_controller.planning.snapshot import FilterState
from tvist_controller.sources.mode_source import ModeSource
from tvist_protocol.values import Payload
from tvist_shaping.base import Filter


class Filters:
    """The control line's filter; a new one must not spoil the robot's motion."""

    def __init__(self, motion: MotionControl, source: ModeSource, declared: Payload, emit: Emit) -> None:
        self._motion, self._cycle, self._emit = motion, motion.cycle, emit
        self._declared = self._given = declared
        self.source = source
        """Source of the filter's modes."""
        self._warn_of_payload()
        self._warn_of_arm()

    @property
    def present(self) -> FilterState:
        """The present state that a new filter depends on."""
        tvist = self._cycle.tvist
        return FilterState(tvist.name, tvist.estimator.modes, self.source, self._declared, self._given)

    def use(self, chosen: PlannedFilter) -> None:
        """Shape with a filter from now on."""
        before, idle = self.source, self._idle
        self.source, tvist = chosen.source, chosen.tvist
        self._cycle.drives.compensate(chosen.law)
        self._cycle.use(tvist, chosen.elastic)
        self._motion.motions.keep_rate()
        self._emit("shaper_changed", why=f"{tvist.name} with estimator {self.source.name}")
        if self.source is not before:
            self._warn_of_arm()
        if idle:
            self._warn_of_payload()

    def choose(self, chosen: PlannedFilter) -> None:
        """Shape with a filter from now on, unless the rest of the motion would not be clear with it."""
        self._motion.ahead.check_filter(chosen.tvist)
        self.use(chosen)

    def estimate(self, chosen: PlannedFilter) -> None:
        """Shape with other modes from now on; else as `choose`."""
        self.choose(chosen)
        self._warn_of_payload()

    def declare(self, payload: Payload, tvist: Filter | None, *, found: bool = False) -> None:
        """Take another payload into account, which may change the arm's modes.

        The filter is None if its modes are not known to differ. The robot has `found` the payload, or it is
        declared.
        """
        self._declared = payload
        self._given = self._given if found else payload
        if tvist is not None:
            self._cycle.use(tvist, self._cycle.drives.wanted)
            self._motion.motions.keep_rate()
        self._warn_of_payload()

    @property
    def _idle(self) -> bool:
        """True if there is no shaper, so that the modes do not matter."""
        return self._cycle.tvist.name == "none"

    def _warn_of_payload(self) -> None:
        """Warn if a shaper uses modes that belong to another payload."""
        declared, word = self._declared, "declared" if self._declared == self._given else "carried"
        calibration = self.source.calibration
        if not self._idle and calibration is not None and not fits(calibration, declared, self.source.name):
            self._emit(
                "warning",
                code="payload_mismatch",
                why=f"calibration {calibration.name!r} was made with "
                f"{calibration.payload.mass:g} kg; {declared.mass:g} kg is {word}: "
                "the shaper's frequencies will be wrong. Take a modal calibration, which knows any payload, or "
                "identify the arm with this one",
            )

    def _warn_of_arm(self) -> None:
        """Warn if the modes belong to another arm of the same model."""
        calibration = self.source.calibration
        if calibration is not None and self.source.fits_arm is False:
            why = (
                f"calibration {calibration.name!r} was measured on a different arm than the one in the robot file: "
                "the shaper's frequencies will be wrong; measure this arm with tvist identify"
            )
            self._emit("warning", why=why)
