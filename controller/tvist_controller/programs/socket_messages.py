"""What programs read from sockets: how each message is cut from the received bytes.

Each function takes what has been received so far and returns the message with its length in bytes, or None as long as
it is incomplete. A message that is not valid is None with the length of what is thrown away.
"""

import re
from struct import unpack_from

from tvist_urscript.texts import DECIMAL

_VARIABLE = re.compile(r"\s*(\S+)\s+([+-]?\d+)\s*", re.ASCII)
LONGEST_NUMBER = 64
"""Longest number in characters [bytes]."""
LONGEST_LINE = 1023
"""Longest line or string [bytes], as that of a text in a program."""


def integers(received: bytes, number: int) -> tuple[tuple[int, ...], int] | None:
    """Cut this many integers of 32 bits in network byte order."""
    if len(received) < 4 * number:
        return None
    return unpack_from(f">{number}i", received), 4 * number


def octets(received: bytes, number: int) -> tuple[tuple[int, ...], int] | None:
    """Cut this many bytes, each as a number."""
    return None if len(received) < number else (tuple(received[:number]), number)


def line(received: bytes) -> tuple[bytes, int] | None:
    """Cut a line; its end is LF or CR LF, which is not part of it. A longer one is cut at `LONGEST_LINE`."""
    end = received.find(b"\n", 0, LONGEST_LINE + 1)
    if end >= 0:
        return received[:end].removesuffix(b"\r"), end + 1
    return (received[:LONGEST_LINE], LONGEST_LINE) if len(received) > LONGEST_LINE else None


def between(received: bytes, prefix: bytes, suffix: bytes) -> tuple[bytes, int] | None:
    """Cut what is between a prefix and a suffix, and drop what precedes the prefix.

    Without a suffix it is everything that has been received, at most `LONGEST_LINE`.
    """
    start = received.find(prefix)
    if start < 0:
        return None
    start += len(prefix)
    end = received.find(suffix, start) if suffix else min(len(received), start + LONGEST_LINE)
    if end < 0 or (not suffix and end == start):
        return None
    return received[start:end], end + len(suffix)


def floats(received: bytes, number: int) -> tuple[tuple[float, ...] | None, int] | None:
    """Cut numbers in brackets, separated by commas: `( 1.414 , 3.14159, 1.616, 0.0 )`, with the line's end behind."""
    end = received.find(b")")
    if end < 0:
        return None
    rest = next((len(mark) for mark in (b"\n", b"\r\n") if received.startswith(mark, end + 1)), 0)
    start = received.rfind(b"(", 0, end)
    parts = received[start + 1 : end].decode("ascii", "replace").split(",")
    short = all(len(part) <= LONGEST_NUMBER for part in parts)  # the pattern takes long for long ones
    valid = start >= 0 and len(parts) == number and short and all(map(DECIMAL.fullmatch, parts))
    return tuple(map(float, parts)) if valid else None, end + 1 + rest


def variable(received: bytes, name: str) -> tuple[int | None, int] | None:
    """Cut the answer to a request for a variable: a line with its name and an integer; blank lines before are dropped.

    One may be left of a message whose line feed came later than the rest of it.
    """
    begin = len(received) - len(received.lstrip(b"\r\n"))
    found = line(received[begin:])
    if found is None:
        return None
    answer = _VARIABLE.fullmatch(found[0].decode("ascii", "replace"))
    if answer is None or answer[1] != name or len(answer[2]) > LONGEST_NUMBER:
        return None, begin + found[1]
    value = int(answer[2])
    return value if -(2**31) <= value < 2**31 else None, begin + found[1]


def unescaped(text: str) -> str:
    r"""Return a text with `\n`, `\r`, `\t`, `\\` and `\"` as the characters that they stand for."""
    known = {"n": "\n", "r": "\r", "t": "\t", "\\": "\\", '"': '"'}
    return re.sub(r"\\(.)", lambda match: known.get(match[1], match[0]), text)
