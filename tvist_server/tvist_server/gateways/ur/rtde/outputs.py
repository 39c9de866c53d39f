"""Variables that a robot tells, with their types."""

from collections.abc import Callable
from operator import attrgetter
from typing import Any

from tvist_controller.instruments.snapshot import Snapshot
from tvist_server.gateways.ur.rtde.registers import KINDS, registers
from tvist_server.gateways.ur.rtde.wire import Encode, Wire

Read = Callable[[Snapshot], Any]
"""Takes a variable's value out of a snapshot."""

NAMED: dict[Wire, str] = {
    Wire.VECTOR6D: """
        target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current
        actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed
        actual_TCP_force target_TCP_pose target_TCP_speed tcp_offset actual_TCP_acceleration target_TCP_acceleration
        joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents payload_inertia
        target_base_acceleration target_base_wrench shaped_q shaped_qd shaped_qdd""",
    Wire.VECTOR3D: "actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity",
    Wire.VECTOR6INT32: "joint_mode",
    Wire.DOUBLE: """
        timestamp actual_execution_time target_execution_time speed_scaling target_speed_fraction actual_momentum
        actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1
        standard_analog_output0 standard_analog_output1 io_current actual_robot_energy_consumed
        actual_robot_braking_energy_dissipated euromap67_24V_voltage euromap67_24V_current tool_analog_input0
        tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar joint_position_deviation_ratio
        collision_detection_ratio payload""",
    Wire.INT32: """
        robot_mode safety_mode safety_status tool_output_voltage encoder0_raw encoder1_raw time_scale_source""",
    Wire.UINT32: """
        runtime_state robot_status_bits safety_status_bits analog_io_types tool_mode tool_analog_input_types
        euromap67_input_bits euromap67_output_bits script_control_line""",
    Wire.UINT64: """
        actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits
        actual_configurable_digital_output_bits control_step""",
    Wire.UINT8: "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
}
"""All but the registers: each is an attribute of a snapshot."""


READERS: dict[str, tuple[Read, Encode]] = {
    name: (attrgetter(name), wire.encode) for wire, names in NAMED.items() for name in names.split()
}
"""How each variable that is no register is read, and written as bytes."""
OUTPUTS: dict[str, Wire] = {name: wire for wire, names in NAMED.items() for name in names.split()} | {
    name: wire for kind in KINDS for name, wire in registers(kind)
}
"""Type of every output variable by name."""
