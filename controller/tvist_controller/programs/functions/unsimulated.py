"""Functions of UR's controllers that are not simulated; calling one ends the program with an error."""

import ast
from collections.abc import Iterator, Mapping

from tvist_urscript import METHOD, Parameter, parameters

_OTHERS = "remote procedure calls and Ethernet/IP"
_CALLS = {
    "torque control": ("direct_torque(torque, friction_comp=True, viscous_scale=None, coulomb_scale=None)",),
    "conveyor tracking": (
        "conveyor_pulse_decode(type, A, B=0)",
        "encoder_enable_pulse_decode(encoder_index, decoder_type, A, B)",
        "encoder_enable_set_tick_count(encoder_index, range_id)",
        "encoder_get_tick_count(encoder_index)",
        "encoder_set_tick_count(encoder_index, count)",
        "encoder_unwind_delta_tick_count(encoder_index, delta_tick_count)",
        "get_conveyor_tick_count()",
        "set_conveyor_tick_count(tick_count, absolute_encoder_resolution=0)",
        "track_conveyor_linear(direction, ticks_per_meter, encoder_index=0)",
        "track_conveyor_circular(center, ticks_per_revolution, rotate_tool=False, encoder_index=0)",
        "stop_conveyor_tracking(a=20)",
    ),
    "path offsets": (
        "path_offset_enable()",
        "path_offset_get(type)",
        "path_offset_set(offset, type)",
        "path_offset_set_alpha_filter(alpha)",
        "path_offset_set_max_offset(transLimit, rotLimit)",
        "path_offset_disable(a=20)",
    ),
    "Modbus": (
        """modbus_add_signal(IP, slave_number, signal_address, signal_type, signal_name,
            sequential_mode=False, register_count=1)""",
        """modbus_add_rw_signal(IP, slave_number, read_address, read_register_count, write_address,
            write_register_count, signal_name, sequential_mode=False)""",
        "modbus_delete_signal(signal_name)",
        "modbus_get_error(signal_name, error_source=0)",
        "modbus_get_signal_status(signal_name, is_secondary_program=False)",
        "modbus_get_time_since_signal_invalid(signal_name)",
        "modbus_request_update_signal_value(signal_name)",
        "modbus_reset_connection(connection_id, is_blocking=True)",
        "modbus_send_custom_command(IP, slave_number, function_code, data)",
        "modbus_set_digital_input_action(signal_name, action)",
        "modbus_set_output_register(signal_name, register_value, is_secondary_program=False)",
        "modbus_set_output_signal(signal_name, digital_value, is_secondary_program=False)",
        "modbus_set_runstate_dependent_choice(signal_name, runstate_choice)",
        "modbus_set_signal_update_frequency(signal_name, update_frequency)",
        "modbus_set_signal_watchdog(signal_name, new_timeout_in_sec)",
        "read_port_bit(address)",
        "read_port_register(address)",
        "write_port_bit(address, value)",
        "write_port_register(address, value)",
    ),
    _OTHERS: ("rpc_factory(type, url)", "eip_reader_factory(name, size)", "eip_writer_factory(name, size)"),
    "Euromap 67": (
        "get_euromap_input(port_number)",
        "get_euromap_output(port_number)",
        "set_euromap_output(port_number, signal_value)",
        "set_euromap_runstate_dependent_choice(port_number, runstate_choice)",
    ),
    "questions to an operator": (
        "request_boolean_from_primary_client(message)",
        "request_float_from_primary_client(message)",
        "request_integer_from_primary_client(message)",
        "request_string_from_primary_client(message)",
    ),
    "the light of the base": ("set_baselight_iec()", "set_baselight_off()", "set_baselight_solid(r, g, b)"),
    "temperatures in programs": ("get_controller_temp()", "get_joint_temp(j)", "get_tool_temp()"),
    "limits of the force at the tool": (
        "tool_wrench_limit_set(frame_offset, Fx, Fy, Fz, Mx, My, Mz)",
        "tool_wrench_limit_disable()",
    ),
    "estimating a payload": ("estimate_payload(poses, wrenches)",),
    "Coriolis torques in programs": ("get_coriolis_and_centrifugal_torques(q=None, qd=None)",),
    "the Jacobian's derivative": ("get_jacobian_time_derivative(q=None, qd=None, tcp=None)",),
    "error codes of the joints": ("pause_on_error_code(code, argument)",),
    "programs that put the arm elsewhere at once": ("set_pos(q)",),
    "screw driving": ("screw_driving(f, v_limit)",),
}  # subjects that are not simulated, and their functions as scripts call them


def _subjects(
    calls: Mapping[str, tuple[str, ...]],
) -> Iterator[tuple[str, tuple[tuple[Parameter, ...], str]]]:
    for subject, texts in calls.items():
        for text in texts:
            call = ast.parse(text, mode="eval").body
            assert isinstance(call, ast.Call)
            required = [ast.unparse(one) for one in call.args]
            defaults = {one.arg: ast.literal_eval(one.value) for one in call.keywords if one.arg is not None}
            yield ast.unparse(call.func), (parameters(*required, **defaults), subject)


SUBJECTS: dict[str, tuple[tuple[Parameter, ...], str]] = dict(_subjects(_CALLS)) | {METHOD: ((), _OTHERS)}
"""Parameters and subject of each function."""
