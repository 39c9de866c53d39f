"""A robot that is moved through its own controller: what that says becomes our state, and what it forbids is obeyed."""

from collections.abc import Callable

import msgspec

from tvist_controller.commands.events import Emit
from tvist_controller.commands.refusal import RefusalError
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.safety.safety_control import SafetyControl
from tvist_controller.safety.said import Said
from tvist_plant.plant import RealArm, Sight
from tvist_protocol.commands import Command, SetPayload
from tvist_protocol.io import Io, SetIo, SimulationSetInputs
from tvist_protocol.modes import SafetyMode

SAME_MASS = 0.05
"""Largest difference of two masses that count as equal [kg]."""


class Supervision(Said):
    """Follows one such robot.

    Args:
        plant: The robot.
        motion: The motion of our control line.
        safety: Our safety system.
        peripherals: See `Said`.
        set_tcp: See `Said`.
        emit: See `Said`.
    """

    def __init__(
        self,
        plant: RealArm,
        motion: MotionControl,
        safety: SafetyControl,
        peripherals: Peripherals,
        set_tcp: Callable[[tuple[float, ...]], None],
        emit: Emit,
    ) -> None:
        super().__init__(peripherals, set_tcp, emit)
        self._plant, self._motion, self._safety = plant, motion, safety

    def look(self) -> None:
        """Take what it has said since the last tick; to be called before each."""
        before, sight = self._sight, self._plant.seen()
        self._sight = sight
        self.tell(sight, before)
        if before is None or sight.slider != before.slider:
            self._scale(sight)
        if before is None or sight.modes[1] != before.modes[1]:
            self._obey(sight.modes[1])
        if before is not None and sight.payload != before.payload and sight.payload is not None:
            why = f"the robot was told another payload, {sight.payload.mass:.3g} kg: power off and on to check it"
            self._emit("warning", why=why)

    def check(self, command: Command) -> None:
        """Refuse what this server cannot do at the robot.

        Raises:
            RefusalError: It is asked to.
        """
        if isinstance(command, SetIo | SimulationSetInputs):
            why = "inputs and outputs are those of the robot, to which only set-points are sent: switch them there"
            raise RefusalError("wrong_mode", "", why)
        told = None if self._sight is None else self._sight.payload
        if isinstance(command, SetPayload) and told is not None and abs(command.mass - told.mass) > SAME_MASS:
            why = f"mass is {command.mass:.3g} kg, and the robot was told {told.mass:.3g} kg: tell it first"
            raise RefusalError("wrong_mode", "mass", why)

    def io(self, io: Io, *, force: bool) -> Io:
        """Return `io` with what the robot says of itself, apart from what clients set here."""
        kept = {name: getattr(io, name) for name in ("payload", "tcp_offset", "target_speed_fraction")}
        return msgspec.structs.replace(super().io(io, force=force), **kept)

    def _scale(self, sight: Sight) -> None:
        """Scale motions by the robot's speed slider."""
        slider, motions = 1.0 if sight.slider is None else sight.slider, self._motion.motions
        before = motions.wanted_speed
        motions.scale(slider)
        if motions.wanted_speed != before:
            self._emit(
                "warning", why=f"the speed slider of the robot is at {100.0 * slider:.0f} %: so are motions"
            )

    def _obey(self, mode: int) -> None:
        """Let our safety system be in the robot's safety mode; protective stops come with the halt that they cause."""
        system = self._motion.safety
        system.safeguard = mode == SafetyMode.SAFEGUARD_STOP
        system.emergencies.clear()
        if mode == SafetyMode.SYSTEM_EMERGENCY_STOP:
            system.emergencies.add("system")
        elif mode == SafetyMode.ROBOT_EMERGENCY_STOP:
            system.emergencies.add("robot")
        self._safety.reduce(reduced=mode == SafetyMode.REDUCED)
        self._motion.changed = True
