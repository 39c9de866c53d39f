"""Packages of the wire: cut out of the stream, and put together. Nothing here knows what they mean."""

from collections.abc import Iterable
from enum import IntEnum
from struct import Struct

HEADER = Struct(">HB")
LARGEST = 0xFFFF
"""Size of a package, header included [bytes]."""
TEXT = 255
"""Longest text in a message [bytes]."""


class PackageKind(IntEnum):
    """What a package is, by its letter."""

    REQUEST_PROTOCOL_VERSION = ord("V")
    GET_URCONTROL_VERSION = ord("v")
    TEXT_MESSAGE = ord("M")
    DATA = ord("U")
    SETUP_OUTPUTS = ord("O")
    SETUP_INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


class TextLevel(IntEnum):
    """How grave a text message is."""

    EXCEPTION = 0
    ERROR = 1
    WARNING = 2
    INFO = 3


class PackageReader:
    """Cuts a stream into packages.

    It never holds more than one unfinished package. A size smaller than the header's three bytes is a lie with which
    nothing can be found again for certain; it is taken for three, so that reading goes on behind the header.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Kind and payload of each package that is complete now; what lied about its size is left out."""
        buffer = self._buffer
        buffer += data
        at, packages = 0, []
        while len(buffer) - at >= HEADER.size:
            size, kind = HEADER.unpack_from(buffer, at)
            if size < HEADER.size:
                at += HEADER.size
                continue
            if len(buffer) - at < size:
                break
            packages.append((kind, bytes(buffer[at + HEADER.size : at + size])))
            at += size
        del buffer[:at]
        return packages


def package(kind: PackageKind, payload: bytes = b"") -> bytes:
    """A package; its payload must fit."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def words(kind: PackageKind, head: bytes, names: Iterable[str]) -> bytes:
    """A package of words between commas, cut behind the last one that fits: its size has two bytes and no more."""
    text = ",".join(names).encode()
    room = LARGEST - HEADER.size - len(head)
    if len(text) > room:
        text = text[: text.rindex(b",", 0, room + 1)]
    return package(kind, head + text)


def text_message(version: int, level: TextLevel, text: str, source: str) -> bytes:
    """A message to the client; version 1 has neither lengths nor source."""
    message = text.encode()[:TEXT]
    if version == 1:
        return package(PackageKind.TEXT_MESSAGE, bytes([level]) + message)
    named = source.encode()[:TEXT]
    return package(
        PackageKind.TEXT_MESSAGE,
        bytes([len(message)]) + message + bytes([len(named)]) + named + bytes([level]),
    )
