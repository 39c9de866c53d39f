"""Functions with which programs that PolyScope has written set up terminals, tool and safety."""

from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import flag, integer, number, numbers, shown
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.functions.terminals import CONFIGURABLE, STANDARD, TOOL
from tvist_controller.programs.runstate import MOST, Group, RunstateOutputs
from tvist_protocol.io import BITS
from tvist_urscript import Array, Fault

RATES = (9600, 19200, 38400, 57600, 115200, 1000000, 2000000, 5000000)
"""Rates of the tool's serial line [baud]."""
_NO_TURNS = Array((0.0,) * 6)


class SetupFunctions:
    """Sets up one robot. What has no effect on a simulated one is checked, and said if it asks for something.

    Args:
        access: The robot.
        arm: Its arm: what is set after a move that is blended is set where the blend begins.
        runstate: Its outputs that show whether a program runs.
    """

    def __init__(self, access: Access, arm: ProgramArm, runstate: RunstateOutputs) -> None:
        self._access, self._arm, self._runstate = access, arm, runstate
        self._motion_version = 2

    # ------------------------------------------------------------------ tool

    def set_tool_analog_input_domain(self, port: object, domain: object) -> None:
        """Make an analogue input of the tool a current (0) or a voltage (1)."""
        place, voltage = integer("port", port, 0, 1), bool(integer("domain", domain, 0, 1))
        self._arm.then(lambda: self._access.peripherals.choose_tool_input(place, voltage=voltage))

    def set_tool_output_mode(self, mode: object) -> None:
        """Use the digital outputs of the tool as such (0), or as a second supply (1)."""
        wanted = integer("mode", mode, 0, 1)
        self._arm.then(lambda: self._access.peripherals.set_tool_output_mode(wanted))

    def set_tool_digital_output_mode(self, n: object, mode: object) -> None:
        """Let a digital output of the tool sink (1), source (2), or both (3)."""
        place, wanted = integer("n", n, 0, 1), integer("mode", mode, 1, 3)
        self._arm.then(lambda: self._access.peripherals.set_tool_digital_output_mode(place, wanted))

    def set_tool_communication(
        self,
        enabled: object,
        baud_rate: object,
        parity: object,
        stop_bits: object,
        rx_idle_chars: object,
        tx_idle_chars: object,
    ) -> None:
        """Check the settings of the tool's serial line; a warning says that nothing answers on one that is enabled."""
        rate = integer("baud_rate", baud_rate, RATES[0], RATES[-1])
        if rate not in RATES:
            raise Fault(f"baud_rate is {rate}: it must be one of {', '.join(map(str, RATES))}")
        integer("parity", parity, 0, 2)
        integer("stop_bits", stop_bits, 1, 2)
        number("rx_idle_chars", rx_idle_chars, 1.0, 40.0)
        number("tx_idle_chars", tx_idle_chars, 0.0, 40.0)
        if flag("enabled", enabled):
            self._warn("set_tool_communication: no tool is connected to the simulated arm's serial line")

    # ------------------------------------------------------------------ inputs

    def set_input_actions_to_default(self) -> None:
        """Let no input move the arm to freedrive, which none does."""

    def set_standard_digital_input_action(self, port: object, action: object) -> None:
        """Check what an input does: "default", or "freedrive", of which a warning says that it has no effect."""
        self._act(f"standard digital input {integer('port', port, 0, len(STANDARD) - 1)}", action)

    def set_configurable_digital_input_action(self, port: object, action: object) -> None:
        """Check what an input does, as `set_standard_digital_input_action`."""
        self._act(f"configurable digital input {integer('port', port, 0, len(CONFIGURABLE) - 1)}", action)

    def set_tool_digital_input_action(self, port: object, action: object) -> None:
        """Check what an input does, as `set_standard_digital_input_action`."""
        self._act(f"tool digital input {integer('port', port, 0, len(TOOL) - 1)}", action)

    def set_gp_boolean_input_action(self, port: object, action: object) -> None:
        """Check what an input bit does, as `set_standard_digital_input_action`."""
        self._act(f"input bit {integer('port', port, 0, BITS - 1)}", action)

    # ------------------------------------------------------------------ outputs

    def set_runstate_standard_digital_output_to_value(self, outputId: object, state: object) -> None:
        """Choose what an output does while no program runs.

        0: nothing; 1: low; 2: high; 3: low, and high while one runs; 4: low when one ends by an error or a stop;
        5: that, and high when one starts. A paused program does not run.
        """
        self._choose("digital", STANDARD[integer("outputId", outputId, 0, 7)], state)

    def set_runstate_standard_digital_outputs(self, outputs: object) -> None:
        """Check the numbers of outputs. What each does is said by the calls that PolyScope exports behind this one."""
        for output in outputs.items if isinstance(outputs, Array) else (outputs,):
            integer("outputs", output, 0, 7)

    def set_runstate_configurable_digital_output_to_value(self, outputId: object, state: object) -> None:
        """Choose what an output does, as `set_runstate_standard_digital_output_to_value`."""
        self._choose("digital", CONFIGURABLE[integer("outputId", outputId, 0, 7)], state)

    def set_runstate_tool_digital_output_to_value(self, outputId: object, state: object) -> None:
        """Choose what an output does, as `set_runstate_standard_digital_output_to_value`."""
        self._choose("digital", TOOL[integer("outputId", outputId, 0, 1)], state)

    def set_runstate_standard_analog_output_to_value(self, outputId: object, state: object) -> None:
        """Choose what an output does, as `set_runstate_standard_digital_output_to_value`; low is 0 V or 4 mA."""
        self._choose("analog", integer("outputId", outputId, 0, 1), state)

    def set_runstate_gp_boolean_output_to_value(self, outputId: object, state: object) -> None:
        """Choose what an output bit does, as `set_runstate_standard_digital_output_to_value`."""
        self._choose("bit", integer("outputId", outputId, 0, BITS - 1), state)

    # ------------------------------------------------------------------ arm and safety

    def set_safety_mode_transition_hardness(self, type: object) -> None:
        """Check a setting: 0 (hard) or 1 (soft). Stops of the safety system are the same with both."""
        integer("type", type, 0, 1)

    def set_base_acceleration(self, a: object) -> None:
        """Accept that the base stands.

        Raises:
            Fault: It moves, which is not simulated.
        """
        if any(numbers("a", a, 3)):
            raise Fault(
                f"set_base_acceleration: a is {shown(a)}; the simulated arm's base stands, so it must be [0, 0, 0]"
            )

    def get_base_acceleration(self) -> Array:
        """Return the acceleration of the base, which stands [m/s^2]."""
        return Array((0.0, 0.0, 0.0))

    def position_deviation_warning(self, enabled: object, threshold: object = 0.8) -> None:
        """Check a setting; a warning says that deviations are not told if it is enabled."""
        number("threshold", threshold, 0.0, 1.0)
        if flag("enabled", enabled):
            self._warn("position_deviation_warning: this controller does not warn of deviations")

    def reset_revolution_counter(self, qNear: object = _NO_TURNS) -> None:
        """Check joint positions: no joint of the simulated arm turns without end, so there is no counter to reset."""
        numbers("qNear", qNear, self._access.description.joints)

    def motion_version_set(self, version: object) -> None:
        """Remember a motion version, 1 or 2, for `motion_version_get`: moves are planned the same with both."""
        self._motion_version = integer("version", version, 1, 2)

    def motion_version_get(self) -> int:
        """Return the motion version that a program has set, 2 if none has since the server started."""
        return self._motion_version

    def jerk_gain_scaling_set(self, gain: object) -> None:
        """Check a gain, 0.01 to 1. It has no effect: profile and shaper say how quickly accelerations change."""
        number("gain", gain, 0.01, 1.0)

    def high_holding_torque_enable(self) -> None:
        """Do nothing: the drives of the simulated arm hold it with the same torque at all times."""

    def high_holding_torque_disable(self) -> None:
        """Do nothing: the drives of the simulated arm hold it with the same torque at all times."""

    def _act(self, what: str, action: object) -> None:
        if action not in {"default", "freedrive"}:
            raise Fault(f'action is {shown(action)}: it must be "default" or "freedrive"')
        if action == "freedrive":
            self._warn(
                f"{what} has the action freedrive: here freedrive_mode lets the arm be moved by hand, and no input"
            )

    def _choose(self, group: Group, place: int, state: object) -> None:
        what = integer("state", state, 0, 7)
        if what > MOST:
            raise Fault(f"state is {what}: outputs that show whether the arm has power are not simulated")
        self._arm.then(lambda: self._runstate.choose(group, place, what))

    def _warn(self, why: str) -> None:
        self._access.emit("warning", why=why)
