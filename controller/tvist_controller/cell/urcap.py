r"""The text protocol of Robotiq's URCap, port 63352: `SET POS 255 GTO 1\n` is answered by `ack`, `GET POS\n` by a line.

A `GET POS` without a line feed is answered by the value alone, with leading zeros: so the URCap's own functions ask,
which read a fixed number of bytes. There is no `\n` after `ack` for the same reason.
"""

import re
from typing import Final

from tvist_controller.cell.gripper import WRITABLE, Gripper

PORT: Final = 63352
"""TCP port on which the URCap listens."""
SLAVES = ("9", "1")
"""Numbers by which clients select the only gripper, SID."""
UNKNOWN: Final = b"?"
"""Answer to what is not understood."""
LONGEST: Final = 1024
"""Longest line [bytes]."""
_DIGITS = {"PRE": 3, "POS": 3, "SPE": 3, "FOR": 3, "MSC": 3, "FLT": 2}
"""Digits of a value that is answered alone; 1 for others."""
_BARE_GET = re.compile(rb"GET [A-Z]{3}")
_LIST = b"[9]"
"""Numbers of the grippers that are there."""
_LIST_BYTES = 17
"""Length of the list of grippers, for up to four of them."""


class Requests:
    """What has arrived on one connection, cut into requests."""

    def __init__(self) -> None:
        self._received = b""

    def cut(self, data: bytes) -> list[bytes]:
        """Return the requests that are complete with what has arrived now.

        A request without a line feed is one that has arrived by itself: else its line feed may be under way.
        """
        if not self._received and _BARE_GET.fullmatch(data):
            return [data]
        *lines, rest = (self._received + data).split(b"\n")
        requests = [line + b"\n" for line in lines if line.strip()]
        if len(rest) > LONGEST:
            requests.append(rest[:LONGEST])
            rest = b""
        self._received = rest
        return requests


def changes(request: bytes) -> bool:
    """Return whether a request may change something, so that a journal needs it."""
    return not request.startswith(b"GET ")


def answer(gripper: Gripper, request: bytes) -> bytes:
    """Carry out a request; return the answer.

    Args:
        gripper: The gripper.
        request: One that `Requests` has cut.
    """
    alone = not request.endswith(b"\n")
    match request.decode("ascii", "replace").split():
        case ["GET", "SID"]:
            return _LIST.ljust(_LIST_BYTES) if alone else b"SID " + _LIST + b"\n"
        case ["GET", name] if (value := gripper.read(name)) is not None:
            digits = _DIGITS.get(name, 1)
            return (f"{value:0{digits}d}" if alone else f"{name} {value}\n").encode()
        case ["SET", "SCN_BLOCK", _]:  # looks for grippers no more
            return b"ack"
        case ["SET", "SID", slave]:
            return b"ack" if slave in SLAVES else b""  # nobody answers for a gripper that is not there
        case ["SET", *pairs] if pairs and len(pairs) % 2 == 0:
            return _set(gripper, pairs)
    return UNKNOWN


def _set(gripper: Gripper, pairs: list[str]) -> bytes:
    values: dict[str, int] = {}
    for name, text in zip(pairs[::2], pairs[1::2], strict=True):
        if not (text.isascii() and text.isdigit() and int(text) <= WRITABLE.get(name, -1)):
            return UNKNOWN
        values[name] = int(text)
    gripper.write(values)
    return b"ack"
