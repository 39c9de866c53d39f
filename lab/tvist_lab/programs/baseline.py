"""What has changed since an earlier run of the same programs in lockstep, which `tvist run --json` printed."""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct, field

from tvist_lab.programs.limits import Shortcoming
from tvist_plant.plant import PERIOD
from tvist_plant.user_file import UserFileError, read_text

TIMES = 0.5 * PERIOD
"""Difference of two times that rounding may cause [s]."""
SPEEDS, SHAKES = 1e-4, 1e-3
"""The same of two speeds and of two accelerations, as a share of one more than the former, in SI units: what another
processor may make of the same run."""


class BaselineError(ValueError):
    """A file is no baseline of these programs; the message says why."""


class _Move(Struct):
    seconds: float | None
    stopped: str | None
    rested_s: float | None
    peak_after_stop_m_s2: float | None
    line: int | None = None


class _Joint(Struct):
    speed_rad_s: float


class _Tool(Struct):
    speed_m_s: float


class _Warning(Struct):
    text: str


class Run(Struct):
    """A run, as far as it is compared; one that did not compile has no numbers."""

    file: str
    exit_reason: str
    lockstep: bool = True
    seconds: float | None = None
    moves: list[_Move] = field(default_factory=list)
    warnings: list[_Warning] = field(default_factory=list)
    largest_joint_speed: _Joint | None = None
    largest_tool_speed: _Tool | None = None


class _Runs(Struct):
    programs: list[Run]


def read_baseline(path: Path, files: list[str]) -> Mapping[str, Run]:
    """Read the runs of a baseline, by the names of their programs.

    Args:
        path: File with what `tvist run --lockstep --json` printed.
        files: Names of the programs that are to be compared, each of which it must have, and no others.

    Raises:
        BaselineError: It has something else, or other programs.
        OSError: It cannot be read.
    """
    try:
        content = msgspec.json.decode(read_text(path, "baseline"))
        several = isinstance(content, dict) and "programs" in content
        runs = msgspec.convert(content, _Runs).programs if several else [msgspec.convert(content, Run)]
    except (msgspec.DecodeError, msgspec.ValidationError, UserFileError) as error:
        raise BaselineError(f"baseline {path} is not what tvist run --lockstep --json prints") from error
    for run in runs:
        if not run.lockstep:
            raise BaselineError(f"baseline {path} is of a run in real time: make it with --lockstep")
        if run.seconds is None and run.exit_reason != "compile_error":
            raise BaselineError(f"baseline {path} lacks seconds of {run.file}")
    if Counter(run.file for run in runs) != Counter(files):
        was = ", ".join(run.file for run in runs) or "nothing"
        raise BaselineError(
            f"baseline {path} is of {was}, and this run is of {', '.join(files)}: give the same"
        )
    return {run.file: run for run in runs}


def changes(before: Run, result: Mapping[str, Any]) -> Iterator[Shortcoming]:
    """Say what is different from the baseline beyond rounding.

    Args:
        before: The program's run in the baseline.
        result: What --json prints of the run.
    """
    now = msgspec.convert(result, Run)
    for text, line in _differences(before, now):
        yield Shortcoming("baseline", text, line)


def _differences(before: Run, now: Run) -> Iterator[tuple[str, int | None]]:
    if before.exit_reason != now.exit_reason:
        yield f"it ended with {now.exit_reason}, before with {before.exit_reason}", None
    if before.seconds is None or now.seconds is None:
        return
    if _differ(before.seconds, now.seconds, TIMES):
        yield f"it ran for {now.seconds:.3f} s, before for {before.seconds:.3f} s", None
    if len(before.moves) != len(now.moves):
        yield f"it made {len(now.moves)} moves, before {len(before.moves)}", None
    for number, (old, new) in enumerate(zip(before.moves, now.moves, strict=False), 1):
        for text in _changed(old, new):
            yield f"move {number} {text}", new.line
    yield from _changed_speeds(before, now)
    was, is_now = (Counter(one.text for one in run.warnings) for run in (before, now))
    for text in (is_now - was).elements():
        yield f"new warning: {text}", None
    for text in (was - is_now).elements():
        yield f"no longer warned: {text}", None


def _changed_speeds(before: Run, now: Run) -> Iterator[tuple[str, int | None]]:
    for name, unit, old, new in (
        ("a joint", "rad/s", _speed(before.largest_joint_speed), _speed(now.largest_joint_speed)),
        ("the tool", "m/s", _speed(before.largest_tool_speed), _speed(now.largest_tool_speed)),
    ):
        if _differ(old, new, SPEEDS, relative=True):
            yield f"{name} moved with up to {_number(new)} {unit}, before {_number(old)}", None


def _changed(before: _Move, now: _Move) -> Iterator[str]:
    if _differ(before.seconds, now.seconds, TIMES):
        yield f"took {_number(now.seconds)} s, before {_number(before.seconds)}"
    if before.stopped != now.stopped:
        yield f"was stopped: {now.stopped}" if now.stopped else f"is no longer stopped: {before.stopped}"
    if _differ(before.rested_s, now.rested_s, TIMES):
        yield f"was followed by the next after {_number(now.rested_s)} s, before {_number(before.rested_s)}"
    if _differ(before.peak_after_stop_m_s2, now.peak_after_stop_m_s2, SHAKES, relative=True):
        shaken = _number(now.peak_after_stop_m_s2), _number(before.peak_after_stop_m_s2)
        yield f"let the tool shake with {shaken[0]} m/s², before {shaken[1]}"


def _differ(before: float | None, now: float | None, most: float, *, relative: bool = False) -> bool:
    if before is None or now is None:
        return before is not now
    return abs(now - before) > most * (1.0 + abs(before) if relative else 1.0)


def _speed(fastest: _Joint | _Tool | None) -> float | None:
    match fastest:
        case _Joint(speed_rad_s=speed) | _Tool(speed_m_s=speed):
            return speed
    return None


def _number(value: float | None) -> str:
    return "nothing" if value is None else f"{value:.4g}"
