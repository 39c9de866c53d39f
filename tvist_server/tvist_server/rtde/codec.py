"""Splits a byte stream into packages, and makes packages of payloads."""

from collections.abc import Iterable
from enum import IntEnum
from struct import Struct

HEADER = Struct(">HB")
LARGEST = 0xFFFF  # largest size of a package including the header [bytes]
TEXT = 255  # longest text in a message [bytes]
WARNING = b"\x02"  # severity of a text message
SOURCE = b"\x04RTDE"  # source of a text message, behind its length


class PackageKind(IntEnum):
    """Type of a package; its number is the ASCII code of a letter."""

    REQUEST_PROTOCOL_VERSION = ord("V")
    GET_URCONTROL_VERSION = ord("v")
    TEXT_MESSAGE = ord("M")
    DATA = ord("U")
    SETUP_OUTPUTS = ord("O")
    SETUP_INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


class PackageReader:
    """Splits a byte stream into packages; if a size is less than the header's, only the header is skipped."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Add bytes; return type and payload of each package that is now complete."""
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
    """Return a package. Header and payload must not exceed 65535 bytes."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def words(kind: PackageKind, head: bytes, names: Iterable[str]) -> bytes:
    """Return a package of `head` and words separated by commas; words beyond 65535 bytes are omitted."""
    text = ",".join(names).encode()
    room = LARGEST - HEADER.size - len(head)
    if len(text) > room:
        text = text[: text.rindex(b",", 0, room + 1)]
    return package(kind, head + text)


def warning(version: int, text: str) -> bytes:
    """Return a warning to the client, without lengths and source in version 1; texts are cut after 255 bytes."""
    message = text.encode()[:TEXT]
    if version == 1:
        return package(PackageKind.TEXT_MESSAGE, WARNING + message)
    return package(PackageKind.TEXT_MESSAGE, bytes([len(message)]) + message + SOURCE + WARNING)
