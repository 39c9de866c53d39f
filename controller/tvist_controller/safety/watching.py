"""A robot that is only watched: its own controller moves it, and what that says becomes our state."""

from collections.abc import Callable
from enum import IntEnum

from tvist_controller.commands.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.sample import Sample
from tvist_controller.safety.robot_modes import RobotModes
from tvist_controller.safety.said import Said
from tvist_plant.plant import PlantError, RealArm
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode

REFUSED = (
    "the robot is only watched: its own controller moves and stops it, and nothing is sent to it from here; command it "
    "at its own interfaces or its teach pendant, or serve it with --enable-motion"
)
"""Why a command is refused that would concern the arm."""
_NO_STOP = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED, SafetyMode.UNDEFINED})


class Watching(Said):
    """Follows one such robot.

    Args:
        plant: The robot.
        cycle: The control line, which only carries its signals.
        modes: Where its modes are told.
        peripherals: Told when its inputs and outputs change.
        set_tcp: Told its tool centre point.
        emit: Emits events.
    """

    def __init__(
        self,
        plant: RealArm,
        cycle: ControlCycle,
        modes: RobotModes,
        peripherals: Peripherals,
        set_tcp: Callable[[tuple[float, ...]], None],
        emit: Emit,
    ) -> None:
        super().__init__(peripherals, set_tcp, emit)
        self._plant, self._cycle, self._modes = plant, cycle, modes
        modes.now = int(RobotMode.DISCONNECTED), int(SafetyMode.UNDEFINED), int(RuntimeState.STOPPED)

    def look(self) -> int | None:
        """Take what the robot said in its next cycle; return the number of its tick, None if it has said nothing.

        `tell_cycle` then reports what has changed, once the tick has this number.
        """
        self._before = self._sight
        try:
            self._sight = self._plant.sight()
        except PlantError as error:
            self._emit("warning", why=str(error))
            return None
        return self._sight.tick

    def tell_cycle(self) -> None:
        """Emit what the present cycle has changed."""
        sight, before = self._sight, self._before
        if sight is None or sight is before:
            return
        self.tell(sight, before)
        _, safety, _ = self._modes.now = sight.modes
        if before is not None and safety != before.modes[1]:
            why = f"the robot reports safety_mode {_name(SafetyMode, safety)}"
            # A `protective_stop` would let clients unlock it, which can be done at the robot only.
            self._emit("warning" if safety in _NO_STOP else "safety_stop", why=why)

    def sample(self) -> Sample:
        """Return the signals of the present cycle."""
        sight = self._sight
        return self._cycle.sample if sight is None else self._cycle.follow(sight.target, sight.measured)

    @property
    def speed(self) -> float:
        """Share of the programmed speed [-]."""
        return 0.0 if self._sight is None else self._sight.speed


def _name(kind: type[IntEnum], number: int) -> str:
    return kind(number).name if number in {member.value for member in kind} else str(number)
