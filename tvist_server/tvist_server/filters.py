"""Which filter shapes, and where it has its modes from: chosen by name, changed with the payload, watched."""

import numpy as np

from tvist_protocol.commands import SetEstimator
from tvist_protocol.values import Payload
from tvist_server.calibrations import fits
from tvist_server.choices import choose_filter, choose_source, make_estimator, wanted_modes
from tvist_server.cycle import ControlCycle
from tvist_server.events import Emit
from tvist_server.mode_source import ModeSource, modal_source
from tvist_server.refusal import RefusalError
from tvist_server.setup import Setup
from tvist_shaping.base import Filter


class Filters:
    """Chooses the control line's filter.

    Args:
        setup: With the first shaper.
        emit: Takes what happens.

    Raises:
        ValueError: There is no such shaper for this robot.
    """

    def __init__(self, setup: Setup, emit: Emit) -> None:
        self._setup = setup
        self._emit = emit
        self._clipped = False
        self.source = setup.source()
        """Where the filter's modes come from."""
        self._modal = modal_source(setup.description, setup.calibration)
        try:
            self.source, self.first = self._choose(setup.shaper, self.source, 1, setup.payload, "shaper")
        except RefusalError as error:
            raise ValueError(str(error)) from error
        if self._modal is not None:  # what it takes is compiled code, which lasts many ticks to load: now
            _, tvist = self._choose("auto", self._modal, 1, setup.payload, "shaper")
            tvist.filter(np.zeros(setup.description.joints))

    def attach(self, cycle: ControlCycle) -> None:
        """Say whose filter it is; it has the first one."""
        self._cycle = cycle

    def choose(
        self, name: str, declared: Payload, modes: int = 1, where: str = "shaper"
    ) -> tuple[ModeSource, Filter]:
        """A filter by its name, for `use`.

        It has the estimator that was chosen, or the arm's own modal one where it takes that.

        Raises:
            RefusalError: There is none for this robot.
        """
        return self._choose(name, self.source, modes, declared, where)

    def use(self, chosen: tuple[ModeSource, Filter]) -> None:
        """Shape with it from now on."""
        self.source, tvist = chosen
        self._cycle.use(tvist)
        self._emit("shaper_changed", why=f"{tvist.name} with estimator {self.source.name}")

    def estimate(self, command: SetEstimator, declared: Payload) -> tuple[ModeSource, Filter]:
        """The present filter with modes from elsewhere, for `use`.

        Raises:
            RefusalError: That is not possible.
        """
        source, present = choose_source(command, self._setup), self._cycle.tvist
        where = "f_d" if source.calibration is None else "calibration"
        estimator = make_estimator(source, present.estimator.modes, declared, where)
        return source, choose_filter(present.name, estimator, self._setup.description.joints, where=where)

    def with_payload(self, payload: Payload) -> Filter | None:
        """The present filter with the modes of the arm with another payload; None where they are not known."""
        if not self.source.knows_payload:
            return None
        present = self._cycle.tvist
        return present.with_estimator(self.source.estimator(present.estimator.modes, payload))

    def declare(self, payload: Payload, tvist: Filter | None) -> None:
        """The arm carries something else: so it may have other modes.

        Args:
            payload: What the controller believes that it carries.
            tvist: The filter for it, from `with_payload`.
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

    def watch(self) -> None:
        """Say when the filter cannot do what it should, once until it can again."""
        clipped = self._cycle.tvist.clipped
        if clipped and not self._clipped:
            name = self._cycle.tvist.name
            why = f"{name} cannot do here what it should: a delay is beyond what it holds, or more is left"
            self._emit("warning", code="out_of_range", why=why)
        self._clipped = clipped

    def _choose(
        self, name: str, source: ModeSource, modes: int, declared: Payload, where: str
    ) -> tuple[ModeSource, Filter]:
        wanted = wanted_modes(name, modes, where)
        if wanted > source.most and self._modal is not None:
            source = self._modal
        estimator = make_estimator(source, wanted, declared, "modes" if modes > 1 else where)
        return source, choose_filter(name, estimator, self._setup.description.joints, where=where)
