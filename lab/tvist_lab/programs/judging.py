"""Judge runs by limits, by expected positions of bodies, and by an earlier run in lockstep."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pinocchio as pin

from tvist_lab.programs.limits import EXPECTED, UNITS, RunLimits
from tvist_lab.programs.results import Shortcoming, seconds
from tvist_lab.programs.watch import Fastest, ProgramWatch
from tvist_plant.model import Floats
from tvist_plant.plant import PERIOD, Plant
from tvist_plant.surroundings import Shape
from tvist_plant.user_file import UserFileError, read_text


def broken(limits: RunLimits, watch: ProgramWatch) -> Iterator[Shortcoming]:
    """Yield place and time at which a run exceeded each limit, and each stop with too much vibration."""
    if limits.max_seconds is not None and watch.seconds > limits.max_seconds:
        yield _more(limits, "max_seconds", f"it ran for {watch.seconds:.3f} s", None)
    if limits.max_shake is not None:
        yield from _shaken(limits, watch, limits.max_shake)
    joint, tool, hardest = watch.fastest_joint, watch.fastest_tool, watch.hardest
    yield from _fast(limits, "max_joint_speed", joint, f"joint {joint.joint} turned with")
    yield from _fast(limits, "max_tool_speed", tool, "the tool moved with")
    yield from _fast(limits, "max_force", hardest, "the arm was touched with")


def missed(limits: RunLimits, plant: Plant) -> list[Shortcoming]:
    """Return the bodies that are not in the areas where they are expected."""
    said = (_missed(text, plant) for text in limits.expect or ())
    return [Shortcoming("expect", f"{text} (--expect)") for text in said if text is not None]


def _shaken(limits: RunLimits, watch: ProgramWatch, most: float) -> Iterator[Shortcoming]:
    for number, move in enumerate(watch.moves, 1):
        if move.ended is None:
            continue
        line = move.line or None
        stop = f"after move {number}, which stopped at {seconds(move.rests or move.ended):.3f} s"
        if move.peak is not None and move.peak > most:
            yield _more(limits, "max_shake", f"{stop}, the tool shook with {move.peak:.3g} m/s²", line)
        elif move.peak is None and (move.rests is not None or move.stopped is None):
            why = f"{stop}, it is not known how much the tool shook: this arm does not tell (--max-shake)"
            yield Shortcoming("max_shake", why, line)


def _fast(limits: RunLimits, name: str, fastest: Fastest, what: str) -> Iterator[Shortcoming]:
    most = getattr(limits, name)
    if most is not None and fastest.speed > most:
        text = f"{what} {fastest.speed:.3g} {UNITS[name]} at {seconds(fastest.tick):.3f} s"
        yield _more(limits, name, text, fastest.line or None)


def _more(limits: RunLimits, name: str, what: str, line: int | None) -> Shortcoming:
    text = f"{what}, more than {getattr(limits, name):g} (--{name.replace('_', '-')})"
    return Shortcoming(name, text, line)


def _missed(text: str, plant: Plant) -> str | None:
    """Return why a body is not in an area; None if it is."""
    expected = EXPECTED.fullmatch(text)
    assert expected is not None
    body, name = expected["body"].strip(), expected["area"].strip()
    things, places = plant.things(), plant.places()
    if things is None:
        return f"{body} cannot be in {name}: the arm stands in no world (--world)"
    for kind, one, known in (("body", body, things.bodies), ("area", name, tuple(things.areas))):
        if one not in known:
            return f"the world {things.name} has no {kind} {one!r}: it has {', '.join(known) or 'none'}"
    at, area = places[things.bodies.index(body), :3], things.areas[name]
    if is_inside(area, _frame(area, places).actInv(at)):
        return None
    return f"{body} is at ({', '.join(f'{value:.3f}' for value in at)}) m, which is not in {name}"


def _frame(area: Shape, places: Floats) -> pin.SE3:
    own = _se3(area.pose)
    return own if area.body is None else _se3(places[area.body]) * own


def _se3(pose: Sequence[float] | Floats) -> pin.SE3:
    return pin.SE3(pin.exp3(np.array(pose[3:])), np.array(pose[:3]))


def is_inside(area: Shape, at: Floats) -> bool:
    """Whether an area contains a point, given in its frame."""
    size = np.array(area.size)
    match area.kind:
        case "box":
            return bool((np.abs(at) <= size).all())
        case "sphere":
            return bool(np.linalg.norm(at) <= size[0])
        case "ellipsoid":
            return bool(np.linalg.norm(at / size) <= 1.0)
        case "cylinder":
            return bool(np.hypot(*at[:2]) <= size[0] and abs(at[2]) <= size[1])
    nearest = np.array([0.0, 0.0, np.clip(at[2], -size[1], size[1])])  # a capsule
    return bool(np.linalg.norm(at - nearest) <= size[0])


# ---------------------------------------------------------------------- an earlier run

Run = Mapping[str, Any]  # output of --json for a program
ROUNDING = {"_s": 0.5 * PERIOD, "seconds": 0.5 * PERIOD}
"""Differences of times that are ignored, by the end of the key [s]."""
SHARES = {"_m_s2": 1e-3, "_rad_s": 1e-4, "_m_s": 1e-4}
"""Relative differences of accelerations and speeds that are ignored, since another processor rounds differently."""
OF_MOVES = ("seconds", "stopped", "rested_s", "peak_after_stop_m_s2")


class BaselineError(ValueError):
    """A file is no baseline of these programs; the message tells why."""


def read_baseline(path: Path, files: Sequence[str]) -> Mapping[str, Run]:
    """Read the `tvist run --lockstep --json` output of exactly these programs, by program name.

    Raises BaselineError if the content is something else, OSError if the file cannot be read.
    """
    try:
        content = msgspec.json.decode(read_text(path, "baseline"))
        runs = {run["file"]: run for run in content.get("programs", [content])}
        in_real_time = [file for file, run in runs.items() if not run.get("lockstep", True)]
        for run in runs.values():
            for name, value in _points(run).items():  # check that figures can be compared
                _differ(name, value, value)
            _warned(run)
    except (
        msgspec.DecodeError, UserFileError, AttributeError, KeyError, TypeError, OverflowError, RecursionError,
    ) as error:  # fmt: skip
        raise BaselineError(f"baseline {path} is not what tvist run --lockstep --json prints") from error
    if in_real_time:
        raise BaselineError(f"baseline {path} is of a run in real time: record it with --lockstep")
    if set(runs) != set(files):
        was = ", ".join(map(str, runs)) or "nothing"
        raise BaselineError(
            f"baseline {path} is of {was}, this run is of {', '.join(files)}: run the same programs"
        )
    return runs


def changes(before: Run, now: Run) -> Iterator[Shortcoming]:
    """Yield the differences beyond rounding from a program's run in the baseline."""
    old, new = _points(before), _points(now)
    lines = {f"move {number}": move["line"] for number, move in enumerate(now.get("moves", ()), 1)}
    for name in old:
        if name in new and _differ(name, old[name], new[name]):
            text = f"{name} is {_shown(new[name])}, before {_shown(old[name])}"
            yield Shortcoming("baseline", text, lines.get(name.partition(":")[0]))
    if "compile_error" in {before["exit_reason"], now["exit_reason"]}:
        return
    was, warned = _warned(before), _warned(now)
    for what, texts in (("new warning", warned - was), ("no longer warned", was - warned)):
        for text in texts.elements():
            yield Shortcoming("baseline", f"{what}: {text}")


def _points(run: Run) -> dict[str, Any]:
    """Return the figures of a run that are compared; if the program did not compile, only the error."""
    points: dict[str, Any] = {"exit_reason": run["exit_reason"]}
    if run["exit_reason"] == "compile_error":
        return points
    points |= {
        "seconds": run["seconds"],
        "the number of moves": len(run["moves"]),
        "largest joint speed_rad_s": run["largest_joint_speed"]["speed_rad_s"],
        "largest tool speed_m_s": run["largest_tool_speed"]["speed_m_s"],
    }
    for number, move in enumerate(run["moves"], 1):
        points |= {f"move {number}: {key}": move[key] for key in OF_MOVES}
    return points


def _warned(run: Run) -> Counter[str]:
    return Counter(one["text"] for one in run.get("warnings", ()))


def _differ(name: str, before: Any, now: Any) -> bool:
    if before is None or now is None or isinstance(before, str) or isinstance(now, str):
        return bool(before != now)
    before, now = float(before), float(now)
    share = next((share for end, share in SHARES.items() if name.endswith(end)), None)
    if share is not None:
        return bool(abs(now - before) > share * (1.0 + abs(before)))
    return bool(abs(now - before) > next((most for end, most in ROUNDING.items() if name.endswith(end)), 0.0))


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "nothing" if value is None else f"{value}"
