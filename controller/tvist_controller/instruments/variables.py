"""RTDE's output variables as rows: name, type, source, meaning, and the function that reads a tick."""

from collections.abc import Callable
from math import sqrt
from operator import attrgetter, sub
from typing import Any, Final, Literal, NamedTuple

import numpy as np

from tvist_controller.instruments.motors import BUS_VOLTAGE
from tvist_controller.instruments.reading import Reading
from tvist_controller.instruments.rigid_body import add, carried, cross
from tvist_controller.instruments.wrench import (
    ACTUAL_Q,
    ACTUAL_QD,
    SHAPED,
    UNSHAPED,
    sensed_at_tool,
    since_zeroed,
    unshaped,
)
from tvist_plant.plant import GRAVITY
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode

START: Final = 40.0
"""Time of tick 0 on UR's interfaces; with a smaller one, clients believe that the robot is booting [s]."""
JOINT_MODES: dict[int, int] = {RobotMode.RUNNING: 253, RobotMode.POWER_OFF: 239, RobotMode.BACKDRIVE: 238}
"""RTDE's joint mode for each robot mode; the joints idle in all others."""
JOINT_IDLE: Final = 255
CONFIGURABLE: Final = 0xFF00  # bits 8–15, the configurable terminals
DEVIATION: Final = 0.05  # difference between measured and shaped angle that counts as a ratio of 1 [rad]
_STOPPED, _EMERGENCY = 1 << 10, 1 << 7
SAFETY_BITS: dict[int, int] = {
    SafetyMode.NORMAL: 1 << 0,
    SafetyMode.REDUCED: 1 << 1,
    SafetyMode.PROTECTIVE_STOP: 1 << 2 | _STOPPED,
    SafetyMode.RECOVERY: 1 << 3,
    SafetyMode.SAFEGUARD_STOP: 1 << 4 | _STOPPED,
    SafetyMode.SYSTEM_EMERGENCY_STOP: 1 << 5 | _EMERGENCY | _STOPPED,
    SafetyMode.ROBOT_EMERGENCY_STOP: 1 << 6 | _EMERGENCY | _STOPPED,
    SafetyMode.VIOLATION: 1 << 8 | _STOPPED,
    SafetyMode.FAULT: 1 << 9 | _STOPPED,
}  # bits of `safety_status_bits` for each safety mode
ORDER = (0, 3, 5, 1, 2, 4)  # places of Ixx Iyy Izz Ixy Ixz Iyz, UR's order, in the order of robot files
_RUNNING: set[int] = {
    RuntimeState.STOPPING, RuntimeState.PLAYING, RuntimeState.PAUSING, RuntimeState.RESUMING,
}  # fmt: skip

Read = Callable[[Reading], Any]


class Variable(NamedTuple):
    """An RTDE output variable other than registers."""

    name: str
    type: str  # RTDE's name of the type
    source: Literal["state", "io", "computed", "constant"]
    """State, io: contained in that message; RTDE reads io variables only when `Io` changes. Computed: from
    both. Constant: not simulated."""
    what: str  # description for the reference page
    read: Read


def _state(name: str, type_: str, what: str, read: Read | None = None) -> Variable:
    return Variable(name, type_, "state", what, read or attrgetter(f"state.{name}"))


def _io(name: str, type_: str, what: str, read: Read | None = None) -> Variable:
    return Variable(name, type_, "io", what, read or attrgetter(f"io.{name}"))


def _computed(name: str, type_: str, what: str, read: Read) -> Variable:
    return Variable(name, type_, "computed", what, read)


def entry(name: str, number: int) -> Read:
    """Return the function that reads an entry of a list of `Io`."""
    return lambda r: getattr(r.io, name)[number]


def _constant(name: str, type_: str, what: str, value: object = 0) -> Variable:
    return Variable(name, type_, "constant", what, lambda _: value)


# ---------------------------------------------------------------------- reading functions


def _runtime_state(r: Reading) -> int:
    moving = r.state.runtime_state
    match r.io.program_state:
        case "PLAYING":
            return RuntimeState.PLAYING
        case "PAUSED" if moving in {RuntimeState.STOPPING, RuntimeState.PAUSING}:
            return RuntimeState.PAUSING
        case "PAUSED":
            return RuntimeState.PAUSED
    return moving


def _speed_scaling(r: Reading) -> float:
    slider = r.io.target_speed_fraction
    stands = r.io.program_state == "PAUSED" or slider <= 0.0
    return 0.0 if stands else min(r.state.speed_scaling / slider, 1.0)


def _target_moment(r: Reading) -> list[float]:
    moment = r.state.target_moment
    if r.state.unshaped_q is None:
        return moment
    before, after = (r.rigid.moment(r.motion[rows], r.io.payload) for rows in (UNSHAPED, SHAPED))
    return [m + (u - s) for m, u, s in zip(moment, before, after, strict=True)]


def _target_current(r: Reading) -> list[float]:
    moments = r.target_moment if r.driven else [0.0] * len(r.ratings)
    return [m / rating.torque_constant for m, rating in zip(moments, r.ratings, strict=True)]


def _tool_acceleration(r: Reading) -> list[float]:
    linear: list[float] = (r.rotation @ np.array(r.state.actual_tool_accelerometer)).tolist()
    linear[2] -= GRAVITY
    alpha, offset = list[float](r.shaped[15:].tolist()), r.io.tcp_offset
    if any(offset[:3]):
        arm: list[float] = (r.rotation @ np.array(offset[:3])).tolist()
        linear = add(linear, carried(r.state.actual_TCP_speed[3:], alpha, arm))
    return linear + alpha


def _tool_force(r: Reading) -> list[float]:
    raw, zero = r.state.flange_wrench, r.io.tcp_force_zero
    if raw is None:
        return since_zeroed(r.estimate[:6].tolist(), zero)
    sensed = sensed_at_tool(np.array(raw), r.rotation, r.io.payload, zero, r.io.tcp_offset)
    return list(sensed.tolist())


def _force_from_currents(r: Reading) -> list[float]:
    force: list[float] = r.estimate[:6].tolist()
    return force if r.state.flange_wrench is not None else since_zeroed(force, r.io.tcp_force_zero)


def _raw_wrench(r: Reading) -> list[float]:
    if r.state.flange_wrench is not None:
        return r.state.flange_wrench
    payload, force = r.io.payload, r.estimate
    carries = [-payload.mass * felt for felt in r.state.actual_tool_accelerometer]
    pushes: list[float] = (force[:3] @ r.rotation).tolist()
    turns: list[float] = (force[3:6] @ r.rotation).tolist()
    torque = add(turns, add(cross(payload.com, carries), cross(r.io.tcp_offset, pushes)))
    return add(carries, pushes) + torque


def _collision_ratio(r: Reading) -> float:
    felt: list[float] = r.estimate[6:].tolist()
    return max(abs(torque) / rating.torque for torque, rating in zip(felt, r.ratings, strict=True))


def _length(vector: list[float]) -> float:
    x, y, z, *_ = vector
    return sqrt(x * x + y * y + z * z)


def _joint_mode(r: Reading) -> int:
    return JOINT_MODES.get(r.state.robot_mode, JOINT_IDLE)


# ---------------------------------------------------------------------- the rows
# fmt: off

_ROWS = (
    _state("target_q", "VECTOR6D", "reference before shaping, from the program or client [rad].",
           lambda r: unshaped(r.state)[0]),
    _state("target_qd", "VECTOR6D", "velocity of the reference before shaping [rad/s].",
           lambda r: unshaped(r.state)[1]),
    _state("target_qdd", "VECTOR6D", "acceleration of the reference before shaping [rad/s²].",
           lambda r: unshaped(r.state)[2]),

    # Time, modes and the controller's own figures.
    _state("timestamp", "DOUBLE", "tick time plus 40 s, for clients that wait until a robot has booted [s].",
           lambda r: START + r.state.timestamp),
    _state("control_step", "UINT64", "number of the control period.", lambda r: r.state.tick),
    _constant("actual_execution_time", "DOUBLE",
              "0; use telemetry for the duration of a tick, which differs between equal runs [ms].", 0.0),
    _constant("target_execution_time", "DOUBLE", "2, the control period [ms].", 2.0),
    _state("robot_mode", "INT32", "RTDE's number; 3 is POWER_OFF, 5 IDLE, 7 RUNNING."),
    _computed("joint_mode", "VECTOR6INT32",
              "from the robot's mode; 253 is running, 239 power off, 238 backdrive, 255 idle.",
              lambda r: [_joint_mode(r)] * len(r.state.target_q)),
    _state("safety_mode", "INT32",
           "RTDE's number; 1 is NORMAL, 2 REDUCED, 3 PROTECTIVE_STOP, 5 to 9 stops of the safety system."),
    _state("safety_status", "INT32", "the safety mode again; the additional numbers of RTDE do not occur.",
           lambda r: r.state.safety_mode),
    _computed("runtime_state", "UINT32",
              "state of the program, or of the motion if no program runs; 1 is STOPPED, 2 PLAYING, 4 PAUSED. "
              "A paused program whose arm still moves is PAUSING, 3.", _runtime_state),
    _computed("robot_status_bits", "UINT32",
              "from the modes; bit 0 is power on, bit 1 running; bits 2 and 3, of two buttons, are 0.",
              lambda r: int(r.powered) | (r.runtime_state in _RUNNING) << 1),
    _computed("safety_status_bits", "UINT32",
              "one bit per safety mode; stops also set bit 10, emergency stops bit 7.",
              lambda r: SAFETY_BITS.get(r.state.safety_mode, 0)),
    _computed("speed_scaling", "DOUBLE",
              "further speed factor besides the slider, as of reduced mode [-]; 0 while a program is paused.",
              _speed_scaling),
    _io("target_speed_fraction", "DOUBLE", "the speed slider [-]."),
    _constant("time_scale_source", "INT32", "0; the cause of slower motion is not reported."),
    _io("script_control_line", "UINT32",
        "line of the program, counted from 1; 0 if no program runs. It may be 0.1 s old.",
        lambda r: r.io.program_line),
    _constant("actual_main_voltage", "DOUBLE", "48, the safety board's supply [V].", BUS_VOLTAGE),
    Variable("actual_robot_voltage", "DOUBLE", "constant", "48 while the arm has power, else 0 [V].",
             lambda r: BUS_VOLTAGE if r.powered else 0.0),
    _computed("actual_robot_current", "DOUBLE",
              "power over voltage; power is 5 W per joint, the motors' heat and their mechanical power [A].",
              lambda r: r.power / BUS_VOLTAGE),
    _computed("actual_robot_energy_consumed", "DOUBLE",
              "integral of the power that the robot consumes, since the first tick [J].",
              attrgetter("consumed")),
    _computed("actual_robot_braking_energy_dissipated", "DOUBLE",
              "integral of the braking power that exceeds the motors' heat, since the first tick [J].",
              attrgetter("dissipated")),

    # Motion, torque and electricity of the joints.
    _state("shaped_q", "VECTOR6D", "reference after shaping, which the drives follow; only in TVIST [rad].",
           lambda r: r.state.target_q),
    _state("shaped_qd", "VECTOR6D", "velocity of the reference after shaping; only in TVIST [rad/s].",
           lambda r: r.state.target_qd),
    _state("shaped_qdd", "VECTOR6D", "acceleration of the reference after shaping; only in TVIST [rad/s²].",
           lambda r: r.state.target_qdd),
    _computed("target_moment", "VECTOR6D",
              "torque of the rigid model with the declared payload for the target motion [N m]: the state's "
              "torque, for the shaped reference, plus the difference between both references.",
              _target_moment),
    _computed("target_current", "VECTOR6D",
              "target torque over torque constant; zero while the brakes hold the arm [A].", _target_current),
    _state("actual_q", "VECTOR6D", "measured angle, on the link's side of the gear [rad]."),
    _state("actual_qd", "VECTOR6D", "measured velocity [rad/s]."),
    _computed("actual_current", "VECTOR6D",
              "measured torque over torque constant; zero while the brakes hold the arm [A].",
              attrgetter("current")),
    Variable("actual_current_window", "VECTOR6D", "constant",
             "allowed difference between both currents: a tenth of the joint's largest torque [A].",
             lambda r: [rating.window for rating in r.ratings]),
    _state("actual_current_as_torque", "VECTOR6D",
           "measured torque; zero while the brakes hold the arm [N m].",
           lambda r: r.state.actual_moment if r.driven else [0.0] * len(r.ratings)),
    _computed("joint_control_output", "VECTOR6D",
              "the measured currents, since simulated drives have no current error [A].",
              attrgetter("current")),
    Variable("actual_joint_voltage", "VECTOR6D", "constant", "48 while the arm has power, else 0 [V].",
             lambda r: [BUS_VOLTAGE if r.powered else 0.0] * len(r.ratings)),
    _computed("joint_temperatures", "VECTOR6D",
              "one body per joint in air of 25 °C, heated by its electronics and R i² in about 20 minutes [°C].",
              attrgetter("temperatures")),
    _computed("joint_position_deviation_ratio", "DOUBLE",
              "largest difference of measured and shaped angle, divided by 0.05 rad [-].",
              lambda r: max(map(abs, map(sub, r.state.actual_q, r.state.target_q))) / DEVIATION),

    # Motion and forces of tool and payload, in the base frame unless stated otherwise.
    _io("tcp_offset", "VECTOR6D", "tool centre point in the flange frame [m, rad]."),
    _state("actual_TCP_pose", "VECTOR6D", "TCP pose at the measured angles [m, rad]."),
    _state("actual_TCP_speed", "VECTOR6D", "TCP velocity from measured angles and velocities [m/s, rad/s]."),
    _state("actual_tool_accelerometer", "VECTOR3D",
           "specific force in the flange frame; at rest it points up with 9.81 [m/s²]."),
    _computed("target_TCP_pose", "VECTOR6D", "TCP pose at the target angles [m, rad].",
              lambda r: r.target[:6].tolist()),
    _computed("target_TCP_speed", "VECTOR6D", "TCP velocity from target angles and velocities [m/s, rad/s].",
              lambda r: r.target[6:12].tolist()),
    _computed("target_TCP_acceleration", "VECTOR6D",
              "TCP acceleration from target angles, velocities and accelerations [m/s², rad/s²].",
              lambda r: r.target[12:].tolist()),
    _computed("actual_TCP_acceleration", "VECTOR6D",
              "accelerometer's value without gravity, converted to base frame and TCP [m/s², rad/s²]. "
              "The angular acceleration is not measured but computed from the shaped reference.",
              _tool_acceleration),
    _computed("actual_TCP_force", "VECTOR6D",
              "force at the TCP from the flange's sensor, without the declared payload's weight [N, N m]. "
              "Without a sensor, it is estimated from the measured torques with the Jacobian. "
              "The torque of the shaped motion (rigid arm with the declared payload, rotors, friction) is "
              "subtracted first. Near a singularity, the unmeasurable part is omitted. It is zero while the arm "
              "is braked. In both cases, the force of `zero_ftsensor` is subtracted last.", _tool_force),
    _computed("tcp_force_scalar", "DOUBLE", "magnitude of the TCP force [N].",
              lambda r: _length(r.actual_TCP_force)),
    _computed("wrench_calc_from_currents", "VECTOR6D",
              "force at the TCP, estimated from the measured torques; see `actual_TCP_force` [N, N m].",
              _force_from_currents),
    _computed("ft_raw_wrench", "VECTOR6D",
              "wrench measured by the sensor between flange and payload, in the flange frame [N, N m]. "
              "Without a sensor, it is the weight and inertial force of the declared payload, from the "
              "accelerometer (neglecting rotation), plus the TCP force.", _raw_wrench),
    _computed("collision_detection_ratio", "DOUBLE",
              "largest deviation of measured from expected torque, as a share of a joint's torque limit [-].",
              _collision_ratio),
    _computed("actual_momentum", "DOUBLE",
              "magnitude of the measured linear momentum of links and declared payload [kg m/s].",
              lambda r: r.rigid.momentum(r.motion[ACTUAL_Q], r.motion[ACTUAL_QD], r.io.payload)),
    _computed("elbow_position", "VECTOR3D",
              "measured position of the elbow, where upper arm and forearm meet on its axis [m]. "
              "For an arm with fewer than three joints, it is the flange.", lambda r: r.elbow[0]),
    _computed("elbow_velocity", "VECTOR3D", "velocity of the elbow's position [m/s].", lambda r: r.elbow[1]),
    _io("payload", "DOUBLE", "declared mass [kg].", lambda r: r.io.payload.mass),
    _io("payload_cog", "VECTOR3D", "declared centre of mass in the flange frame [m].",
        lambda r: list(r.io.payload.com)),
    _io("payload_inertia", "VECTOR6D",
        "declared inertia about the centre of mass: xx yy zz xy xz yz [kg m²].",
        lambda r: [r.io.payload.inertia[place] for place in ORDER]),
    _constant("target_gravity", "VECTOR3D",
              "0 0 9.81, gravity as an equivalent acceleration of the base [m/s²].", [0.0, 0.0, GRAVITY]),
    _constant("target_base_acceleration", "VECTOR6D", "zero; the base does not move [m/s², rad/s²].", [0.0] * 6),
    _computed("target_base_wrench", "VECTOR6D",
              "force and torque at the base of the arm with the declared payload, for the target motion "
              "[N, N m]. The weight of the base itself is not included.",
              lambda r: r.rigid.base_wrench(r.motion[UNSHAPED], r.io.payload)),

    # Inputs and outputs, at the controller and in the tool.
    _io("actual_digital_input_bits", "UINT64",
        "digital inputs; bits 0–7 standard, 8–15 configurable, 16–17 tool."),
    _io("actual_digital_output_bits", "UINT64", "digital outputs, with the same bits."),
    _io("actual_configurable_digital_input_bits", "UINT64", "bits 8–15 of the digital inputs, not shifted.",
        lambda r: r.io.actual_digital_input_bits & CONFIGURABLE),
    _io("actual_configurable_digital_output_bits", "UINT64", "bits 8–15 of the digital outputs, not shifted.",
        lambda r: r.io.actual_digital_output_bits & CONFIGURABLE),
    _io("analog_io_types", "UINT32", "bits 0–1 analogue inputs, 2–3 outputs; 0 is current, 1 voltage."),
    *(_io(f"{name}{k}", "DOUBLE", f"analogue {kind} {k} [A or V].", entry(name, k))
      for kind, name in (("input", "standard_analog_input"), ("output", "standard_analog_output"))
      for k in (0, 1)),
    _constant("io_current", "DOUBLE", "0; the terminals' load is not simulated [mA].", 0.0),
    _computed("tool_mode", "UINT32", "from the robot's mode, with the numbers of `joint_mode`.", _joint_mode),
    _io("tool_analog_input_types", "UINT32",
        "types of the tool's analogue inputs, bits 0–1; 0 is current, 1 voltage."),
    *(_io(f"tool_analog_input{k}", "DOUBLE", f"analogue input {k} of the tool [A or V].",
          entry("tool_analog_input", k)) for k in (0, 1)),
    _io("tool_output_voltage", "INT32", "voltage of the tool's supply; 0 if it is off [V]."),
    _constant("tool_output_current", "DOUBLE", "0; the tool's load is not simulated [mA].", 0.0),
    _computed("tool_temperature", "DOUBLE",
              "temperature of the last joint, which holds the tool's electronics [°C].",
              lambda r: r.temperatures[-1]),
    _io("tool_output_mode", "UINT8", "0, the tool's outputs are digital; 1, they are a second supply."),
    *(_io(f"tool_digital_output{k}_mode", "UINT8", "1, the output sinks; 2, it sources; 3, both.")
      for k in (0, 1)),
    _constant("euromap67_input_bits", "UINT32", "0; no Euromap 67 interface is fitted."),
    _constant("euromap67_output_bits", "UINT32", "0; no Euromap 67 interface is fitted."),
    _constant("euromap67_24V_voltage", "DOUBLE", "0; no Euromap 67 interface is fitted [V].", 0.0),
    _constant("euromap67_24V_current", "DOUBLE", "0; no Euromap 67 interface is fitted [mA].", 0.0),
    *(_constant(f"encoder{k}_raw", "INT32", "0; no conveyor's encoder is connected.") for k in (0, 1)),
)
# fmt: on

VARIABLES = {row.name: row for row in _ROWS}
"""Output variables of RTDE other than registers, in the order of the reference page."""
