"""Cuts what a client sends into lines."""

from typing import Final

LONGEST: Final = 4096
"""Bytes of a line."""


class Lines:
    """One client's stream, cut anywhere. A carriage return before the line feed is no part of the line."""

    def __init__(self) -> None:
        self._rest = bytearray()

    def feed(self, data: bytes) -> list[str]:
        """Take a piece; the lines that it completes. Of one that is too long the end is thrown away."""
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
