"""`tvist log info`: what a recording holds."""

from pathlib import Path
from typing import Any

from tvist_cli.failure import told
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.output import out, print_json, table, words


def info(file: Path, *, logs: LogOptions = AS_IT_IS, json: bool = False) -> None:
    """Print what a recording or a log holds: its robot, time, events, and its columns with their shapes and units.

    Args:
        file: A recording, an exported file, or any log that tvist log analyze reads.
        logs: How to read logs.
        json: Print one JSON object.
    """
    from tvist_lab.recordings import RecordingError
    from tvist_lab.summary import summary

    with told(RecordingError):
        found = summary(file, logs.read(file, sensor=True)[0] if logs.given else None)
    if json:
        print_json(found)
        return
    out.print(str(file), markup=False)
    words(_facts(found))
    table(
        "columns",
        ("name", "shape", "unit"),
        [
            (column["name"], " × ".join(map(str, column["shape"])), column["unit"] or "–")
            for column in found["columns"]
        ],
    )
    for note in found["notes"]:
        out.print(note, markup=False)


def _facts(found: dict[str, Any]) -> dict[str, str]:
    facts = {}
    if found["robot"] is not None:
        facts["robot"] = found["robot"] + (f", a {found['model']}" if found["model"] else "")
    if found["version"] is not None:
        facts["recorded by"] = f"tvist {found['version']}"
    facts["time"] = f"{found['duration_s']:.3f} s from {found['start_s']:.3f} s on"
    missing = found["missing_ticks"]
    facts["rows"] = f"{found['rows']}, {missing or 'no'} tick{'' if missing == 1 else 's'} missing"
    if found["complete"] is not None:
        facts["closed"] = "yes" if found["complete"] else "no: cut off or damaged"
        facts["replay"] = "yes" if found["replayable"] else f"no: it {_lack(found['from_tick'])}"
        facts["messages"] = ", ".join(f"{count} {kind}" for kind, count in found["messages"].items())
    if found["motions"] is not None:
        facts["motions"] = str(found["motions"])
    facts["events"] = ", ".join(f"{count} {kind}" for kind, count in found["events"].items()) or "none"
    if found["bytes"] is not None:
        size = found["bytes"]
        facts["size"] = f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.1f} kB"
    return facts


def _lack(from_tick: int | None) -> str:
    if from_tick is not None:
        return f"has forgotten all before tick {from_tick}"
    return "does not contain the robot's commands"
