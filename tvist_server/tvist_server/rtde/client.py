"""The reading end of an RTDE connection, without its socket: bytes in, bytes and rows out.

It asks for protocol version 2, for the controller's version and for a list of outputs, and starts them. It knows no
other package, so that it can neither write a register nor send a command.
"""

from collections.abc import Mapping, Sequence
from struct import Struct
from typing import NamedTuple

from tvist_protocol.errors import quoted
from tvist_server.rtde.codec import PackageKind, PackageReader, package
from tvist_server.rtde.wire import Field

Row = Mapping[str, tuple[float, ...]]
"""Values of one cycle of the robot by name, each in its range; a number is a tuple of one."""
PROTOCOL = 2
"""Version of the protocol, in which the client chooses the frequency."""
RATE = 500.0
"""Frequency that is asked for; a robot with a slower cycle sends at its own [Hz]."""
_VERSION = Struct(">4I")


class RtdeError(ValueError):
    """The other end does not speak RTDE as a robot does; the message says what it did."""


class Received(NamedTuple):
    """What bytes from the robot have led to."""

    send: bytes
    """Bytes to send."""
    rows: Sequence[Row]
    """Rows that are complete, in the order in which they came."""
    texts: Sequence[str]
    """Messages of the controller for people."""


class RtdeClient:
    """Reads one robot's outputs.

    Args:
        needed: Types and ranges of the variables without which the rows are of no use, by name.
        optional: Those of further variables, which some robots do not know and rows then lack.
    """

    def __init__(self, needed: Mapping[str, Field], optional: Mapping[str, Field]) -> None:
        self._needed, self._types = needed, {**needed, **optional}
        self._names = list(self._types)
        self._reader = PackageReader()
        self._row: Struct | None = None
        self._recipe = 0
        self.version: tuple[int, ...] = ()
        """Version of the controller's software: major, minor, bugfix, build; empty until it has said so."""
        self.started = False
        """Whether the robot sends rows."""

    @property
    def lacking(self) -> list[str]:
        """Names that the robot does not know."""
        return [name for name in self._types if name not in self._names]

    def begin(self) -> bytes:
        """Return the first bytes to send."""
        return package(PackageKind.REQUEST_PROTOCOL_VERSION, PROTOCOL.to_bytes(2, "big"))

    def receive(self, data: bytes) -> Received:
        """Take bytes from the robot.

        Raises:
            RtdeError: They are not what a robot answers.
        """
        send, rows, texts = b"", list[Row](), list[str]()
        for kind, payload in self._reader.feed(data):
            if kind == PackageKind.DATA:
                rows += self._rows(payload)
            elif kind == PackageKind.TEXT_MESSAGE:
                texts.append(payload[1 : 1 + payload[0]].decode(errors="replace") if payload else "")
            else:
                send += self._answered(kind, payload)
        return Received(send, rows, texts)

    def _answered(self, kind: int, payload: bytes) -> bytes:
        """Take the answer to a package; return the next one."""
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
        """Take the types of the variables, and start; ask again without those that the robot does not know."""
        words = payload[1:].decode("ascii", "replace").removesuffix(",").split(",")
        if len(words) != len(self._names):
            raise RtdeError(f"it names {len(words)} types for {len(self._names)} variables")
        unknown = [name for name, word in zip(self._names, words, strict=True) if word == "NOT_FOUND"]
        if needed := [name for name in unknown if name in self._needed]:
            raise RtdeError(f"it does not know {', '.join(needed)}, without which there is nothing to watch")
        if unknown:
            self._names = [name for name in self._names if name not in unknown]
            return self._set_up()
        for name, word in zip(self._names, words, strict=True):
            if word != self._types[name].wire.name:
                raise RtdeError(f"{name} is of type {quoted(word)}, not {self._types[name].wire.name}")
        self._recipe = payload[0]
        self._row = Struct(">" + "".join(self._types[name].wire.value for name in self._names))
        return self._begin_rows()

    def _begin_rows(self) -> bytes:
        """Return what to send once the outputs are set up."""
        return package(PackageKind.START)

    def _rows(self, payload: bytes) -> Sequence[Row]:
        if self._row is None or payload[:1] != bytes([self._recipe]):
            return ()  # of a recipe that was replaced
        if len(payload) != 1 + self._row.size:
            raise RtdeError(f"a row has {len(payload) - 1} bytes instead of {self._row.size}")
        numbers, row, at = self._row.unpack_from(payload, 1), dict[str, tuple[float, ...]](), 0
        for name in self._names:
            wire, least, most = self._types[name]
            row[name] = values = numbers[at : at + wire.length]
            wrong = [value for value in values if not least <= value <= most]  # or no number
            if wrong:
                raise RtdeError(f"its {name} is {wrong[0]:g}: must be {least:g} to {most:g}")
            at += len(values)
        return (row,)
