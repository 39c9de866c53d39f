"""Functions of UR's controllers that this one does not simulate: each says so when it is called."""

from collections.abc import Callable

from tvist_urscript import METHOD, Fault, Parameter, parameters

_LIGHT, _CONVEYORS, _OFFSETS, _MODBUS = "the light of the base", "conveyor tracking", "path offsets", "Modbus"
_OPERATOR, _EUROMAP, _OTHERS = (
    "questions to an operator",
    "Euromap 67",
    "remote procedure calls and Ethernet/IP",
)
_TEMPERATURES, _LIMITS = "temperatures in programs", "limits of the force at the tool"
_SIGNAL = parameters("signal_name")

SUBJECTS: dict[str, tuple[tuple[Parameter, ...], str]] = {
    "direct_torque": (
        parameters("torque", friction_comp=True, viscous_scale=None, coulomb_scale=None),
        "torque control",
    ),
    "conveyor_pulse_decode": (parameters("type", "A", B=0), _CONVEYORS),
    "encoder_enable_pulse_decode": (parameters("encoder_index", "decoder_type", "A", "B"), _CONVEYORS),
    "encoder_enable_set_tick_count": (parameters("encoder_index", "range_id"), _CONVEYORS),
    "encoder_get_tick_count": (parameters("encoder_index"), _CONVEYORS),
    "encoder_set_tick_count": (parameters("encoder_index", "count"), _CONVEYORS),
    "encoder_unwind_delta_tick_count": (parameters("encoder_index", "delta_tick_count"), _CONVEYORS),
    "get_conveyor_tick_count": (parameters(), _CONVEYORS),
    "set_conveyor_tick_count": (parameters("tick_count", absolute_encoder_resolution=0), _CONVEYORS),
    "track_conveyor_linear": (parameters("direction", "ticks_per_meter", encoder_index=0), _CONVEYORS),
    "track_conveyor_circular": (
        parameters("center", "ticks_per_revolution", rotate_tool=False, encoder_index=0),
        _CONVEYORS,
    ),
    "stop_conveyor_tracking": (parameters(a=20), _CONVEYORS),
    "path_offset_enable": (parameters(), _OFFSETS),
    "path_offset_get": (parameters("type"), _OFFSETS),
    "path_offset_set": (parameters("offset", "type"), _OFFSETS),
    "path_offset_set_alpha_filter": (parameters("alpha"), _OFFSETS),
    "path_offset_set_max_offset": (parameters("transLimit", "rotLimit"), _OFFSETS),
    "path_offset_disable": (parameters(a=20), _OFFSETS),
    "modbus_add_signal": (
        parameters(
            "IP",
            "slave_number",
            "signal_address",
            "signal_type",
            "signal_name",
            sequential_mode=False,
            register_count=1,
        ),
        _MODBUS,
    ),
    "modbus_add_rw_signal": (
        parameters(
            "IP",
            "slave_number",
            "read_address",
            "read_register_count",
            "write_address",
            "write_register_count",
            "signal_name",
            sequential_mode=False,
        ),
        _MODBUS,
    ),
    "modbus_delete_signal": (_SIGNAL, _MODBUS),
    "modbus_get_error": (parameters("signal_name", error_source=0), _MODBUS),
    "modbus_get_signal_status": (parameters("signal_name", is_secondary_program=False), _MODBUS),
    "modbus_get_time_since_signal_invalid": (_SIGNAL, _MODBUS),
    "modbus_request_update_signal_value": (_SIGNAL, _MODBUS),
    "modbus_reset_connection": (parameters("connection_id", is_blocking=True), _MODBUS),
    "modbus_send_custom_command": (parameters("IP", "slave_number", "function_code", "data"), _MODBUS),
    "modbus_set_digital_input_action": (parameters("signal_name", "action"), _MODBUS),
    "modbus_set_output_register": (
        parameters("signal_name", "register_value", is_secondary_program=False),
        _MODBUS,
    ),
    "modbus_set_output_signal": (
        parameters("signal_name", "digital_value", is_secondary_program=False),
        _MODBUS,
    ),
    "modbus_set_runstate_dependent_choice": (parameters("signal_name", "runstate_choice"), _MODBUS),
    "modbus_set_signal_update_frequency": (parameters("signal_name", "update_frequency"), _MODBUS),
    "modbus_set_signal_watchdog": (parameters("signal_name", "new_timeout_in_sec"), _MODBUS),
    "read_port_bit": (parameters("address"), _MODBUS),
    "read_port_register": (parameters("address"), _MODBUS),
    "write_port_bit": (parameters("address", "value"), _MODBUS),
    "write_port_register": (parameters("address", "value"), _MODBUS),
    "rpc_factory": (parameters("type", "url"), _OTHERS),
    "eip_reader_factory": (parameters("name", "size"), _OTHERS),
    "eip_writer_factory": (parameters("name", "size"), _OTHERS),
    METHOD: ((), _OTHERS),
    "get_euromap_input": (parameters("port_number"), _EUROMAP),
    "get_euromap_output": (parameters("port_number"), _EUROMAP),
    "set_euromap_output": (parameters("port_number", "signal_value"), _EUROMAP),
    "set_euromap_runstate_dependent_choice": (parameters("port_number", "runstate_choice"), _EUROMAP),
    "request_boolean_from_primary_client": (parameters("message"), _OPERATOR),
    "request_float_from_primary_client": (parameters("message"), _OPERATOR),
    "request_integer_from_primary_client": (parameters("message"), _OPERATOR),
    "request_string_from_primary_client": (parameters("message"), _OPERATOR),
    "set_baselight_iec": (parameters(), _LIGHT),
    "set_baselight_off": (parameters(), _LIGHT),
    "set_baselight_solid": (parameters("r", "g", "b"), _LIGHT),
    "get_controller_temp": (parameters(), _TEMPERATURES),
    "get_joint_temp": (parameters("j"), _TEMPERATURES),
    "get_tool_temp": (parameters(), _TEMPERATURES),
    "tool_wrench_limit_set": (parameters("frame_offset", "Fx", "Fy", "Fz", "Mx", "My", "Mz"), _LIMITS),
    "tool_wrench_limit_disable": (parameters(), _LIMITS),
    "estimate_payload": (parameters("poses", "wrenches"), "estimating a payload"),
    "get_coriolis_and_centrifugal_torques": (parameters(q=None, qd=None), "Coriolis torques in programs"),
    "get_jacobian_time_derivative": (parameters(q=None, qd=None, tcp=None), "the Jacobian's derivative"),
    "pause_on_error_code": (parameters("code", "argument"), "error codes of the joints"),
    "set_pos": (parameters("q"), "programs that put the arm elsewhere at once"),
    "screw_driving": (parameters("f", "v_limit"), "screw driving"),
}
"""Parameters of each function, and what is not simulated."""


def _method(_: object, name: object, __: object) -> None:
    raise Fault(f"{name}: this controller does not simulate {_OTHERS}")


def _missing(name: str, subject: str) -> Callable[..., None]:
    def missing(*_: object) -> None:
        raise Fault(f"{name}: this controller does not simulate {subject}")

    return missing


MISSING = {name: _missing(name, subject) for name, (_, subject) in SUBJECTS.items()} | {METHOD: _method}
"""Functions that end their program with an error, which says what is not simulated."""
