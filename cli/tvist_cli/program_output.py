"""Output of a program that is running: its messages, and a line with its progress."""

import sys
import time
from typing import TYPE_CHECKING

from tvist_cli.output import err, say
from tvist_protocol.errors import harmless

if TYPE_CHECKING:
    from tvist_lab.programs.watch import ProgramWatch, Said

SHOWN_EVERY = 0.1
"""Time between two changes of the progress line [s]."""
_CLEAR = "\r\x1b[K"
"""Returns to the beginning of the terminal's line and clears it."""


class Tell:
    """Prints what a program says as it comes, and on a terminal a line with its progress.

    Args:
        quiet: Whether to print no messages, since they are part of the one JSON object.
    """

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self._shown, self._visible = 0.0, False

    def __call__(self, watch: "ProgramWatch") -> None:
        """Print what is new."""
        while watch.news:
            said = watch.news.popleft()
            if not self._quiet:
                self.clear()
                _print(said)
        now = time.monotonic()
        if err.is_terminal and now - self._shown >= SHOWN_EVERY:
            self._shown, self._visible = now, True
            place = f", line {watch.line}" if watch.line else ""
            move = f", move {len(watch.moves)}" if watch.moves else ""
            progress = f"{watch.name}: {watch.seconds:.1f} s{place}{move}"
            sys.stderr.write(_CLEAR + harmless(progress)[: max(err.width - 1, 1)])
            sys.stderr.flush()

    def clear(self) -> None:
        """Remove the progress line."""
        if self._visible:
            sys.stderr.write(_CLEAR)
            sys.stderr.flush()
            self._visible = False


def _print(said: "Said") -> None:
    """Print a message on stdout, a warning on stderr."""
    match said.kind:
        case "text":
            print(harmless(said.text), flush=True)
        case "popup":
            level = "" if said.level in {None, "message"} else f" ({said.level})"
            print(harmless(f"popup{level}: {said.title}: {said.text}"), flush=True)
        case "warning":
            say(f"warning: {said.text}")
