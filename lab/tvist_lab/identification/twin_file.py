"""Write the robot file of a twin as TOML, with its origin and accuracy in comments and `provenance`."""

import json
import re
from collections.abc import Mapping
from typing import Any

import msgspec
from msgspec.structs import replace

from tvist_lab.identification.twin import Twin
from tvist_plant.description import RobotDescription

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def twin_file(twin: Twin, command: str) -> str:
    """Return the content of the robot file."""
    comments = [f"A twin of a {twin.robot.robot.model}, made by: {command}", *said(twin)]
    return "".join(f"# {line}\n" for line in comments) + toml_of(with_provenance(twin))


def said(twin: Twin) -> list[str]:
    """Return sentences on the data of a twin's fit, its accuracy, and parameters kept from the robot file."""
    whose = "logs that it has not seen" if twin.checked else "its logs, each left out of the fit in turn"
    lines = [f"Fitted to {twin.motions} motions; {len(twin.others)} others were left out."]
    median, p90 = twin.error_percent(0.5), twin.error_percent(0.9)
    if median is None or p90 is None:
        lines.append("No motion vibrates enough to say how well it predicts residual vibration.")
    else:
        lines.append(
            f"Residual vibration of {len(twin.predictions)} motions of {whose}: predicted within {median:.0f} % in "
            f"half of them, within {p90:.0f} % in nine of ten."
        )
    kept = _kept(twin)
    if kept:
        lines.append(
            "Not told by the logs, and so only assumed, near the robot file's: " + "; ".join(kept) + "."
        )
    for number, payload in enumerate(twin.parameters.payloads):
        carried = twin.parameters.payload(twin.values, number)
        lines.append(f"When {payload.mass:g} kg were declared, the arm carried {carried.mass:.2f} kg.")
    if any(twin.late_ms):
        lines.append(
            f"The arm follows its targets {max(twin.late_ms):.0f} ms later than the twin: a robot file has no delay."
        )
    return lines


def _kept(twin: Twin) -> list[str]:
    """Return the names of parameters that the logs do not determine, with their joints or links."""
    links = twin.robot.link_flexibility.links
    places: dict[tuple[str, str], list[int]] = {}
    for entry, told in zip(twin.parameters.entries, twin.told, strict=True):
        if not told and entry.table != "payload":
            own = links if entry.key == "stiffness" else range(twin.robot.joints)
            places.setdefault((entry.table, entry.key), []).extend(own[place] + 1 for place in entry.places)
    return [
        f"{table}.{key}"
        if len(own) == twin.robot.joints or key == "damping_time"
        else f"{table}.{key} of {', '.join(map(str, own))}"
        for (table, key), own in places.items()
    ]


def with_provenance(twin: Twin) -> RobotDescription:
    """Return the robot file with the origin of each fitted key."""
    known, provenance = (
        dict(zip(twin.parameters.entries, twin.told, strict=True)),
        dict(twin.robot.provenance),
    )
    for table, key in dict.fromkeys((entry.table, entry.key) for entry in known):
        own = [told for entry, told in known.items() if (entry.table, entry.key) == (table, key)]
        if table == "payload":
            provenance[f"{table}.{key}"] = "measured: fitted to logs, beside what was declared"
        elif any(own):
            part = "" if all(own) else f", which tell {sum(own)} of {len(own)} values"
            provenance[f"{table}.{key}"] = f"measured: fitted to {twin.motions} motions of logs{part}"
        else:
            provenance[f"{table}.{key}"] = (
                "assumed: near the value of the file that the fit began at, since the logs do not tell"
            )
    return replace(twin.robot, provenance=provenance)


def toml_of(description: RobotDescription) -> str:
    """Return a robot file as TOML."""
    content: dict[str, Any] = msgspec.to_builtins(description)
    tables = {name: value for name, value in content.items() if isinstance(value, dict) and value}
    lists = {name: value for name, value in content.items() if isinstance(value, list | tuple) and value}
    lines = [f"{name} = {_value(value)}\n" for name, value in lists.items()]
    for name, table in tables.items():
        lines += [f"\n[{name}]\n", *(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())]
    return "".join(lines)


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else json.dumps(key)


def _value(value: Any) -> str:
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(key)} = {_value(own)}" for key, own in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    return json.dumps(value)
