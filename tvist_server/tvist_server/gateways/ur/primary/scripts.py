"""Cuts what clients send as scripts into units that can be carried out one by one.

A unit is a line, or a block from `def`, `sec` or another word that opens one to its `end`. Lines end with a line
feed, before which a carriage return is no part of them; a last line without one is not complete.
"""

import re
from dataclasses import dataclass
from typing import Final

LONGEST: Final = 1 << 20
"""Bytes of a unit: twenty times the longest program that a known client sends."""
GLIMPSE: Final = 200
"""Characters that are kept of one that is longer."""
TITLE: Final = 60
"""Characters of a title at most."""

_OPENS = re.compile(r"(?:def|sec|thread|if|while|for|switch)\b.*:")
_CLOSES = re.compile(r"\bend$")
_HEAD = re.compile(r"(?:def|sec)\s+(\w+)")
_STRING = re.compile(r"\"[^\"]*\"?|'[^']*'?")


@dataclass(frozen=True)
class Unit:
    """A line or a block, complete."""

    text: str
    """Text as it was sent, with lines ended by line feeds; only the beginning if it is too long."""
    line: int
    """Line at which its code begins, 1 for the first: comments may come before it."""
    column: int
    """Column in that line, 1 for the first."""
    too_long: bool = False
    """Whether it is longer than `LONGEST` bytes: then it is thrown away to its end."""

    @property
    def words(self) -> str:
        """Its code with single spaces, to be compared with a command."""
        return " ".join(word for line in self.text.split("\n") for word in _code(line).split())

    @property
    def name(self) -> str | None:
        """Name of the program that the script defines; None for others."""
        head = _HEAD.match(self._first)
        return None if head is None else head[1]

    @property
    def title(self) -> str:
        """What a person knows it by: the name of the program that it defines, else its first line of code, cut."""
        title = self.name or self._first
        if len(title) > TITLE:
            title = f"{title[: TITLE - 1]}…"
        return "".join([letter if letter.isprintable() else "?" for letter in title])

    @property
    def _first(self) -> str:
        """Its first line of code; of one that is too long, what is kept may end before it."""
        lines = self.text.split("\n")
        return lines[min(self.line, len(lines)) - 1].strip()


class Intake:
    """One client's stream of script text, cut anywhere."""

    def __init__(self) -> None:
        self._rest = bytearray()
        """Beginning of a line that is not yet complete."""
        self._unit = bytearray()
        """Lines of the unit that is not complete: as bytes, since a string a line takes twenty times as much."""
        self._depth = 0
        """Blocks that are open."""
        self._start: tuple[int, int] | None = None
        """Line and column of the unit's first code."""
        self._skipping = False
        """Whether the rest of a unit is thrown away, which was too long."""

    @property
    def held(self) -> int:
        """Bytes that are kept for a unit that is not complete."""
        return len(self._unit) + len(self._rest)

    @property
    def unfinished(self) -> Unit | None:
        """The beginning of the unit that is not complete; None where there is none, or comments alone."""
        if self._skipping:  # it was handed out when it became too long
            return None
        line, column = self._start or (self._unit.count(b"\n") + 1, 1)
        begun = self._start is not None or _code(self._rest.decode(errors="replace"))
        return Unit((self._unit + self._rest).decode(errors="replace"), line, column) if begun else None

    def feed(self, data: bytes) -> list[Unit]:
        """Take a piece; the units that it completes."""
        units: list[Unit] = []
        *lines, rest = data.split(b"\n")
        for piece in lines:
            self._keep(piece, units)
            line = bytes(self._rest).removesuffix(b"\r")
            self._rest.clear()
            self._take(line, units)
        self._keep(rest, units)
        return units

    def _keep(self, piece: bytes, units: list[Unit]) -> None:
        """Add to the line that is not complete."""
        if self.held + len(piece) > LONGEST:
            if not self._skipping:
                seen = (self._unit + self._rest + piece).decode(errors="replace")
                units.append(Unit(seen[:GLIMPSE], *(self._start or (1, 1)), too_long=True))
            self._skipping = True
            self._unit.clear()
            del self._rest[GLIMPSE:]  # the beginning of a line tells what it opens
            piece = piece[:GLIMPSE]
        self._rest += piece

    def _take(self, whole: bytes, units: list[Unit]) -> None:
        """A line is complete."""
        line = whole.decode(errors="replace")
        code = _code(line)
        if not line.strip() and not self._unit and not self._skipping:
            return
        if code and self._start is None:
            self._start = self._unit.count(b"\n") + 1, len(line) - len(line.lstrip()) + 1
        if not self._skipping:
            self._unit += whole + b"\n"
        if code == "end":
            self._depth = max(self._depth - 1, 0)
        elif _OPENS.match(code) and not _CLOSES.search(code):
            self._depth += 1
        if self._depth == 0 and (self._start is not None or self._skipping):
            if not self._skipping:
                line_number, column = self._start or (1, 1)
                units.append(Unit(self._unit.decode(errors="replace"), line_number, column))
            self._unit.clear()
            self._start, self._skipping = None, False


def _code(line: str) -> str:
    """What is left of it without strings' contents, comments, and space around."""
    return _STRING.sub('""', line).partition("#")[0].strip()
