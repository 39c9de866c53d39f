"""The controller's functions without a robot: motions are noted, registers are memory, and no socket can be opened."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from tvist_urscript.errors import Fault
from tvist_urscript.signatures import Signature, signature
from tvist_urscript.values import Array, Pose, Value, integer, number, short, to_str

STEP = 0.002
"""Seconds of a tick."""
REGISTERS = 48
"""Registers of each kind; there are 128 of booleans."""
BITS = 128

_MOTIONS = {
    "movej": "q, a=1.4, v=1.05, t=0, r=0",
    "movel": "pose, a=1.2, v=0.25, t=0, r=0",
    "movep": "pose, a=1.2, v=0.25, r=0",
    "movec": "pose_via, pose_to, a=1.2, v=0.25, r=0, mode=0",
    "optimovej": "goal, a=0.3, v=0.3, r=0",
    "optimovel": "goal, a=0.3, v=0.3, r=0",
    "servoj": "q, a=0, v=0, t=0.002, lookahead_time=0.1, gain=300",
    "servoc": "pose, a=1.2, v=0.25, r=0",
    "speedj": "qd, a, t=0",
    "speedl": "xd, a, t=0, aRot=0",
    "stopj": "a",
    "stopl": "a, aRot=0",
}
_SETTINGS = {
    "end_force_mode": "",
    "end_freedrive_mode": "",
    "end_teach_mode": "",
    "force_mode": "task_frame, selection_vector, wrench, type, limits",
    "force_mode_set_damping": "damping",
    "force_mode_set_gain_scaling": "scaling",
    "freedrive_mode": "freeAxes=[1, 1, 1, 1, 1, 1], feature=p[0, 0, 0, 0, 0, 0]",
    "popup": 's, title="Popup", warning=False, error=False, blocking=False',
    "set_gravity": "d",
    "set_payload": "m, cog=None",
    "set_target_payload": "m, cog, inertia=[0, 0, 0, 0, 0, 0], transition_time=0",
    "set_tcp": 'pose, tcp_name=""',
    "set_tool_voltage": "voltage",
    "teach_mode": "",
    "zero_ftsensor": "",
}
_SOCKETS: dict[str, tuple[str, Value]] = {
    "socket_open": ('address, port, socket_name="socket_0"', False),
    "socket_close": ('socket_name="socket_0"', None),
    "socket_get_var": ('name, socket_name="socket_0"', 0),
    "socket_read_ascii_float": ('number, socket_name="socket_0", timeout=2', Array((0,))),
    "socket_read_binary_integer": ('number, socket_name="socket_0", timeout=2', Array((0,))),
    "socket_read_byte_list": ('number, socket_name="socket_0", timeout=2', Array((0,))),
    "socket_read_line": ('socket_name="socket_0", timeout=2', ""),
    "socket_read_string": (
        'socket_name="socket_0", prefix="", suffix="", interpret_escape=False, timeout=2',
        "",
    ),
    "socket_send_byte": ('value, socket_name="socket_0"', False),
    "socket_send_int": ('value, socket_name="socket_0"', False),
    "socket_send_line": ('str, socket_name="socket_0"', False),
    "socket_send_string": ('str, socket_name="socket_0"', False),
    "socket_set_var": ('name, value, socket_name="socket_0"', None),
}
"""Signature of each, and its value where nothing can be reached; the lists are those of a failed read of any length."""
_JOINTS = Array((0.0,) * 6)
_STATE: dict[str, Value] = {
    "get_actual_joint_positions": _JOINTS,
    "get_actual_joint_speeds": _JOINTS,
    "get_joint_positions": _JOINTS,
    "get_target_joint_positions": _JOINTS,
    "get_target_joint_speeds": _JOINTS,
    "get_actual_tcp_pose": Pose((0.0,) * 6),
    "get_target_tcp_pose": Pose((0.0,) * 6),
    "get_tcp_offset": Pose((0.0,) * 6),
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
            "textmsg": (signature('s1, s2=""'), self._say),
            "sync": (signature("", blocks=True), _sync),
            "sleep": (signature("t", blocks=True), _sleep),
            "set_digital_out": (signature("n, b"), self._set_digital),
            "get_digital_out": (signature("n"), self._get_digital),
            "get_digital_in": (signature("n"), _false),
            "set_analog_out": (signature("n, f"), self._set_analog),
            "get_analog_out": (signature("n"), self._get_analog),
            "get_analog_in": (signature("n"), _zero),
            "set_standard_digital_out": (signature("n, b"), self._set_digital),
        }
        for name, text in _MOTIONS.items():
            motion = signature(text, blocks=True)
            table[name] = (motion, self._motion(name, motion))
        for name, text in _SETTINGS.items():
            setting = signature(text)
            table[name] = (setting, self._note(name, setting))
        for name, (text, value) in _SOCKETS.items():
            table[name] = (signature(text, blocks=True), _failing(value))
        for name, value in _STATE.items():
            table[name] = (signature(""), lambda value=value: value)
        for kind, word in (("int", "integer"), ("double", "float"), ("bit", "boolean")):
            table[f"read_input_{word}_register"] = (signature("address"), self._reader(self.inputs, kind))
            table[f"read_output_{word}_register"] = (signature("address"), self._reader(self.outputs, kind))
            table[f"write_output_{word}_register"] = (signature("address, value"), self._writer(kind))
        return table

    def _say(self, s1: Value, s2: Value) -> None:
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
        return lambda address: registers[kind].get(_address(address, kind), nothing[kind])

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
