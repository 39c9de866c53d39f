"""The programs of one robot that can be loaded by name."""

from collections.abc import Iterable
from typing import NamedTuple

from tvist_controller.commands.refusal import RefusalError
from tvist_urscript import Script

MAX_KEPT = 100
"""Number of programs that are kept under their names."""


class Kept(NamedTuple):
    """A program, and who sent it."""

    script: Script
    origin: str | None
    """Address of the machine that sent its text; None if it is unknown."""


class KeptPrograms:
    """The built-in programs, and those that clients have sent to be kept.

    Args:
        built_in: Names of the built-in ones, whose text is compiled anew when they are loaded.
    """

    def __init__(self, built_in: Iterable[str]) -> None:
        self._built_in = frozenset(built_in)
        self._kept: dict[str, Kept] = {}

    @property
    def names(self) -> list[str]:
        """Names of all, sorted."""
        return sorted(self._built_in | set(self._kept))

    def keep(self, name: str, kept: Kept) -> None:
        """Keep a program under its name, in place of one that had it before.

        Raises:
            RefusalError: Too many are kept already.
        """
        if name not in self._kept and len(self._kept) >= MAX_KEPT:
            why = f"{MAX_KEPT} programs are kept already: send this one with program.run"
            raise RefusalError("busy", "name", why, MAX_KEPT)
        self._kept[name] = kept

    def find(self, name: str) -> Kept:
        """Return a program that was kept.

        Raises:
            RefusalError: There is none of this name.
        """
        if name not in self._kept:
            why = f"name is {name!r}: must be one of {', '.join(self.names)}"
            raise RefusalError("out_of_range", "name", why)
        return self._kept[name]
