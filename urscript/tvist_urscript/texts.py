"""Built-in functions of strings; positions count UTF-8 bytes from 0."""

import re

from tvist_urscript.costs import costs
from tvist_urscript.errors import Fault
from tvist_urscript.values import Value, exactly, integer, short, to_bytes, to_str, to_text, whole

_TEXT = str  # parameters of URScript have the name str, too
_INTEGER = re.compile(r"\s*[+-]?\d+\s*", re.ASCII)
_HEXADECIMAL = re.compile(r"\s*[+-]?0[xX][0-9a-fA-F]+\s*", re.ASCII)
DECIMAL = re.compile(r"\s*[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?\s*", re.ASCII)


@costs(20)
def str_cat(op1: Value, op2: Value) -> str:
    """Return two values as one string."""
    whole_text = to_str(op1) + to_str(op2)
    return short(whole_text if whole_text.isascii() else to_text(to_bytes(whole_text)))


def str_len(str: Value) -> int:
    """Return the number of bytes."""
    return len(to_bytes(exactly(_TEXT, str, "the argument of str_len")))


def str_empty(str: Value) -> bool:
    """Return whether a string has no bytes."""
    return not exactly(_TEXT, str, "the argument of str_empty")


def str_at(src: Value, index: Value) -> str:
    """Return the byte at a position."""
    string, place = to_bytes(exactly(_TEXT, src, "src of str_at")), integer(index, "the index of str_at")
    _check_place(place, string)
    return to_text(string[place : place + 1])


def str_find(src: Value, target: Value, start_from: Value = 0) -> int:
    """Return the position of a string in another one; -1 if it does not occur."""
    string, wanted = (
        to_bytes(exactly(_TEXT, src, "src of str_find")),
        to_bytes(exactly(_TEXT, target, "target of str_find")),
    )
    start = integer(start_from, "start_from of str_find")
    _check_place(start, string, 1)
    return string.find(wanted, start)


def str_sub(src: Value, index: Value, len: Value = -1) -> str:
    """Return a part of a string; all of the rest if the length is negative or too large."""
    string, start = to_bytes(exactly(_TEXT, src, "src of str_sub")), integer(index, "the index of str_sub")
    size = integer(len, "len of str_sub")
    _check_place(start, string, 1)
    return to_text(string[start:] if size < 0 else string[start : start + size])


def to_num(str: Value) -> int | float:
    """Return the number in a string, in decimal digits or, after 0x, in hexadecimal ones."""
    if type(str) is int or type(str) is float:
        return str
    written = exactly(_TEXT, str, "the argument of to_num")
    if _HEXADECIMAL.fullmatch(written):
        return whole(int(written, 16))
    if _INTEGER.fullmatch(written):
        return whole(int(written))
    if DECIMAL.fullmatch(written):
        return float(written)
    raise Fault(f'the text "{written[:40]}" is no number')


def _check_place(place: int, string: bytes, beyond: int = 0) -> None:
    """Raise Fault unless a position is in a string, or at most `beyond` bytes after its last one."""
    if not 0 <= place < len(string) + beyond:
        raise Fault(f"text index {place} is not in the text, which has {len(string)} bytes")


def check(condition: Value) -> None:
    """Raise Fault if a condition is false; this is `assert` in a script."""
    if not condition:
        raise Fault("an assertion has failed")
