"""What has changed since an earlier run of the same programs in lockstep, which `tvist run --json` printed."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from tvist_lab.programs.limits import Shortcoming
from tvist_plant.plant import PERIOD
from tvist_plant.user_file import UserFileError, read_text

Run = Mapping[str, Any]
"""What --json prints of a program."""

ROUNDING = {"_s": 0.5 * PERIOD, "seconds": 0.5 * PERIOD}
"""Differences of times that count as none, by the end of the key [s]."""
SHARES = {"_m_s2": 1e-3, "_rad_s": 1e-4, "_m_s": 1e-4}
"""The same of accelerations and speeds, as shares of one more than the earlier value: what another processor may make
different in the same run."""
OF_MOVES = ("seconds", "stopped", "rested_s", "peak_after_stop_m_s2")
"""Keys of a move that are compared."""


class BaselineError(ValueError):
    """A file is no baseline of these programs; the message says why."""


def read_baseline(path: Path, files: Sequence[str]) -> Mapping[str, Run]:
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
        runs = {run["file"]: run for run in content.get("programs", [content])}
        in_real_time = [file for file, run in runs.items() if not run.get("lockstep", True)]
        for run in runs.values():
            for name, value in _points(run).items():  # whether they can be compared
                _differ(name, value, value)
            _warned(run)
    except (
        msgspec.DecodeError, UserFileError, AttributeError, KeyError, TypeError, OverflowError, RecursionError,
    ) as error:  # fmt: skip
        raise BaselineError(f"baseline {path} is not what tvist run --lockstep --json prints") from error
    if in_real_time:
        raise BaselineError(f"baseline {path} is of a run in real time: make it with --lockstep")
    if set(runs) != set(files):
        was = ", ".join(map(str, runs)) or "nothing"
        raise BaselineError(
            f"baseline {path} is of {was}, and this run is of {', '.join(files)}: give the same"
        )
    return runs


def changes(before: Run, now: Run) -> Iterator[Shortcoming]:
    """Say what is different from the baseline beyond rounding.

    Args:
        before: A program's run in the baseline.
        now: Its run now.
    """
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
    """What is compared of a run; of one that did not compile, just that."""
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
