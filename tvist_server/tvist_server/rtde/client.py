"""The client's side of an RTDE connection without its socket: takes bytes, returns bytes to send and rows.

It negotiates version 2, subscribes to outputs, claims any inputs, and starts. Without inputs it only reads.
"""

from collections.abc import Mapping, Sequence
from struct import Struct
from types import MappingProxyType
from typing import NamedTuple

from tvist_protocol.errors import quoted
from tvist_server.rtde.codec import PackageKind, PackageReader, package, words
from tvist_server.rtde.wire import Field, WireType

Row = Mapping[str, tuple[float, ...]]
"""Values of one cycle of the robot by name, each within its range; a single number is a tuple of length 1."""
PROTOCOL = 2  # protocol version, in which the client chooses the frequency
RATE = 500.0  # requested frequency; a robot with a slower cycle sends at its own [Hz]
_VERSION = Struct(">4I")


class RtdeError(ValueError):
    """The other end violates RTDE; the message says how."""


class Received(NamedTuple):
    """Content of the bytes that have come from the robot, and the bytes to answer."""

    send: bytes
    rows: Sequence[Row]  # complete rows, in order
    texts: Sequence[str]


class RtdeClient:
    """Reads one robot's outputs and writes its inputs."""

    def __init__(
        self,
        needed: Mapping[str, Field],  # types and ranges of the required variables
        optional: Mapping[str, Field],  # the same of variables that may be missing in rows of some robots
        inputs: Mapping[str, WireType] = MappingProxyType({}),  # types of the inputs to claim; no vectors
    ) -> None:
        self._needed, self._types = needed, {**needed, **optional}
        self._inputs, self._claimed = inputs, 0
        self._written = Struct(">B" + "".join(wire.value for wire in inputs.values()))
        self._names = list(self._types)
        self._reader = PackageReader()
        self._row: Struct | None = None
        self._recipe = 0
        self.version: tuple[int, ...] = ()
        """Software version of the controller: major, minor, bugfix, build; empty before its answer."""
        self.started = False

    @property
    def lacking(self) -> list[str]:
        """Names of requested variables that the robot does not know."""
        return [name for name in self._types if name not in self._names]

    def begin(self) -> bytes:
        """Return the first bytes to send."""
        return package(PackageKind.REQUEST_PROTOCOL_VERSION, PROTOCOL.to_bytes(2, "big"))

    def receive(self, data: bytes) -> Received:
        """Take bytes from the robot; raise RtdeError if they are not a robot's answer."""
        send, rows, texts = b"", list[Row](), list[str]()
        for kind, payload in self._reader.feed(data):
            if kind == PackageKind.DATA:
                rows += self._rows(payload)
            elif kind == PackageKind.TEXT_MESSAGE:
                texts.append(payload[1 : 1 + payload[0]].decode(errors="replace") if payload else "")
            else:
                send += self._answered(kind, payload)
        return Received(send, rows, texts)

    def write(self, numbers: Sequence[float]) -> bytes:
        """Return a package with the values of all inputs, in order, once the connection has started."""
        return package(PackageKind.DATA, self._written.pack(self._claimed, *numbers))

    def _answered(self, kind: int, payload: bytes) -> bytes:
        match kind:
            case PackageKind.REQUEST_PROTOCOL_VERSION if payload[:1] == b"\x01":
                return package(PackageKind.GET_URCONTROL_VERSION)
            case PackageKind.REQUEST_PROTOCOL_VERSION:
                raise RtdeError("it refuses version 2 of RTDE: update its software")
            case PackageKind.GET_URCONTROL_VERSION if len(payload) >= _VERSION.size:
                self.version = _VERSION.unpack_from(payload)
                return self._set_up()
            case PackageKind.SETUP_OUTPUTS:
                return self._take_recipe(payload)
            case PackageKind.SETUP_INPUTS if self._inputs:
                self._take_claim(payload)
                return package(PackageKind.START)
            case PackageKind.START if payload[:1] == b"\x01":
                self.started = True
                return b""
            case PackageKind.START:
                raise RtdeError("it refuses to start its outputs")
        raise RtdeError(f"it sends a package of type {kind} with {len(payload)} bytes, which is no answer")

    def _set_up(self) -> bytes:
        names = ",".join(self._names).encode()
        return package(PackageKind.SETUP_OUTPUTS, Struct(">d").pack(RATE) + names)

    def _take_recipe(self, payload: bytes) -> bytes:
        """Take the types of the variables and start; ask again without those that the robot does not know."""
        types = _types(payload, len(self._names), "variables")
        unknown = [name for name, word in zip(self._names, types, strict=True) if word == "NOT_FOUND"]
        if needed := [name for name in unknown if name in self._needed]:
            raise RtdeError(f"it does not know {', '.join(needed)}, without which there is nothing to watch")
        if unknown:
            self._names = [name for name in self._names if name not in unknown]
            return self._set_up()
        for name, word in zip(self._names, types, strict=True):
            if word != self._types[name].wire.name:
                raise RtdeError(f"{name} is of type {quoted(word)}, not {self._types[name].wire.name}")
        self._recipe = payload[0]
        self._row = Struct(">" + "".join(self._types[name].wire.value for name in self._names))
        if self._inputs:
            return words(PackageKind.SETUP_INPUTS, b"", self._inputs)
        return package(PackageKind.START)

    def _take_claim(self, payload: bytes) -> None:
        found = _types(payload, len(self._inputs), "inputs")
        by_word: dict[str, list[str]] = {}
        for name, word in zip(self._inputs, found, strict=True):
            by_word.setdefault(word, []).append(name)
        if names := by_word.get("IN_USE"):
            raise RtdeError(
                f"another client holds its inputs {names[0]} to {names[-1]}: end that client, such as a fieldbus, a "
                "driver or another tvist, and start again"
            )
        if names := by_word.get("NOT_FOUND"):
            raise RtdeError(
                f"it does not know its inputs {names[0]} to {names[-1]}: update its software to one with 48 registers"
            )
        for name, wire in self._inputs.items():
            if name not in by_word.get(wire.name, ()):
                raise RtdeError(f"its input {name} is not of type {wire.name}")
        self._claimed = payload[0]

    def _rows(self, payload: bytes) -> Sequence[Row]:
        if self._row is None or payload[:1] != bytes([self._recipe]):
            return ()  # a row of a replaced recipe
        if len(payload) != 1 + self._row.size:
            raise RtdeError(f"a row has {len(payload) - 1} bytes instead of {self._row.size}")
        numbers, row, at = self._row.unpack_from(payload, 1), dict[str, tuple[float, ...]](), 0
        for name in self._names:
            wire, least, most = self._types[name]
            row[name] = values = numbers[at : at + wire.length]
            wrong = [value for value in values if not least <= value <= most]  # or NaN
            if wrong:
                raise RtdeError(f"its {name} is {wrong[0]:g}: must be {least:g} to {most:g}")
            at += len(values)
        return (row,)


def _types(payload: bytes, count: int, of: str) -> list[str]:
    """Return the types of `count` variables, which follow the number of a recipe."""
    found = payload[1:].decode("ascii", "replace").removesuffix(",").split(",")
    if len(found) != count:
        raise RtdeError(f"it names {len(found)} types for {count} {of}")
    return found
