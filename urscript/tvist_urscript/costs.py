"""What operators, functions and motions take from the evaluations that a program has in a tick.

A weight is the time of a call in tenths of a microsecond on the machine on which all were measured; none takes more
than 0.25 µs for an evaluation there, so the budget bounds the time of programs in a tick. Yet budgets are counts: a run
is the same on every machine.
"""

from typing import Final

EVALUATIONS: Final = 9000
"""Budget of a tick for all threads together, three times what UR's and ur_rtde's own programs take."""
GUIDED: Final = 1000
"""Evaluations that the controller's step of a guided motion takes from the budget of its tick."""
OVERDRAFT: Final = 2000
"""Most evaluations by which one statement may exceed the budget."""
PATIENCE: Final = 1_000_000
"""Evaluations of a thread without waiting for time to pass, or reading what has come, after which it is endless."""

START: Final = 20
"""Start of a thread, or `kill`, which limits the threads that start in a tick."""
ARITHMETIC: Final = 2
"""An operator of arithmetic, or an element of a matrix; comparisons, conditions and all else take one."""
LIST: Final = 12
"""Arithmetic with a list or matrix, beside one for each of its elements."""
REPLACED: Final = 10
"""Each index of an element that is assigned."""
POSED: Final = 10
"""A pose of six expressions."""

ORDINARY: Final = 20
"""A call of a function that the table does not name."""
_TABLE = {
    1000: "end_force_mode end_freedrive_mode end_teach_mode force_mode freedrive_mode stopj stopl teach_mode",
    800: "set_target_payload",
    600: "movec movej movel movep optimovej optimovel",
    400: "servoc set_tcp",
    350: "speedj speedl",
    300: "get_mass_matrix get_rtde_value servoj",
    250: "set_payload set_payload_cog set_payload_mass",
    200: "is_within_safety_limits socket_open tool_contact",
    150: "get_inverse_kin get_inverse_kin_has_solution",
    100: "get_jacobian popup zero_ftsensor",
    80: "force get_forward_kin get_joint_torques get_tcp_force inv",
    60: "get_actual_tcp_pose get_actual_tcp_speed get_actual_tool_flange_pose get_target_tcp_pose "
    "get_target_tcp_pose_along_path get_target_tcp_speed get_target_tcp_speed_along_path "
    "get_target_waypoint interpolate_pose tool_pose",
    45: "pose_add pose_inv pose_sub pose_trans wrench_trans",
    30: "reset_revolution_counter textmsg",
    10: "get_actual_joint_positions get_actual_joint_speeds get_analog_in get_configurable_digital_in "
    "get_configurable_digital_out get_digital_in get_digital_out get_joint_positions "
    "get_standard_analog_in get_standard_analog_out get_standard_digital_in get_standard_digital_out "
    "get_target_payload_cog get_target_payload_inertia get_tool_accelerometer_reading get_tool_digital_in "
    "get_tool_digital_out socket_close str_cat str_find str_sub sync to_num to_str",
    5: "acos asin assert atan atan2 ceil cos d2r floor get_analog_out get_base_acceleration get_flag "
    "get_freedrive_status get_gravity get_steptime get_target_payload get_tool_analog_in get_tool_current "
    "is_steady length log make_list norm normalize pow r2d random read_input_boolean_register "
    "read_input_float_register read_input_integer_register read_output_boolean_register "
    "read_output_float_register read_output_integer_register sin size sqrt str_at str_empty str_len tan",
    1: "get_list_length",
}
WEIGHTS: Final = {name: weight for weight, names in _TABLE.items() for name in names.split()}
"""Functions, and what a call of each takes."""


def cost_of(name: str) -> int:
    """Return how many evaluations a call of a function takes from the budget."""
    return WEIGHTS.get(name, ORDINARY)
