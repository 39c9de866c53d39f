"""The controller's functions without a robot: motions are noted, registers are memory, and no socket can be opened."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from tvist_urscript.errors import Fault
from tvist_urscript.signatures import Parameter, Signature, parameters, signature
from tvist_urscript.values import Array, Pose, Value, integer, number, short, to_str

STEP = 0.002
"""Duration of a tick [s]."""
REGISTERS = 48
"""Number of registers of integers, and of floats; there are BITS of booleans."""
BITS = 128

_NOWHERE = Pose((0.0,) * 6)
_SOCKET: dict[str, Value] = {"socket_name": "socket_0"}
_MOTIONS = {
    "movej": parameters("q", a=1.4, v=1.05, t=0, r=0),
    "movel": parameters("pose", a=1.2, v=0.25, t=0, r=0),
    "movep": parameters("pose", a=1.2, v=0.25, r=0),
    "movec": parameters("pose_via", "pose_to", a=1.2, v=0.25, r=0, mode=0),
    "optimovej": parameters("goal", a=0.3, v=0.3, r=0),
    "optimovel": parameters("goal", a=0.3, v=0.3, r=0),
    "servoj": parameters("q", a=0, v=0, t=0.002, lookahead_time=0.1, gain=300),
    "servoc": parameters("pose", a=1.2, v=0.25, r=0),
    "speedj": parameters("qd", "a", t=0),
    "speedl": parameters("xd", "a", t=0, aRot=0),
    "stopj": parameters("a"),
    "stopl": parameters("a", aRot=0),
}
_SETTINGS = {
    "end_force_mode": parameters(),
    "end_freedrive_mode": parameters(),
    "end_teach_mode": parameters(),
    "force_mode": parameters("task_frame", "selection_vector", "wrench", "type", "limits"),
    "force_mode_set_damping": parameters("damping"),
    "force_mode_set_gain_scaling": parameters("scaling"),
    "freedrive_mode": parameters(freeAxes=Array((1,) * 6), feature=_NOWHERE),
    "popup": parameters("s", title="Popup", warning=False, error=False, blocking=False),
    "set_gravity": parameters("d"),
    "set_payload": parameters("m", cog=None),
    "set_target_payload": parameters("m", "cog", inertia=Array((0,) * 6), transition_time=0),
    "set_tcp": parameters("pose", tcp_name=""),
    "set_tool_voltage": parameters("voltage"),
    "teach_mode": parameters(),
    "zero_ftsensor": parameters(),
}
_SOCKETS: dict[str, tuple[tuple[Parameter, ...], Value]] = {
    "socket_open": (parameters("address", "port", **_SOCKET), False),
    "socket_close": (parameters(**_SOCKET), None),
    "socket_get_var": (parameters("name", **_SOCKET), 0),
    "socket_read_ascii_float": (parameters("number", **_SOCKET, timeout=2), Array((0,))),
    "socket_read_binary_integer": (parameters("number", **_SOCKET, timeout=2), Array((0,))),
    "socket_read_byte_list": (parameters("number", **_SOCKET, timeout=2), Array((0,))),
    "socket_read_line": (parameters(**_SOCKET, timeout=2), ""),
    "socket_read_string": (
        parameters(**_SOCKET, prefix="", suffix="", interpret_escape=False, timeout=2),
        "",
    ),
    "socket_send_byte": (parameters("value", **_SOCKET), False),
    "socket_send_int": (parameters("value", **_SOCKET), False),
    "socket_send_line": (parameters("str", **_SOCKET), False),
    "socket_send_string": (parameters("str", **_SOCKET), False),
    "socket_set_var": (parameters("name", "value", **_SOCKET), None),
}
"""Parameters of each, and its value where nothing can be reached; lists are those of a failed read of any length."""
_JOINTS = Array((0.0,) * 6)
_STATE: dict[str, Value] = {
    "get_actual_joint_positions": _JOINTS,
    "get_actual_joint_speeds": _JOINTS,
    "get_joint_positions": _JOINTS,
    "get_target_joint_positions": _JOINTS,
    "get_target_joint_speeds": _JOINTS,
    "get_actual_tcp_pose": _NOWHERE,
    "get_target_tcp_pose": _NOWHERE,
    "get_tcp_offset": _NOWHERE,
    "get_steptime": STEP,
    "is_steady": True,
}


@dataclass
class Memory:
    """What a program has written, and what it can read.

    Attributes:
        said: The texts of `textmsg`.
        calls: The motions and settings, as they would be written.
        inputs: By kind (`int`, `double`, `bit`), what the input registers contain.
        outputs: By kind, what the output registers contain, by number.
        digital: The digital outputs, by number.
        analog: The analogue outputs, by number.
    """

    said: list[str] = field(default_factory=list)
    calls: list[str] = field(default_factory=list)
    inputs: dict[str, dict[int, Value]] = field(default_factory=lambda: {"int": {}, "double": {}, "bit": {}})
    outputs: dict[str, dict[int, Value]] = field(default_factory=lambda: {"int": {}, "double": {}, "bit": {}})
    digital: dict[int, Value] = field(default_factory=dict)
    analog: dict[int, Value] = field(default_factory=dict)

    def functions(self) -> dict[str, tuple[Signature, Callable[..., Any]]]:
        """Return the functions, each with its signature."""
        table: dict[str, tuple[Signature, Callable[..., Any]]] = {
            name: (signature(function), function)
            for name, function in (
                ("textmsg", self._say),
                ("sync", _sync),
                ("sleep", _sleep),
                ("set_digital_out", self._set_digital),
                ("get_digital_out", self._get_digital),
                ("get_digital_in", _false),
                ("set_analog_out", self._set_analog),
                ("get_analog_out", self._get_analog),
                ("get_analog_in", _zero),
                ("set_standard_digital_out", self._set_digital),
            )
        }
        for name, given in _MOTIONS.items():
            motion = Signature(given, blocks=True)
            table[name] = (motion, self._motion(name, motion))
        for name, given in _SETTINGS.items():
            setting = Signature(given)
            table[name] = (setting, self._note(name, setting))
        for name, (given, value) in _SOCKETS.items():
            table[name] = (Signature(given, blocks=True), _failing(value))
        for name, value in _STATE.items():
            table[name] = (Signature(()), lambda value=value: value)
        for kind, word in (("int", "integer"), ("double", "float"), ("bit", "boolean")):
            for name, function in (
                (f"read_input_{word}_register", self._reader(self.inputs, kind)),
                (f"read_output_{word}_register", self._reader(self.outputs, kind)),
                (f"write_output_{word}_register", self._writer(kind)),
            ):
                table[name] = (signature(function), function)
        return table

    def _say(self, s1: Value, s2: Value = "") -> None:
        self.said.append(short(to_str(s1) + to_str(s2)))

    def _set_digital(self, n: Value, b: Value) -> None:
        self.digital[integer(n, "the number of an output")] = bool(b)

    def _get_digital(self, n: Value) -> Value:
        return self.digital.get(integer(n, "the number of an output"), False)

    def _set_analog(self, n: Value, f: Value) -> None:
        self.analog[integer(n, "the number of an output")] = float(number(f, "the value of an output"))

    def _get_analog(self, n: Value) -> Value:
        return self.analog.get(integer(n, "the number of an output"), 0.0)

    def _note(self, name: str, known: Signature) -> Callable[..., None]:
        def note(*arguments: Value) -> None:
            given = list(arguments)
            while given and given[-1] == known.parameters[len(given) - 1].default:
                given.pop()
            self.calls.append(f"{name}({', '.join(map(written, given))})")

        return note

    def _motion(self, name: str, known: Signature) -> Callable[..., Generator[None, None, None]]:
        note = self._note(name, known)

        def motion(*arguments: Value) -> Generator[None, None, None]:
            note(*arguments)
            yield

        return motion

    def _reader(self, registers: dict[str, dict[int, Value]], kind: str) -> Callable[[Value], Value]:
        nothing: dict[str, Value] = {"int": 0, "double": 0.0, "bit": False}

        def read(address: Value) -> Value:
            return registers[kind].get(_address(address, kind), nothing[kind])

        return read

    def _writer(self, kind: str) -> Callable[[Value, Value], None]:
        def write(address: Value, value: Value) -> None:
            place = _address(address, kind)
            if kind == "int":
                value = integer(value, "the value of an integer register")
            elif kind == "double":
                value = float(number(value, "the value of a float register"))
            elif type(value) is not bool:
                raise Fault("the value of a boolean register has to be True or False")
            self.outputs[kind][place] = value

        return write


def written(value: Value) -> str:
    """Write a value as a script would, floats with all their digits."""
    if type(value) is str:
        return f'"{value}"'
    if isinstance(value, Array):
        return f"{'p' if type(value) is Pose else ''}[{', '.join(map(written, value.items))}]"
    return repr(value)


def _address(address: Value, kind: str) -> int:
    place = integer(address, "the number of a register")
    limit = BITS if kind == "bit" else REGISTERS
    if not 0 <= place < limit:
        raise Fault(f"register {place} does not exist: they are numbered from 0 to {limit - 1}")
    return place


def _false(n: Value) -> bool:
    integer(n, "the number of an input")
    return False


def _zero(n: Value) -> float:
    integer(n, "the number of an input")
    return 0.0


def _failing(value: Value) -> Callable[..., Generator[None, None, Value]]:
    def fail(*_: Value) -> Generator[None, None, Value]:
        yield
        return value

    return fail


def _sync() -> Generator[None, None, None]:
    yield


def _sleep(t: Value) -> Generator[None, None, None]:
    seconds = number(t, "the time of sleep")
    if not 0 <= seconds <= 1e6:
        raise Fault(f"sleep takes a time from 0 to 1000000 s, not {seconds:g}")
    for _ in range(round(seconds / STEP)):
        yield
