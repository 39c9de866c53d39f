"""Functions of UR's controllers that this one does not simulate: each says so when it is called."""

from collections.abc import Callable

from tvist_controller.programs.arguments import number
from tvist_urscript import Fault, parameters

SUBJECTS = {
    "force_mode": (parameters("task_frame", "selection_vector", "wrench", "type", "limits"), "force control"),
    "freedrive_mode": (parameters(freeAxes=None, feature=None), "moving the arm by hand"),
    "teach_mode": (parameters(), "moving the arm by hand"),
    "tool_contact": (parameters(direction=None), "detecting contacts"),
    "enable_external_ft_sensor": (
        parameters("enable", sensor_mass=0, sensor_measuring_offset=None, sensor_cog=None),
        "an external force sensor",
    ),
    "ft_rtde_input_enable": (
        parameters("enable", sensor_mass=0, sensor_measuring_offset=None, sensor_cog=None),
        "an external force sensor",
    ),
    "direct_torque": (
        parameters("torque", friction_comp=True, viscous_scale=None, coulomb_scale=None),
        "torque control",
    ),
    "conveyor_pulse_decode": (parameters("type", "A", B=0), "conveyor tracking"),
    "track_conveyor_linear": (parameters("direction", "ticks_per_meter"), "conveyor tracking"),
    "track_conveyor_circular": (
        parameters("center", "ticks_per_revolution", rotate_tool=False),
        "conveyor tracking",
    ),
    "stop_conveyor_tracking": (parameters(a=20), "conveyor tracking"),
    "path_offset_enable": (parameters(), "path offsets"),
    "path_offset_set": (parameters("offset", "type"), "path offsets"),
    "path_offset_disable": (parameters(a=20), "path offsets"),
    "modbus_add_signal": (
        parameters("IP", "slave_number", "signal_address", "signal_type", "signal_name"),
        "Modbus",
    ),
    "modbus_get_signal_status": (parameters("signal_name", is_secondary_program=False), "Modbus"),
    "modbus_set_output_register": (
        parameters("signal_name", "register_value", is_secondary_program=False),
        "Modbus",
    ),
    "modbus_set_output_signal": (
        parameters("signal_name", "digital_value", is_secondary_program=False),
        "Modbus",
    ),
    "rpc_factory": (parameters("type", "url"), "remote procedure calls"),
    "screw_driving": (parameters("f", "v_limit"), "screw driving"),
}
"""Parameters of each function, and what is not simulated."""


def _missing(name: str, subject: str) -> Callable[..., None]:
    def missing(*_: object) -> None:
        raise Fault(f"{name}: this controller does not simulate {subject}")

    return missing


MISSING = {name: _missing(name, subject) for name, (_, subject) in SUBJECTS.items()}
"""Functions that end their program with an error, which says what is not simulated."""


class IdleFunctions:
    """Functions that only set or end what is not simulated: they succeed, since nothing of that kind is going on."""

    def end_force_mode(self) -> None:
        """Do nothing, since there is no force mode to end."""

    def end_freedrive_mode(self) -> None:
        """Do nothing, since nobody moves the arm by hand."""

    def end_teach_mode(self) -> None:
        """Do nothing, since nobody moves the arm by hand."""

    def get_freedrive_status(self) -> int:
        """Return 0: the arm is not moved by hand."""
        return 0

    def force_mode_set_damping(self, damping: object) -> None:
        """Check a setting that only matters in force mode, which says that it is not simulated."""
        number("damping", damping, 0.0, 1.0)

    def force_mode_set_gain_scaling(self, scaling: object) -> None:
        """Check a setting that only matters in force mode, which says that it is not simulated."""
        number("scaling", scaling, 0.0, 2.0)
