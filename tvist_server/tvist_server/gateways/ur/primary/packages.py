"""Robot state: the package of type 16, 1386 bytes in thirteen parts, as of a controller with software 5.

int32 length, uint8 16, then the parts: uint32 length (including itself), uint8 number, body; big-endian.
"""

from struct import Struct, pack
from typing import Final

from tvist_controller.instruments.snapshot import Snapshot
from tvist_plant.description import RobotDescription
from tvist_protocol.modes import RuntimeState, SafetyMode
from tvist_server.gateways.ur import messages
from tvist_server.ur_model import series
from tvist_server.ur_ports import MOST_JOINTS

MOTION_DEFAULTS: Final = (1.0471975511965976, 1.3962634015954636, 0.25, 1.2, 0.25)
"""Defaults of a new program: joint velocity [rad/s] and acceleration [rad/s²], tool velocity [m/s] and
acceleration [m/s²], and the radius that converts rotation to translation [m]."""
_TYPES: Final = {"UR5": 1, "UR10": 2, "UR3": 3, "UR16": 4, "UR20": 7, "UR30": 8}

_PACKAGE = Struct(">iB")
_PART = Struct(">IB")
_JOINT = Struct(">3d4fB")
_KEY: Final = "robot state"


def robot_state(description: RobotDescription, snapshot: Snapshot) -> bytes:
    """Return the package of a tick, which is created once for all clients of a robot."""
    made: bytes | None = snapshot.shared.get(_KEY)
    if made is None:
        body = b"".join((
            _part(0, _robot_mode(snapshot)),
            _part(1, _joints(snapshot)),
            _part(4, pack(">12d", *snapshot.actual_TCP_pose, *snapshot.tcp_offset)),
            _part(5, _kinematics(description)),
            _part(9, bytes(48)),  # for UR's own calibration
            _part(3, _masterboard(snapshot)),
            _part(2, _tool(snapshot)),
            _part(6, _configuration(description)),
            _part(7, pack(">7d", *snapshot.actual_TCP_force, 0.0)),  # dexterity, the last value, is not computed
            _part(8, bytes((0, 1, 0, 1))),  # teach button, and the one on the flange: not pressed, enabled
            _part(10, bytes(38)),  # for UR's own safety check
            _part(11, pack(">Biiiff", 0, 115200, 0, 1, 1.5, 3.5)),  # off; baud, parity, stop bits, idle characters
            _part(12, bytes((snapshot.tool_output_mode, snapshot.tool_digital_output0_mode,
                             snapshot.tool_digital_output1_mode))),
        ))  # fmt: skip
        made = snapshot.shared[_KEY] = _PACKAGE.pack(_PACKAGE.size + len(body), 16) + body
    return made


def robot_type(description: RobotDescription) -> int:
    """Return UR's number of a robot type, 0 if it is not UR's; `RobotType` in ur_client_library/ur/datatypes.h."""
    return _TYPES.get(series(description.robot.model) or "", 0)


def _part(number: int, body: bytes) -> bytes:
    return _PART.pack(_PART.size + len(body), number) + body


def _robot_mode(snapshot: Snapshot) -> bytes:
    emergency = (SafetyMode.SYSTEM_EMERGENCY_STOP, SafetyMode.ROBOT_EMERGENCY_STOP)
    return pack(
        ">Q7?BB3dB",
        messages.stamp(snapshot),
        True,  # the arm is connected
        True,  # and may be moved
        snapshot.powered,
        snapshot.safety_mode in emergency,
        snapshot.safety_mode == SafetyMode.PROTECTIVE_STOP,
        snapshot.robot_status_bits >> 1 & 1,
        snapshot.runtime_state == RuntimeState.PAUSED,
        snapshot.robot_mode & 0xFF,
        0,  # control by position
        snapshot.target_speed_fraction,
        snapshot.speed_scaling,
        1.0,  # full speed
        0,
    )


def _joints(snapshot: Snapshot) -> bytes:
    rows = zip(
        snapshot.actual_q,
        snapshot.target_q,
        snapshot.actual_qd,
        snapshot.actual_current,
        snapshot.actual_joint_voltage,
        snapshot.joint_temperatures,
        [0.0] * MOST_JOINTS,  # second temperature, which e-Series joints do not have
        snapshot.joint_mode,
        strict=False,
    )
    return b"".join([_JOINT.pack(*row) for row in rows]).ljust(MOST_JOINTS * _JOINT.size, b"\0")


def _kinematics(description: RobotDescription) -> bytes:
    a, d, alpha = _denavit_hartenberg(description)
    theta = [0.0] * MOST_JOINTS
    return pack(">6I24dI", *[0xFFFFFFFF] * MOST_JOINTS, *theta, *a, *d, *alpha, 0)


def _masterboard(snapshot: Snapshot) -> bytes:
    types = [snapshot.analog_io_types >> bit & 1 for bit in range(4)]
    return pack(
        ">IIbbddbbddffffBBBIBBB",
        snapshot.actual_digital_input_bits,
        snapshot.actual_digital_output_bits,
        *types[:2],
        snapshot.standard_analog_input0,
        snapshot.standard_analog_input1,
        *types[2:],
        snapshot.standard_analog_output0,
        snapshot.standard_analog_output1,
        25.0,  # temperature of the boards [°C]
        snapshot.actual_robot_voltage,
        snapshot.actual_robot_current,
        snapshot.io_current,
        snapshot.safety_mode & 0xFF,
        snapshot.safety_mode == SafetyMode.REDUCED,
        0,  # no Euromap 67 interface is fitted
        0,
        1,  # selector of the operational mode
        1,  # three-position switch
        1,
    )


def _tool(snapshot: Snapshot) -> bytes:
    return pack(
        ">bbddfBffB",
        snapshot.tool_analog_input_types & 1,
        snapshot.tool_analog_input_types >> 1 & 1,
        snapshot.tool_analog_input0,
        snapshot.tool_analog_input1,
        snapshot.actual_robot_voltage,
        snapshot.tool_output_voltage,
        snapshot.tool_output_current,
        snapshot.tool_temperature,
        snapshot.tool_mode & 0xFF,
    )


def _configuration(description: RobotDescription) -> bytes:
    limits = description.limits
    position = [value for most in _six(limits.position) for value in (-most, most)]
    motion = [
        value for pair in zip(_six(limits.velocity), _six(limits.acceleration), strict=True) for value in pair
    ]
    a, d, alpha = _denavit_hartenberg(description)
    theta = [0.0] * MOST_JOINTS
    numbers = (6, 4, robot_type(description), 3)  # masterboard, box, arm, e-Series
    return pack(">53d4i", *position, *motion, *MOTION_DEFAULTS, *a, *d, *alpha, *theta, *numbers)


def _denavit_hartenberg(description: RobotDescription) -> tuple[list[float], list[float], list[float]]:
    kinematics = description.kinematics
    return _six(kinematics.a), _six(kinematics.d), _six(kinematics.alpha)


def _six(values: tuple[float, ...]) -> list[float]:
    return [*values, *[0.0] * (MOST_JOINTS - len(values))]
