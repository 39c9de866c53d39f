"""Set-up of terminals, tool and safety by programs from PolyScope; settings without effect are only checked."""

from collections.abc import Callable
from typing import Annotated, Any

from tvist_controller.programs import arguments as args
from tvist_controller.programs.functions.group import FunctionContext, FunctionGroup, described, reads
from tvist_controller.programs.functions.terminals import BitPlace, Configurable, Standard, Tool
from tvist_controller.programs.indicators import SHOWS_UNTIL_FAILURE, Group
from tvist_urscript import Array, Fault

RATES = (9600, 19200, 38400, 57600, 115200, 1000000, 2000000, 5000000)  # Baud rates of the tool's serial line
_NO_TURNS: Any = Array((0.0,) * 6)


def _rate(name: str, value: object) -> int:
    rate = args.integer(name, value, RATES[0], RATES[-1])
    if rate not in RATES:
        raise Fault(f"{name} is {rate}: it must be one of {', '.join(map(str, RATES))}")
    return rate


def _run_state(name: str, value: object) -> int:
    what = args.integer(name, value, 0, 7)
    if what > SHOWS_UNTIL_FAILURE:
        raise Fault(f"{name} is {what}: outputs that show whether the arm has power are not simulated")
    return what


def _at_rest(name: str, value: object) -> None:
    if any(args.numbers(name, value, 3)):
        why = "the simulated arm's base stands, so it must be [0, 0, 0]"
        raise Fault(f"set_base_acceleration: {name} is {args.shown(value)}; {why}")


RunState = Annotated[int, _run_state]
Action = Annotated[str, args.word("default", "freedrive")]
Octet = Annotated[int, args.whole(0, 7)]


_AS_INPUT = "Check an input's action, as `set_standard_digital_input_action`."
_AS_OUTPUT = "Choose what an output does, as `set_runstate_standard_digital_output_to_value`."


def _input_action(what: str, where: str, place: object) -> Callable[[FunctionGroup, int, str], None]:
    def check(self: FunctionGroup, port: int, action: Action) -> None:
        if action == "freedrive":
            why = "here freedrive_mode lets the arm be moved by hand, and no input"
            self._warn(f"{where} {port} has the action freedrive: {why}")

    return described(check, what, port=place)


def _runstate_output(what: str, group: Group, place: object) -> Callable[[FunctionGroup, int, int], None]:
    def choose(self: FunctionGroup, outputId: int, state: RunState) -> None:
        self._arm.then(lambda: self._parts.runstate.choose(group, outputId, state))

    return described(choose, what, outputId=place)


class SetupFunctions(FunctionGroup):
    """Set-up of one robot."""

    title = "Set-up"

    def __init__(self, on: FunctionContext) -> None:
        super().__init__(on)
        self._motion_version = 2

    # ------------------------------------------------------------------ tool

    def set_tool_analog_input_domain(self, port: args.Bit, domain: Annotated[bool, args.either]) -> None:
        """Make an analogue input of the tool a current (0) or a voltage (1)."""
        self._arm.then(lambda: self._peripherals.choose_tool_input(port, voltage=domain))

    def set_tool_output_mode(self, mode: args.Bit) -> None:
        """Use the tool's digital outputs as outputs (0) or as a second supply (1)."""
        self._arm.then(lambda: self._peripherals.set_tool(tool_output_mode=mode))

    def set_tool_digital_output_mode(self, n: args.Bit, mode: Annotated[int, args.whole(1, 3)]) -> None:
        """Make a digital output of the tool sinking (1), sourcing (2), or both (3)."""
        self._arm.then(lambda: self._peripherals.set_tool(**{f"tool_digital_output{n}_mode": mode}))

    def set_tool_communication(
        self,
        enabled: args.Flag,
        baud_rate: Annotated[int, _rate],
        parity: Annotated[int, args.whole(0, 2)],
        stop_bits: Annotated[int, args.whole(1, 2)],
        rx_idle_chars: Annotated[float, args.within(1.0, 40.0)],
        tx_idle_chars: Annotated[float, args.within(0.0, 40.0)],
    ) -> None:
        """Check settings of the tool's serial line; enabling it warns that nothing is connected."""
        if enabled:
            self._warn("set_tool_communication: no tool is connected to the simulated arm's serial line")

    # ------------------------------------------------------------------ inputs

    def set_input_actions_to_default(self) -> None:
        """Do nothing: no input starts freedrive."""

    set_standard_digital_input_action = _input_action(
        'Check an input\'s action, "default" or "freedrive"; the latter warns that it has no effect.',
        "standard digital input",
        Octet,
    )
    set_configurable_digital_input_action = _input_action(_AS_INPUT, "configurable digital input", Octet)
    set_tool_digital_input_action = _input_action(_AS_INPUT, "tool digital input", args.Bit)
    set_gp_boolean_input_action = _input_action(
        "Check an input bit's action, as `set_standard_digital_input_action`.", "input bit", BitPlace
    )

    # ------------------------------------------------------------------ outputs

    set_runstate_standard_digital_output_to_value = _runstate_output(
        """Choose what an output does while no program runs.

        0: nothing; 1: low; 2: high; 3: low, but high while one runs; 4: low when one ends by an error or a
        stop; 5: as 4, and high when one starts. A paused program does not run.
        """,
        "digital",
        Standard,
    )

    def set_runstate_standard_digital_outputs(self, outputs: object) -> None:
        """Check output numbers; the calls that PolyScope exports after this one define their actions."""
        for output in outputs.items if isinstance(outputs, Array) else (outputs,):
            args.integer("outputs", output, 0, 7)

    set_runstate_configurable_digital_output_to_value = _runstate_output(_AS_OUTPUT, "digital", Configurable)
    set_runstate_tool_digital_output_to_value = _runstate_output(_AS_OUTPUT, "digital", Tool)
    set_runstate_standard_analog_output_to_value = _runstate_output(
        f"{_AS_OUTPUT[:-1]}; low is 0 V or 4 mA.", "analog", args.Bit
    )
    set_runstate_gp_boolean_output_to_value = _runstate_output(
        "Choose what an output bit does, as `set_runstate_standard_digital_output_to_value`.", "bit", BitPlace
    )

    # ------------------------------------------------------------------ arm and safety

    def set_safety_mode_transition_hardness(self, type: args.Bit) -> None:
        """Check a setting, 0 (hard) or 1 (soft); stops of the safety system are the same for both."""

    def set_base_acceleration(self, a: Annotated[None, _at_rest]) -> None:
        """Check that the acceleration of the base is zero."""

    get_base_acceleration = reads(
        "Return zero, the acceleration of the base [m/s^2].", lambda _: Array((0.0, 0.0, 0.0))
    )

    def position_deviation_warning(self, enabled: args.Flag, threshold: args.Share = 0.8) -> None:
        """Check a setting; enabling it causes a warning, because deviations are not reported."""
        if enabled:
            self._warn("position_deviation_warning: this controller does not warn of deviations")

    def reset_revolution_counter(self, qNear: args.Joints = _NO_TURNS) -> None:
        """Check joint positions; no simulated joint turns endlessly, so there is no counter to reset."""

    def motion_version_set(self, version: Annotated[int, args.whole(1, 2)]) -> None:
        """Store a motion version, 1 or 2, for `motion_version_get`; moves are the same for both."""
        self._motion_version = version

    def motion_version_get(self) -> int:
        """Return the motion version set by a program, 2 if none has been set since the server started."""
        return self._motion_version

    def jerk_gain_scaling_set(self, gain: Annotated[float, args.within(0.01, 1.0)]) -> None:
        """Check a gain, 0.01 to 1; it has no effect, since profile and shaper determine the jerk."""

    def high_holding_torque_enable(self) -> None:
        """Do nothing: the simulated drives always hold with the same torque."""

    high_holding_torque_disable = high_holding_torque_enable
