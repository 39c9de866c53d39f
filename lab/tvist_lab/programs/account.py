"""What is known of a run when it is over: a sentence for people, plain values for programs."""

from typing import Any

from tvist_lab.programs.watch import Fastest, Move, ProgramWatch, Said
from tvist_lab.words import counted
from tvist_plant.plant import PERIOD


def largest_peak(watch: ProgramWatch) -> float | None:
    """Largest acceleration of the tool after a stop [m/s²]; None if it never stopped, or the arm cannot tell."""
    return max((move.peak for move in watch.moves if move.peak is not None), default=None)


def summary(watch: ProgramWatch) -> str:
    """Say in a sentence how long a program ran, how often it moved, and how much the tool shook."""
    said = f"{watch.name} ran for {watch.seconds:.3f} s of robot time"
    if watch.moves:
        said += f" and made {counted(len(watch.moves), 'move')}"
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
            {"timestamp": seconds(said.tick), "line": said.line or None, "text": said.text}
            for said in watch.said
            if said.kind == "warning"
        ],
        "moves": [_move(move) for move in watch.moves],
        "largest_peak_after_stop_m_s2": largest_peak(watch),
        "largest_joint_speed": {"joint": watch.fastest_joint.joint, **_fastest(watch.fastest_joint, "rad_s")},
        "largest_tool_speed": _fastest(watch.fastest_tool, "m_s"),
        **_in_world(watch),
    }


def _in_world(watch: ProgramWatch) -> dict[str, Any]:
    """The largest force of contact, and where the bodies of the arm's world are; nothing without one."""
    things = watch.plant.things()
    if things is None:
        return {}
    hardest = watch.hardest
    force = {
        "force_n": hardest.speed, "timestamp": seconds(hardest.tick), "line": hardest.line or None,
    }  # fmt: skip
    poses = zip(things.bodies, watch.plant.places().tolist(), strict=True)
    return {"largest_contact_force": force, "bodies": dict(poses)}


def seconds(ticks: int) -> float:
    """Time of a tick, as `timestamp` in `state` gives it, or of a number of ticks [s]."""
    return round(ticks * PERIOD, 6)  # 0.002 is no binary number


def _message(said: Said) -> dict[str, Any]:
    message: dict[str, Any] = {"timestamp": seconds(said.tick), "kind": said.kind, "text": said.text}
    return message | ({"title": said.title, "level": said.level} if said.kind == "popup" else {})


def _move(move: Move) -> dict[str, Any]:
    ended, rests, followed = move.ended, move.rests, move.followed
    return {
        "id": move.id,
        "line": move.line or None,
        "timestamp": seconds(move.started),
        "seconds": None if ended is None else seconds(ended - move.started),
        "stopped": move.stopped,
        "rested_s": None if followed is None else seconds(followed - (followed if rests is None else rests)),
        "peak_after_stop_m_s2": move.peak,
    }


def _fastest(fastest: Fastest, unit: str) -> dict[str, Any]:
    return {
        f"speed_{unit}": fastest.speed,
        "timestamp": seconds(fastest.tick),
        "line": fastest.line or None,
    }
