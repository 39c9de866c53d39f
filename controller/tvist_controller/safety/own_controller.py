"""A robot that its own controller moves: takes over that controller's reports and safety state."""

import msgspec

from tvist_controller.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.line_tick import Sample
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.refusal import invalid, wrong_mode
from tvist_controller.safety.robot_modes import RobotModes
from tvist_controller.safety.safety_control import SafetyControl
from tvist_controller.setup import payload_of
from tvist_plant.plant import PlantError, RealArm, RobotReport
from tvist_protocol.commands import Command, SetPayload
from tvist_protocol.io import Io, SetIo, SimulationSetInputs
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.values import Payload

REFUSED = (
    "the robot is only watched: its own controller moves and stops it, and nothing is sent to it from here; command it "
    "at its own interfaces or its teach pendant, or serve it with --enable-motion"
)  # refusal of commands that affect a watched arm
_NO_STOP = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED, SafetyMode.UNDEFINED})
SAME_MASS = 0.05  # mass difference below which masses count as equal [kg]


class RemoteStatus:
    """Mirrors the reports of the robot's own controller, cycle by cycle."""

    def __init__(self, plant: RealArm, peripherals: Peripherals, emit: Emit) -> None:
        self._plant, self._peripherals, self._emit = plant, peripherals, emit
        self._report: RobotReport | None = None
        self._io: tuple[object, ...] = ()

    @property
    def missed(self) -> int:
        """Number of lost cycles."""
        return 0 if self._report is None else self._report.missed

    def tell(self, report: RobotReport, before: RobotReport | None) -> None:
        """Emit a report's warnings and take over its tool; `before` is the previous report."""
        for why in report.told:
            self._emit("warning", why=why)
        if report.tool is not None and (before is None or report.tool != before.tool):
            self._peripherals.set_tcp(report.tool)
        io = report.payload, report.tool, report.slider, report.inputs, report.outputs
        if io != self._io:
            self._io, self._peripherals.changed = io, True

    def declared(self, payload: Payload) -> Payload:
        """Return the payload set on the robot, or `payload` if not reported."""
        if self._report is None or self._report.payload is None:
            return payload
        return payload_of(self._report.payload)

    def io(self, io: Io, *, force: bool) -> Io:
        """Return `io` with the robot's own values, and its tool force if wanted."""
        if (report := self._report) is None:
            return io
        given = {
            "payload": self.declared(io.payload),
            "target_speed_fraction": io.target_speed_fraction if report.slider is None else report.slider,
            "actual_digital_input_bits": report.inputs,
            "actual_digital_output_bits": report.outputs,
            "actual_TCP_force": list(report.force) if force and report.force is not None else None,
        }
        return msgspec.structs.replace(io, **given)


class Watching(RemoteStatus):
    """Follows a robot that tvist only watches and does not move."""

    def __init__(
        self, plant: RealArm, peripherals: Peripherals, emit: Emit, cycle: ControlCycle, modes: RobotModes
    ) -> None:
        super().__init__(plant, peripherals, emit)
        self._cycle, self._modes = cycle, modes
        modes.now = int(RobotMode.DISCONNECTED), int(SafetyMode.UNDEFINED), int(RuntimeState.STOPPED)

    def look(self) -> int | None:
        """Take the next report and return its tick; None without one. `tell_cycle` then emits the changes."""
        self._before = self._report
        try:
            self._report = self._plant.cycle_report()
        except PlantError as error:
            self._emit("warning", why=str(error))
            return None
        return self._report.tick

    def tell_cycle(self) -> None:
        """Emit the changes of the present cycle."""
        report, before = self._report, self._before
        if report is None or report is before:
            return
        self.tell(report, before)
        _, safety, _ = self._modes.now = report.modes
        if before is not None and safety != before.modes[1]:
            name = SafetyMode(safety).name if safety in set(SafetyMode) else safety
            why = f"the robot reports safety_mode {name}"
            # Not a `protective_stop`: that could be unlocked by clients, this one only at the robot.
            self._emit("warning" if safety in _NO_STOP else "safety_stop", why=why)

    def sample(self) -> Sample:
        """Return the signals of the present cycle."""
        report = self._report
        return self._cycle.sample if report is None else self._cycle.follow(report.target, report.measured)

    @property
    def speed(self) -> float:
        """Fraction of the programmed speed [-]."""
        return 0.0 if self._report is None else self._report.speed


class Supervision(RemoteStatus):
    """Follows an arm tvist moves through the manufacturer's controller; `motion` and `safety` are tvist's."""

    def __init__(
        self,
        plant: RealArm,
        peripherals: Peripherals,
        emit: Emit,
        motion: MotionControl,
        safety: SafetyControl,
    ) -> None:
        super().__init__(plant, peripherals, emit)
        self._motion, self._safety = motion, safety

    def look(self) -> None:
        """Take the reports since the last tick; call before each tick."""
        before, report = self._report, self._plant.latest_report()
        self._report = report
        self.tell(report, before)
        if before is None or report.slider != before.slider:
            self._scale(report)
        if before is None or report.modes[1] != before.modes[1]:
            self._obey(report.modes[1])
        if before is not None and report.payload != before.payload and report.payload is not None:
            why = f"another payload was set on the robot, {report.payload.mass:.3g} kg: power off and on to check it"
            self._emit("warning", why=why)

    def check(self, command: Command) -> None:
        """Raise RefusalError for commands that this server cannot apply to the robot."""
        if isinstance(command, SetIo | SimulationSetInputs):
            raise wrong_mode(
                "inputs and outputs are those of the robot, to which only set-points are sent: switch them there"
            )
        told = None if self._report is None else self._report.payload
        if isinstance(command, SetPayload) and told is not None and abs(command.mass - told.mass) > SAME_MASS:
            must = f"{told.mass:.3g} kg, as set on the robot; to change it, set it there first"
            raise invalid("mass", f"{command.mass:.3g} kg", must, code="wrong_mode")

    def io(self, io: Io, *, force: bool) -> Io:
        """Return `io` with the robot's own values, except what clients set here."""
        kept = {name: getattr(io, name) for name in ("payload", "target_speed_fraction")}
        return msgspec.structs.replace(super().io(io, force=force), **kept)

    def _scale(self, report: RobotReport) -> None:
        slider, motions = 1.0 if report.slider is None else report.slider, self._motion.motions
        before = motions.wanted_speed
        motions.scale(slider)
        if motions.wanted_speed != before:
            self._emit(
                "warning", why=f"the speed slider of the robot is at {100.0 * slider:.0f} %: so are motions"
            )

    def _obey(self, mode: int) -> None:
        """Take over the robot's safety mode, except protective stops, which `Condition.halt` reports."""
        system = self._motion.safety
        system.safeguard = mode == SafetyMode.SAFEGUARD_STOP
        system.emergencies.clear()
        if mode == SafetyMode.SYSTEM_EMERGENCY_STOP:
            system.emergencies.add("system")
        elif mode == SafetyMode.ROBOT_EMERGENCY_STOP:
            system.emergencies.add("robot")
        self._safety.reduce(reduced=mode == SafetyMode.REDUCED)
        self._motion.changed = True
