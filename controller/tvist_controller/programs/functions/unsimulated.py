"""Functions of UR's controllers that this one does not simulate: each says so when it is called.

The functions that only set or end what these would begin succeed, since nothing of that kind is going on.
"""

from tvist_controller.programs.arguments import number
from tvist_urscript import Fault, Signature, signature

SUBJECTS = {
    "force_mode": ("task_frame, selection_vector, wrench, type, limits", "force control"),
    "freedrive_mode": ("freeAxes=None, feature=None", "moving the arm by hand"),
    "teach_mode": ("", "moving the arm by hand"),
    "tool_contact": ("direction=None", "detecting contacts"),
    "enable_external_ft_sensor": ("enable, sensor_mass=0, sensor_measuring_offset=None, sensor_cog=None",
                                  "an external force sensor"),
    "ft_rtde_input_enable": ("enable, sensor_mass=0, sensor_measuring_offset=None, sensor_cog=None",
                             "an external force sensor"),
    "direct_torque": ("torque, friction_comp=True, viscous_scale=None, coulomb_scale=None", "torque control"),
    "conveyor_pulse_decode": ("type, A, B=0", "conveyor tracking"),
    "track_conveyor_linear": ("direction, ticks_per_meter", "conveyor tracking"),
    "track_conveyor_circular": ("center, ticks_per_revolution, rotate_tool=False", "conveyor tracking"),
    "stop_conveyor_tracking": ("a=20", "conveyor tracking"),
    "path_offset_enable": ("", "path offsets"),
    "path_offset_set": ("offset, type", "path offsets"),
    "path_offset_disable": ("a=20", "path offsets"),
    "modbus_add_signal": ("IP, slave_number, signal_address, signal_type, signal_name", "Modbus"),
    "modbus_get_signal_status": ("signal_name, is_secondary_program=False", "Modbus"),
    "modbus_set_output_register": ("signal_name, register_value, is_secondary_program=False", "Modbus"),
    "modbus_set_output_signal": ("signal_name, digital_value, is_secondary_program=False", "Modbus"),
    "rpc_factory": ("type, url", "remote procedure calls"),
    "screw_driving": ("f, v_limit", "screw driving"),
}  # fmt: skip
"""Parameters of each function, and what is not simulated."""

IDLE: dict[str, Signature] = {
    "end_force_mode": signature(""),
    "end_freedrive_mode": signature(""),
    "end_teach_mode": signature(""),
    "get_freedrive_status": signature(""),
    "force_mode_set_damping": signature("damping"),
    "force_mode_set_gain_scaling": signature("scaling"),
}
SIGNATURES = {**{name: signature(parameters) for name, (parameters, _) in SUBJECTS.items()}, **IDLE}


class UnsimulatedFunctions:
    """Stands in for what is not simulated."""

    def __getattr__(self, name: str) -> object:
        """Return a function that says that it is not simulated."""
        if name not in SUBJECTS:
            raise AttributeError(name)

        def missing(*_: object) -> None:
            raise Fault(f"{name}: this controller does not simulate {SUBJECTS[name][1]}")

        return missing

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
