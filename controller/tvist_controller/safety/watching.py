"""A robot that is only watched: its own controller moves it, and what that says becomes our state."""

from collections.abc import Callable
from enum import IntEnum

import msgspec

from tvist_controller.commands.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.sample import Sample
from tvist_controller.safety.robot_modes import RobotModes
from tvist_plant.plant import PlantError, Sight, Watched
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.values import Payload

REFUSED = (
    "the robot is only watched: its own controller moves and stops it, and nothing is sent to it from here; command it "
    "at its own interfaces or its teach pendant"
)
"""Why a command is refused that would concern the arm."""
_NO_STOP = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED, SafetyMode.UNDEFINED})


class Watching:
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
        plant: Watched,
        cycle: ControlCycle,
        modes: RobotModes,
        peripherals: Peripherals,
        set_tcp: Callable[[tuple[float, ...]], None],
        emit: Emit,
    ) -> None:
        self._plant, self._cycle, self._modes, self._peripherals = plant, cycle, modes, peripherals
        self._set_tcp, self._emit = set_tcp, emit
        self._sight: Sight | None = None
        self._io: tuple[object, ...] = ()
        modes.now = int(RobotMode.DISCONNECTED), int(SafetyMode.UNDEFINED), int(RuntimeState.STOPPED)

    @property
    def missed(self) -> int:
        """Number of the robot's cycles that did not arrive."""
        return 0 if self._sight is None else self._sight.missed

    def look(self) -> int | None:
        """Take what the robot said in its next cycle; return the number of its tick, None if it has said nothing.

        `tell` then reports what has changed, once the tick has this number.
        """
        self._before = self._sight
        try:
            self._sight = self._plant.sight()
        except PlantError as error:
            self._emit("warning", why=str(error))
            return None
        return self._sight.tick

    def tell(self) -> None:
        """Emit what the present cycle has changed."""
        sight, before = self._sight, self._before
        if sight is None or sight is before:
            return
        for why in sight.told:
            self._emit("warning", why=why)
        _, safety, _ = self._modes.now = sight.modes
        if before is not None and safety != before.modes[1]:
            why = f"the robot reports safety_mode {_name(SafetyMode, safety)}"
            # A `protective_stop` would let clients unlock it, which can be done at the robot only.
            self._emit("warning" if safety in _NO_STOP else "safety_stop", why=why)
        if sight.tool is not None and (before is None or sight.tool != before.tool):
            self._set_tcp(sight.tool)
        io = sight.payload, sight.tool, sight.slider, sight.inputs, sight.outputs
        if io != self._io:
            self._io, self._peripherals.changed = io, True

    def sample(self) -> Sample:
        """Return the signals of the present cycle."""
        sight = self._sight
        return self._cycle.sample if sight is None else self._cycle.follow(sight.target, sight.measured)

    @property
    def speed(self) -> float:
        """Share of the programmed speed [-]."""
        return 0.0 if self._sight is None else self._sight.speed

    def declared(self, payload: Payload) -> Payload:
        """Return the payload that the robot was told; `payload` if it does not say."""
        if self._sight is None or self._sight.payload is None:
            return payload
        told = self._sight.payload
        return Payload(mass=told.mass, com=told.com, inertia=told.inertia)

    def io(self, io: Io, *, force: bool) -> Io:
        """Return `io` with what the robot says of itself; its force at the tool only if that is wanted."""
        sight = self._sight
        if sight is None:
            return io
        given = {
            "payload": self.declared(io.payload),
            "tcp_offset": io.tcp_offset if sight.tool is None else list(sight.tool),
            "target_speed_fraction": io.target_speed_fraction if sight.slider is None else sight.slider,
            "actual_digital_input_bits": sight.inputs,
            "actual_digital_output_bits": sight.outputs,
            "actual_TCP_force": list(sight.force) if force and sight.force is not None else None,
        }
        return msgspec.structs.replace(io, **given)


def _name(kind: type[IntEnum], number: int) -> str:
    return kind(number).name if number in {member.value for member in kind} else str(number)
