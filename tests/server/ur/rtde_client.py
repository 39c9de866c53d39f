"""A client's side of RTDE, written from the published layout and from nothing of ours."""

import struct

WORD = {
    "BOOL": "?", "UINT8": "B", "UINT32": "I", "UINT64": "Q", "INT32": "i", "DOUBLE": "d", "VECTOR3D": "ddd",
    "VECTOR6D": "dddddd", "VECTOR6INT32": "iiiiii", "VECTOR6UINT32": "IIIIII",
}  # fmt: skip
NAMED = """
VECTOR6D target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current
VECTOR6D actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed
VECTOR6D actual_TCP_force target_TCP_pose target_TCP_speed tcp_offset actual_TCP_acceleration
VECTOR6D target_TCP_acceleration joint_temperatures actual_joint_voltage ft_raw_wrench wrench_calc_from_currents
VECTOR6D payload_inertia target_base_acceleration target_base_wrench
VECTOR3D actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity
VECTOR6INT32 joint_mode
DOUBLE timestamp actual_execution_time target_execution_time speed_scaling target_speed_fraction actual_momentum
DOUBLE actual_main_voltage actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1
DOUBLE standard_analog_output0 standard_analog_output1 io_current actual_robot_energy_consumed
DOUBLE actual_robot_braking_energy_dissipated euromap67_24V_voltage euromap67_24V_current tool_analog_input0
DOUBLE tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar joint_position_deviation_ratio
DOUBLE collision_detection_ratio payload
INT32 robot_mode safety_mode safety_status tool_output_voltage encoder0_raw encoder1_raw time_scale_source
UINT32 runtime_state robot_status_bits safety_status_bits analog_io_types tool_mode tool_analog_input_types
UINT32 euromap67_input_bits euromap67_output_bits script_control_line output_bit_registers0_to_31
UINT32 output_bit_registers32_to_63 input_bit_registers0_to_31 input_bit_registers32_to_63
UINT64 actual_digital_input_bits actual_digital_output_bits actual_configurable_digital_input_bits
UINT64 actual_configurable_digital_output_bits control_step
UINT8 tool_output_mode tool_digital_output0_mode tool_digital_output1_mode
"""
"""Types that UR publishes: the second opinion on the annotations from which the server takes them."""
OUTPUT_TYPES = {name: line.split()[0] for line in NAMED.strip().splitlines() for name in line.split()[1:]}
for bank in ("output", "input"):
    OUTPUT_TYPES |= {f"{bank}_bit_register_{k}": "BOOL" for k in range(64, 128)}
    OUTPUT_TYPES |= {f"{bank}_int_register_{k}": "INT32" for k in range(48)}
    OUTPUT_TYPES |= {f"{bank}_double_register_{k}": "DOUBLE" for k in range(48)}
GROUPS = ("standard", "configurable", "tool")
BYTES = [f"{group}_digital_output{end}" for group in GROUPS for end in ("_mask", "")]
INPUT_TYPES = {
    "speed_slider_mask": "UINT32", "speed_slider_fraction": "DOUBLE", **dict.fromkeys(BYTES, "UINT8"),
    "standard_analog_output_mask": "UINT8", "standard_analog_output_type": "UINT8",
    "standard_analog_output_0": "DOUBLE", "standard_analog_output_1": "DOUBLE", "external_force_torque": "VECTOR6D",
    "input_bit_registers0_to_31": "UINT32", "input_bit_registers32_to_63": "UINT32",
    **{f"input_bit_register_{k}": "BOOL" for k in range(64, 128)},
    **{f"input_int_register_{k}": "INT32" for k in range(48)},
    **{f"input_double_register_{k}": "DOUBLE" for k in range(48)},
}  # fmt: skip
OWN = dict.fromkeys(("shaped_q", "shaped_qd", "shaped_qdd"), "VECTOR6D")  # outputs that no robot of UR's has


def package(letter, payload=b""):
    return struct.pack(">HB", 3 + len(payload), ord(letter)) + payload


def packages(stream):
    """(letter, payload) of each whole package; the stream must end with one."""
    found, at = [], 0
    while at < len(stream):
        size, letter = struct.unpack_from(">HB", stream, at)
        assert 3 <= size <= len(stream) - at
        found.append((chr(letter), stream[at + 3 : at + size]))
        at += size
    return found


def version(number=2):
    return package("V", struct.pack(">H", number))


def outputs(names, frequency=500.0):
    return package("O", struct.pack(">d", frequency) + ",".join(names).encode())


def inputs(names):
    return package("I", ",".join(names).encode())


def data(number, names, values):
    layout = ">B" + "".join(WORD[INPUT_TYPES[name]] for name in names)
    flat = [n for value in values for n in (value if isinstance(value, tuple) else (value,))]
    return package("U", struct.pack(layout, number, *flat))


def decoded(sample, names, version=2):
    """Values of a data package by name; vectors are lists."""
    ((letter, payload),) = packages(sample)
    assert letter == "U"
    if version == 2:
        assert payload[0] == 1
        payload = payload[1:]
    values, at = {}, 0
    for name in names:
        layout = ">" + WORD[(OUTPUT_TYPES | OWN)[name]]
        found = struct.unpack_from(layout, payload, at)
        at += struct.calcsize(layout)
        values[name] = found[0] if len(found) == 1 else list(found)
    assert at == len(payload)
    return values
