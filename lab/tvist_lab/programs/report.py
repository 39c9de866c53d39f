"""Account of a run, for people and for programs."""

from typing import Any

from tvist_lab.programs.watch import Move, ProgramWatch, Said
from tvist_plant.plant import PERIOD


def largest_peak(watch: ProgramWatch) -> float | None:
    """Largest acceleration of the tool after a stop [m/s²]; None if it was never at rest for long enough."""
    return max((move.peak for move in watch.moves if move.peak is not None), default=None)


def summary(watch: ProgramWatch) -> str:
    """Say in a sentence how long a program ran, how often it moved, and how much the tool shook."""
    said = f"{watch.name} ran for {watch.seconds:.3f} s of robot time"
    if watch.moves:
        said += f" and made {len(watch.moves)} {'move' if len(watch.moves) == 1 else 'moves'}"
    peak = largest_peak(watch)
    return said if peak is None else f"{said}; after a stop the tool shook with at most {peak:.3g} m/s²"


def as_dict(watch: ProgramWatch) -> dict[str, Any]:
    """Return everything that is known of a run, as plain values."""
    error = watch.error
    return {
        "program": watch.name,
        "ok": watch.reason == "finished",
        "exit_reason": watch.reason,
        "why": watch.why,
        "error": None if error is None else {"line": error.line, "column": error.column, "text": error.text},
        "seconds": round(watch.seconds, 6),
        "messages": [_message(said) for said in watch.said if said.kind != "warning"],
        "warnings": [
            {"timestamp": _time(said.tick), "text": said.text}
            for said in watch.said
            if said.kind == "warning"
        ],
        "moves": [_move(move) for move in watch.moves],
        "largest_peak_after_stop_m_s2": largest_peak(watch),
    }


def _message(said: Said) -> dict[str, Any]:
    message: dict[str, Any] = {"timestamp": _time(said.tick), "kind": said.kind, "text": said.text}
    return message | ({"title": said.title, "level": said.level} if said.kind == "popup" else {})


def _move(move: Move) -> dict[str, Any]:
    return {
        "id": move.id,
        "timestamp": _time(move.started),
        "seconds": None if move.ended is None else _seconds(move.ended - move.started),
        "stopped": move.stopped,
        "peak_after_stop_m_s2": move.peak,
    }


def _time(tick: int) -> float:
    """Time of a tick, as `timestamp` in `state` gives it [s]."""
    return _seconds(tick)


def _seconds(ticks: int) -> float:
    return round(ticks * PERIOD, 6)  # 0.002 is no binary number
