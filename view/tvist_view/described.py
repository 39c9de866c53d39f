"""What a tab is told of a robot: how it is described, and its state in words."""

from typing import Any

from tvist_protocol.faults import FAULTS
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import State
from tvist_view.look import Look
from tvist_view.meshes import Meshes

NO_TRUTH = "this robot does not tell how it bends; a simulated one tells pages on its own machine"
REAL = "a real arm does not tell how it bends"
USUAL = ("auto", "zv")
"""Shapers of which the first that the robot has is compared with none, while none is in use."""


def described(info: Info, look: Look, robots: list[str], meshes: Meshes) -> dict[str, Any]:
    """What a tab needs to know of a robot before it can show it."""
    real = info.watched is not None or info.moved is not None
    faults = FAULTS if "simulation.inject" in info.commands and not real else {}
    return {
        "name": info.name,
        "robots": sorted({*robots, info.name}),
        "look": {**look.packed(), "meshes": meshes.offer(look.geometry)},
        "why_stiff": REAL if real else NO_TRUTH,
        "poses": info.poses,
        "motions": pairs(list(info.poses)),
        "joints": info.joints,
        "shapers": list(dict.fromkeys((*info.shapers, info.shaper))),
        "usual": usual(info),
        "modes": info.modes,
        "most_modes": max(len(info.joints), info.modes, 2),
        "mass": round(info.payload.mass, 1),
        "rated": max(info.limits.payload, 0.1),
        "faults": {name: fault.meaning for name, fault in faults.items() if "joint" not in fault.needs},
    }


def usual(info: Info) -> str:
    """The shaper that is compared with none while none is in use."""
    return next((name for name in USUAL if name in info.shapers), info.shapers[-1])


def pairs(poses: list[str]) -> list[tuple[str, str]]:
    """Motions between named poses: the paper's three for three of them."""
    if len(poses) < 2:
        return []
    first, second, *more = poses
    if not more:
        return [(first, second), (second, first)]
    return [(first, more[0]), (first, second), (more[0], first)]


def state_in_words(state: State, info: Info, io: Io | None) -> dict[str, Any]:
    """Modes, the reason of a stop, and the program that runs."""
    mode, safety = _word(RobotMode, state.robot_mode), _word(SafetyMode, state.safety_mode)
    return {
        "robot_mode": mode,
        "safety_mode": safety,
        "well": mode == "RUNNING" and safety == "NORMAL",
        "why": info.stop.why if info.stop is not None and safety != "NORMAL" else "",
        "shaper": info.shaper,
        "program": _program(io),
    }


def _program(io: Io | None) -> str:
    """The program that runs or is paused, and where it is; empty if there is none."""
    if io is None or io.program is None or io.program_state == "STOPPED":
        return ""
    label = "" if io.program_label is None else f" “{io.program_label.name}”"
    return f"{io.program} {io.program_state}, line {io.program_line}{label}"


def _word(kind: type[RobotMode] | type[SafetyMode], number: int) -> str:
    try:
        return kind(number).name
    except ValueError:
        return str(number)
