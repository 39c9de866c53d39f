"""Cuts a client's data into lines."""

from typing import Final

LONGEST: Final = 4096
"""Longest line [bytes]."""


class Lines:
    """One client's stream, which may be split anywhere. A carriage return before the line feed is dropped."""

    def __init__(self) -> None:
        self._rest = bytearray()

    def feed(self, data: bytes) -> list[str]:
        """Take a piece and return the lines that it completes; a line that is too long is cut off."""
        lines: list[str] = []
        *whole, rest = data.split(b"\n")
        for piece in whole:
            self._keep(piece)
            lines.append(self._rest.decode(errors="replace").strip())
            self._rest.clear()
        self._keep(rest)
        return lines

    def _keep(self, piece: bytes) -> None:
        self._rest += piece[: LONGEST - len(self._rest)]
