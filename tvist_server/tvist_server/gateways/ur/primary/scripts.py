"""Cuts script text from clients into lines and blocks; a last line without a line feed is incomplete."""

import re
from dataclasses import dataclass
from typing import Final

from tvist_protocol.programs import MAX_SCRIPT
from tvist_server.gateways.ur.base import LineSplitter

LONGEST: Final = MAX_SCRIPT
"""Longest unit with its line feeds [bytes]: twenty times the longest program of a known client."""
GLIMPSE: Final = 200  # bytes kept of a unit that is too long
TITLE: Final = 60  # longest title [characters]

_OPENS = re.compile(r"\b(?:def|sec|thread|if|while|for|switch)\b")
_CLOSES = re.compile(r"\bend\b")
_HEAD = re.compile(r"(def|sec)\s+(\w+)")
_STRING = re.compile(r"\"[^\"]*\"?|'[^']*'?")


@dataclass(frozen=True)
class Unit:
    """A complete line or block."""

    text: str  # text with lines ended by line feeds; only its beginning if it is too long
    line: int  # line at which its code starts, from 1; comments may precede the code
    column: int  # column in that line, counted from 1
    too_long: bool = False  # whether it is longer than `LONGEST` bytes and was therefore dropped

    @property
    def words(self) -> str:
        """Code of the unit with single spaces, for comparison with a command."""
        return " ".join(word for line in self.text.split("\n") for word in _code(line).split())

    @property
    def secondary(self) -> bool:
        """Whether the unit is a secondary program, which runs beside the main program."""
        head = _HEAD.match(self._first)
        return head is not None and head[1] == "sec"

    @property
    def title(self) -> str:
        """Title for messages: the name of the program that the unit defines, or the first line of code."""
        head = _HEAD.match(self._first)
        title = self._first if head is None else head[2]
        if len(title) > TITLE:
            title = f"{title[: TITLE - 1]}…"
        return "".join([letter if letter.isprintable() else "?" for letter in title])

    @property
    def _first(self) -> str:
        """First line of code; of a unit that is too long, the kept text may end before that line."""
        lines = self.text.split("\n")
        return lines[min(self.line, len(lines)) - 1].strip()


class ScriptReader:
    """One client's stream of script text, which may be split anywhere."""

    def __init__(self) -> None:
        self._lines = LineSplitter(LONGEST)
        self._unit = bytearray()
        """Lines of an incomplete unit, as bytes: one string per line would take twenty times the memory."""
        self._depth = 0
        self._start: tuple[int, int] | None = None  # line and column of the unit's first code
        self._skipping = False  # whether the rest of a unit that is too long is being skipped

    @property
    def held(self) -> int:
        """Number of bytes kept for an incomplete unit."""
        return len(self._unit) + len(self._lines.rest)

    @property
    def unfinished(self) -> Unit | None:
        """Beginning of the incomplete unit; None if it has no code yet."""
        if self._skipping:  # the unit was returned when it became too long
            return None
        line, column = self._start or (self._unit.count(b"\n") + 1, 1)
        rest = self._lines.rest
        begun = self._start is not None or _code(rest.decode(errors="replace"))
        return Unit((self._unit + rest).decode(errors="replace"), line, column) if begun else None

    def feed(self, data: bytes) -> list[Unit]:
        """Take a piece of the stream; return the units that are now complete or have become too long."""
        return [unit for line in self._lines.feed(data) if (unit := self._take(line.removesuffix(b"\r")))]

    def _take(self, whole: bytes) -> Unit | None:
        """Add a complete line to the present unit; return the unit if this line closes all its blocks."""
        unit = None
        if not self._skipping and len(self._unit) + len(whole) >= LONGEST:
            seen = bytes(self._unit + whole)[:GLIMPSE].decode(errors="replace")
            unit = Unit(seen, *(self._start or (1, 1)), too_long=True)
            self._skipping = True
            self._unit.clear()
            whole = whole[:GLIMPSE]  # the beginning of a line determines which blocks it opens
        line = whole.decode(errors="replace")
        code = _code(line)
        if not line.strip() and not self._unit and not self._skipping:
            return None
        if code and self._start is None:
            self._start = self._unit.count(b"\n") + 1, len(line) - len(line.lstrip()) + 1
        if not self._skipping:
            self._unit += whole + b"\n"
        self._depth = max(self._depth + len(_OPENS.findall(code)) - len(_CLOSES.findall(code)), 0)
        if self._depth == 0 and (self._start is not None or self._skipping):
            if not self._skipping:
                unit = Unit(self._unit.decode(errors="replace"), *(self._start or (1, 1)))
            self._unit.clear()
            self._start, self._skipping = None, False
        return unit


def _code(line: str) -> str:
    """Return a line without comments, contents of strings and surrounding space; empty for a label."""
    if line.lstrip().startswith("$"):  # a label's name may contain quotes and words that open blocks
        return ""
    return _STRING.sub('""', line).partition("#")[0].strip()
