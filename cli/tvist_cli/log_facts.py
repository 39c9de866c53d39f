"""What a recording or a log holds, in words."""

from typing import Any

from tvist_cli.output import out, words


def show_facts(found: dict[str, Any]) -> None:
    """Print a file's robot, time, events, and its columns with their shapes and units.

    Args:
        found: What `tvist_lab.summary.summary` returns.
    """
    out.print(found["file"], markup=False)
    words(_facts(found))


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
    facts["events"] = ", ".join(f"{count} {kind}" for kind, count in found["events"].items()) or "none"
    if found["bytes"] is not None:
        size = found["bytes"]
        facts["size"] = f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.1f} kB"
    facts["columns"] = ", ".join(map(_column, found["columns"]))
    return facts


def _column(column: dict[str, Any]) -> str:
    _, *shape = column["shape"]
    words = (column["name"], " × ".join(map(str, shape)), column["unit"] and f"[{column['unit']}]")
    return " ".join(filter(None, words))


def _lack(from_tick: int | None) -> str:
    if from_tick is not None:
        return f"has forgotten all before tick {from_tick}"
    return "does not contain the robot's commands"
