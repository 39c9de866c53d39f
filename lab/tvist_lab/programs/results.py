"""Results of a run as text, as plain values for --json, and as JUnit XML."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree as ET

from tvist_lab.phrases import counted
from tvist_lab.programs.watch import Fastest, ProgramMessage, ProgramMove, ProgramWatch
from tvist_plant.plant import PERIOD
from tvist_protocol.errors import harmless

MEASURES = ("seconds", "largest_peak_after_stop_m_s2")
"""Keys of --json that become properties of a program in JUnit XML under their own names."""


@dataclass(frozen=True)
class Shortcoming:
    """A reason why a run counts as failed."""

    kind: str  # how the run ended, a limit such as `max_shake`, `expect`, `baseline`, or `recording`
    text: str
    line: int | None = None  # line of the program to which it belongs, if any


def largest_peak(watch: ProgramWatch) -> float | None:
    """Return the largest tool acceleration after a stop [m/s²]; None without a stop or a measurement."""
    return max((move.peak for move in watch.moves if move.peak is not None), default=None)


def summary(watch: ProgramWatch) -> str:
    """Summarize how long a program ran, how often it moved, and how much the tool vibrated."""
    said = f"{watch.name} ran for {watch.seconds:.3f} s of robot time"
    if watch.moves:
        said += f" and made {counted(len(watch.moves), 'move')}"
    peak = largest_peak(watch)
    return said if peak is None else f"{said}; after a stop the tool shook with at most {peak:.3g} m/s²"


def as_dict(watch: ProgramWatch) -> dict[str, Any]:
    """Return all results of a run as plain values."""
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
    """Return the largest contact force and the positions of bodies; empty without a world."""
    things = watch.plant.things()
    if things is None:
        return {}
    hardest = watch.hardest
    force = {"force_n": hardest.speed, "timestamp": seconds(hardest.tick), "line": hardest.line or None}
    poses = zip(things.bodies, watch.plant.places().tolist(), strict=True)
    return {"largest_contact_force": force, "bodies": dict(poses)}


def seconds(ticks: int) -> float:
    """Convert a tick to its time, as in `timestamp` of `state`, or a number of ticks to a duration [s]."""
    return round(ticks * PERIOD, 6)  # a float cannot represent 0.002 exactly


def _message(said: ProgramMessage) -> dict[str, Any]:
    message: dict[str, Any] = {"timestamp": seconds(said.tick), "kind": said.kind, "text": said.text}
    return message | ({"title": said.title, "level": said.level} if said.kind == "popup" else {})


def _move(move: ProgramMove) -> dict[str, Any]:
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
    return {f"speed_{unit}": fastest.speed, "timestamp": seconds(fastest.tick), "line": fastest.line or None}


def junit(results: Sequence[Mapping[str, Any]]) -> bytes:
    """Convert the output of --json for programs to JUnit XML: a test suite with a case for each program."""
    # A case has the robot's time, measurements as properties, a sentence for each failure, the program's
    # messages in `system-out` and warnings in `system-err`.
    counts = {
        "tests": str(len(results)),
        "failures": str(sum(not result["ok"] for result in results)),
        "errors": "0",
        "skipped": "0",
        "time": f"{sum(result.get('seconds', 0.0) for result in results):.3f}",
    }
    suites = ET.Element("testsuites", {"name": "tvist run", **counts})
    suite = ET.SubElement(suites, "testsuite", {"name": "tvist run", **counts})
    for result in results:
        _add(suite, result)
    ET.indent(suites)
    text: bytes = ET.tostring(suites, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _add(suite: ET.Element, result: Mapping[str, Any]) -> None:
    file = _readable(result["file"])
    time = f"{result.get('seconds', 0.0):.3f}"
    case = ET.SubElement(
        suite, "testcase", {"classname": "tvist run", "name": file, "file": file, "time": time}
    )
    if measures := _measures(result):
        properties = ET.SubElement(case, "properties")
        for name, value in measures.items():
            ET.SubElement(properties, "property", {"name": name, "value": value})
    if result["failures"]:
        texts = [_placed(file, failure["line"], failure["text"]) for failure in result["failures"]]
        about = {"message": "; ".join(_readable(one["text"]) for one in result["failures"])}
        kind = result["failures"][0]["kind"]
        ET.SubElement(case, "failure", {**about, "type": kind}).text = "\n".join(texts)
    for tag, key in (("system-out", "messages"), ("system-err", "warnings")):
        if said := [_placed(file, one.get("line"), one["text"]) for one in result.get(key, ())]:
            ET.SubElement(case, tag).text = "\n".join(said)


def _measures(result: Mapping[str, Any]) -> dict[str, str]:
    found = {name: result[name] for name in MEASURES if result.get(name) is not None}
    if "moves" in result:
        found["moves"] = len(result["moves"])
        found["largest_joint_speed_rad_s"] = result["largest_joint_speed"]["speed_rad_s"]
        found["largest_tool_speed_m_s"] = result["largest_tool_speed"]["speed_m_s"]
    return {name: f"{value:.6g}" for name, value in found.items()}


def _placed(file: str, line: int | None, text: str) -> str:
    """Format a text with its position, as a link for editors and CI systems."""
    return _readable(f"{file}:{line}: {text}" if line else text)


def _readable(text: str) -> str:
    """Replace characters that XML 1.0 does not permit, which programs may print."""
    return harmless(text).translate(dict.fromkeys((0xFFFE, 0xFFFF), 0xFFFD))
