"""Describe a robot to a tab: model, state in words, and the checklist for a real arm."""

from typing import Any

from tvist_protocol.faults import FAULTS
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import State
from tvist_view.look import Look, Meshes

NO_TRUTH = "this robot does not publish how it bends; simulated robots do, for pages on the same machine"
REAL = "a real arm does not report how it bends"
USUAL = ("auto", "zv")  # shapers to compare with `none`, for a robot that uses none: the first that it has
MOVES = 0.05  # joint velocity above which a watched robot counts as moving [rad/s]
STOPS = {"protective_stop", "safety_stop"}

Step = tuple[bool, str, str]  # step of a checklist: whether it is done, what to do, and how


def described(info: Info, look: Look, robots: list[str], meshes: Meshes) -> dict[str, Any]:
    """Return everything that a tab needs to know of a robot before it can show it."""
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
    """Return the shaper to compare with `none` if the robot uses no shaper."""
    return next((name for name in USUAL if name in info.shapers), info.shapers[-1])


def pairs(poses: list[str]) -> list[tuple[str, str]]:
    """Return motions between named poses; with three poses, the three motions of the paper."""
    if len(poses) < 2:
        return []
    first, second, *more = poses
    if not more:
        return [(first, second), (second, first)]
    return [(first, more[0]), (first, second), (more[0], first)]


def state_in_words(state: State, info: Info, io: Io | None) -> dict[str, Any]:
    """Return modes, the reason of a stop, and the running program."""
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
    """Return the program that runs or is paused, and its present line; empty if there is none."""
    if io is None or io.program is None or io.program_state == "STOPPED":
        return ""
    label = "" if io.program_label is None else f" “{io.program_label.name}”"
    return f"{io.program} {io.program_state}, line {io.program_line}{label}"


def _word(kind: type[RobotMode] | type[SafetyMode], number: int) -> str:
    """Return the name of a mode; its number if a newer server sent it."""
    try:
        return kind(number).name
    except ValueError:
        return str(number)


class ObservedArm:
    """What a real robot has done since this page first showed it."""

    def __init__(self) -> None:
        self.seen: set[str] = set()  # kinds of events, and what else happened: "program", "moved", "compared"

    def steps(self, info: Info, state: State, io: Io | None) -> list[Step]:
        """Return the checklist of a robot that is watched or moved through its own controller; empty for others."""
        if io is not None and io.program_state == "PLAYING":
            self.seen.add("program")
        if max(map(abs, state.target_qd)) > MOVES:
            self.seen.add("moved")
        runs = state.robot_mode == RobotMode.RUNNING
        well = runs and state.safety_mode in {SafetyMode.NORMAL, SafetyMode.REDUCED}
        if info.watched is not None:
            return self._watched(info, state, well=well)
        return [] if info.moved is None else self._moved(info, well=well)

    def _watched(self, info: Info, state: State, *, well: bool) -> list[Step]:
        there = state.robot_mode != RobotMode.DISCONNECTED
        again = "restart its server with --enable-motion and --calibration; this page then reconnects"
        return [
            (there, f"Connect {info.watched}", "check that it is on and that this machine can reach it"),
            (well, "Release its brakes and stops", "at its teach pendant"),
            (
                "moved" in self.seen,
                "Let it move",
                "with its own programs; the plot below shows the vibration",
            ),
            _identify(info, str(info.watched)),
            (False, "Move it from here", again),
        ]

    def _moved(self, info: Info, *, well: bool) -> list[Step]:
        seen, cap = self.seen, max(info.limits.velocity)
        why = info.stop.why if info.stop is not None else ""
        checked = "model, payload, tool, mounting, remote control, angles and safety are checked"
        by_itself = "stop its program or press its emergency stop, read the reason here, and hold it again"
        return [
            (well, f"Hold {info.moved}: {checked}", why),
            _identify(info, str(info.moved)),
            (
                "motion_done" in seen,
                f"Move it: no joint turns faster than {cap:.2g} rad/s (--speed-cap)",
                "take control, check that its path is clear, and press a motion",
            ),
            ("motion_stopped" in seen, "Stop it in a motion", "press STOP"),
            (bool(seen & STOPS) and well, "Stop it at the robot", by_itself),
            ("compared" in seen, "Compare without and with shaping", "press A/B"),
            (
                "program" in seen,
                "Run your program",
                "serve with --ur, and give it this machine's address instead",
            ),
        ]


def _identify(info: Info, place: str) -> Step:
    """Return the step for the robot's own calibration."""
    own = info.calibration is not None and info.calibration.shipped is False
    return own, "Identify it", f"tvist identify {place}, then serve it with --calibration"
