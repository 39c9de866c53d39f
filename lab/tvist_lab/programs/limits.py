"""Limits that a run must keep, and what broke them."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from tvist_lab.programs.account import seconds
from tvist_lab.programs.watch import Fastest, Move, ProgramWatch


@dataclass(frozen=True)
class Shortcoming:
    """Something for which a run counts as failed."""

    kind: str
    """How the run ended, the limit that it broke such as `max_shake`, `baseline` for a change, or `recording`."""
    text: str
    """A sentence."""
    line: int | None = None
    """Line of the program that it belongs to; None if it belongs to none."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return {"kind": self.kind, "line": self.line, "text": self.text}


@dataclass(frozen=True)
class Limits:
    """The limits; None where there is none."""

    shake: float | None = None
    """Largest acceleration of the tool after a stop [m/s²]."""
    seconds: float | None = None
    """Longest robot time from the start of the program to its end [s]."""
    joint_speed: float | None = None
    """Largest measured speed of a joint [rad/s]."""
    tool_speed: float | None = None
    """Largest measured speed of the tool centre point [m/s]."""
    force: float | None = None
    """Largest force with which the arm's world touches it [N]."""

    def broken(self, watch: ProgramWatch) -> Iterator[Shortcoming]:
        """Say of each limit that a run broke where and when, and of the shake after each stop that broke it."""
        if self.seconds is not None and watch.seconds > self.seconds:
            yield Shortcoming(
                "max_seconds", _more(f"it ran for {watch.seconds:.3f} s", self.seconds, "seconds")
            )
        if self.shake is not None:
            for number, move in enumerate(watch.moves, 1):
                yield from _shaken(number, move, self.shake)
        joint, tool = watch.fastest_joint, watch.fastest_tool
        yield from _fast(joint, f"joint {joint.joint} turned with", "rad/s", self.joint_speed, "joint_speed")
        yield from _fast(tool, "the tool moved with", "m/s", self.tool_speed, "tool_speed")
        yield from _fast(watch.hardest, "the arm was touched with", "N", self.force, "force")


def _shaken(number: int, move: Move, most: float) -> Iterator[Shortcoming]:
    if move.ended is None:
        return
    line = move.line or None
    stop = f"after move {number}, which stopped at {seconds(move.rests or move.ended):.3f} s"
    if move.peak is not None and move.peak > most:
        what = f"{stop}, the tool shook with {move.peak:.3g} m/s²"
        yield Shortcoming("max_shake", _more(what, most, "shake"), line)
    elif move.peak is None and (move.rests is not None or move.stopped is None):
        why = f"{stop}, it is not known how much the tool shook: this arm does not tell (--max-shake)"
        yield Shortcoming("max_shake", why, line)


def _fast(fastest: Fastest, what: str, unit: str, most: float | None, name: str) -> Iterator[Shortcoming]:
    if most is not None and fastest.speed > most:
        what = f"{what} {fastest.speed:.3g} {unit} at {seconds(fastest.tick):.3f} s"
        yield Shortcoming(f"max_{name}", _more(what, most, name.replace("_", "-")), fastest.line or None)


def _more(what: str, most: float, name: str) -> str:
    return f"{what}, more than {most:g} (--max-{name})"
