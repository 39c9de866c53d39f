"""Results of runs as JUnit's XML, which CI systems read."""

from collections.abc import Mapping, Sequence
from typing import Any
from xml.etree import ElementTree as ET

from tvist_protocol.errors import harmless

MEASURES = ("seconds", "largest_peak_after_stop_m_s2")
"""Keys of --json that become properties of a program under their own names."""


def junit(results: Sequence[Mapping[str, Any]]) -> bytes:
    """Return a test suite with a test case for each program.

    A case's time is the robot's. Its properties are what was measured, its failure has a sentence for each thing that
    failed, `system-out` has the program's messages and `system-err` the warnings.

    Args:
        results: What --json prints of each program.
    """
    failed = sum(not result["ok"] for result in results)
    counts = {
        "tests": str(len(results)),
        "failures": str(failed),
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
    """A text in the form that editors and CI systems make a link of."""
    return _readable(f"{file}:{line}: {text}" if line else text)


def _readable(text: str) -> str:
    """Replace characters that XML 1.0 does not permit, which programs may print."""
    return harmless(text).translate(dict.fromkeys((0xFFFE, 0xFFFF), 0xFFFD))
