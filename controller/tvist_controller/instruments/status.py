"""Time, modes and the controller's own figures."""

from typing import Final

from tvist_controller.instruments.ratings import BUS_VOLTAGE
from tvist_controller.instruments.reading import Reading
from tvist_controller.instruments.variables import Double, Int32, Uint32, Uint64, Vector6Int32
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode

START: Final = 40.0
"""Time of tick 0 on UR's interfaces [s]; a smaller time makes clients believe that the robot is still booting."""
JOINT_MODES: Final[dict[int, int]] = {
    RobotMode.RUNNING: 253,
    RobotMode.POWER_OFF: 239,
    RobotMode.BACKDRIVE: 238,
}
"""RTDE's joint mode for each robot mode; in all others the joints idle."""
JOINT_IDLE: Final = 255

_STOPPED_BY_SAFETY = 1 << 10
_EMERGENCY = 1 << 7
_SAFETY_BITS: dict[int, int] = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.REDUCED: 1 << 1,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | _STOPPED_BY_SAFETY,
    SafetyMode.RECOVERY: 1 << 3,
    SafetyMode.SAFEGUARD_STOP: 1 << 4 | _STOPPED_BY_SAFETY,
    SafetyMode.SYSTEM_EMERGENCY_STOP: 1 << 5 | _EMERGENCY | _STOPPED_BY_SAFETY,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | _EMERGENCY | _STOPPED_BY_SAFETY,
    SafetyMode.VIOLATION: 1 << 8 | _STOPPED_BY_SAFETY,
    SafetyMode.FAULT: 1 << 9 | _STOPPED_BY_SAFETY,
}
_RUNNING: set[int] = {
    RuntimeState.STOPPING,
    RuntimeState.PLAYING,
    RuntimeState.PAUSING,
    RuntimeState.RESUMING,
}


class StatusValues(Reading):
    """State of the controller and its arm."""

    @property
    def timestamp(self) -> Double:
        """State: tick time plus 40 s, for clients that wait until a robot has booted [s]."""
        return START + self.state.timestamp

    @property
    def control_step(self) -> Uint64:
        """State: number of the control period."""
        return self.state.tick

    @property
    def actual_execution_time(self) -> Double:
        """Constant: 0; telemetry has the duration of a tick, which differs between equal runs [ms]."""
        return 0.0

    @property
    def target_execution_time(self) -> Double:
        """Constant: 2, the control period [ms]."""
        return 2.0

    @property
    def robot_mode(self) -> Int32:
        """State: RTDE's number; 3 is POWER_OFF, 5 IDLE, 7 RUNNING."""
        return self.state.robot_mode

    @property
    def joint_mode(self) -> Vector6Int32:
        """Computed: from the robot's mode; 253 is running, 239 power off, 238 backdrive, 255 idle."""
        mode = JOINT_MODES.get(self.state.robot_mode, JOINT_IDLE)
        return [mode] * len(self.state.target_q)

    @property
    def safety_mode(self) -> Int32:
        """State: RTDE's number; 1 is NORMAL, 2 REDUCED, 3 PROTECTIVE_STOP, 5 to 9 stops of the safety system."""
        return self.state.safety_mode

    @property
    def safety_status(self) -> Int32:
        """State: the safety mode again; the additional numbers of RTDE do not occur."""
        return self.state.safety_mode

    @property
    def runtime_state(self) -> Uint32:
        """Computed: that of the program; of the motion if no program runs; 1 is STOPPED, 2 PLAYING, 4 PAUSED.

        A paused program whose arm still moves is PAUSING, 3.
        """
        moving = self.state.runtime_state
        match self.io.program_state:
            case "PLAYING":
                return RuntimeState.PLAYING
            case "PAUSED" if moving in {RuntimeState.STOPPING, RuntimeState.PAUSING}:
                return RuntimeState.PAUSING
            case "PAUSED":
                return RuntimeState.PAUSED
        return moving

    @property
    def robot_status_bits(self) -> Uint32:
        """Computed: from the modes; bit 0 is power on, bit 1 running; bits 2 and 3, of two buttons, are 0."""
        return int(self.powered) | (self.runtime_state in _RUNNING) << 1

    @property
    def safety_status_bits(self) -> Uint32:
        """Computed: from the safety mode, which has a bit of its own; stops also set bit 10, emergency stops bit 7."""
        return _SAFETY_BITS.get(self.state.safety_mode, 0)

    @property
    def speed_scaling(self) -> Double:
        """Computed: what limits the speed besides the slider, as reduced mode does [-]; 0 while a program is paused."""
        if self.io.program_state == "PAUSED":
            return 0.0
        slider = self.io.target_speed_fraction
        return min(self.state.speed_scaling / slider, 1.0) if slider > 0.0 else 0.0

    @property
    def target_speed_fraction(self) -> Double:
        """Io: the speed slider [-]."""
        return self.io.target_speed_fraction

    @property
    def time_scale_source(self) -> Int32:
        """Constant: 0; the cause of a slower motion is not distinguished."""
        return 0

    @property
    def script_control_line(self) -> Uint32:
        """Io: line of the program, counted from 1; 0 if no program runs. It is up to date to a tenth of a second."""
        return self.io.program_line

    @property
    def actual_main_voltage(self) -> Double:
        """Constant: 48, the safety board's supply [V]."""
        return BUS_VOLTAGE

    @property
    def actual_robot_voltage(self) -> Double:
        """Constant: 48 while the arm has power, else 0 [V]."""
        return BUS_VOLTAGE if self.powered else 0.0

    @property
    def actual_robot_current(self) -> Double:
        """Computed: power over voltage; power is 5 W per joint, the motors' heat and their mechanical power [A]."""
        return self._power / BUS_VOLTAGE

    @property
    def actual_robot_energy_consumed(self) -> Double:
        """Computed: integral of the power that the robot consumes, since the first tick [J]."""
        return self._consumed

    @property
    def actual_robot_braking_energy_dissipated(self) -> Double:
        """Computed: integral of the braking power that exceeds the motors' heat, since the first tick [J]."""
        return self._dissipated
