"""The markers of a test, and the robot that they describe."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

Part = dict[str, Any]  # what a marker adds to the description of a robot
FAULTS = "tvist_faults"  # the only marker of which all occurrences count
FILES = (".toml", ".json")  # suffixes of files with a state
ROBOTS = pytest.StashKey[list[Any]]()  # a test's robots, each a `serving.RobotOfTest`


@dataclass(frozen=True)
class WantedFault:
    """A fault to inject, with the fields of `simulation.inject`."""

    fault: str
    joint: int | None = None
    seconds: float | None = None
    value: float | None = None
    after: float = 0.0  # simulation time of the injection [s]; 0 is before the first tick


@dataclass(frozen=True)
class WantedRobot:
    """One robot, in the form sent as JSON to the process that makes robots."""

    options: dict[str, Any]  # options of `tvist serve`, as in a configuration file
    program: tuple[str, str] | None = None  # name and text of the program to load
    faults: tuple[WantedFault, ...] = ()
    ur: bool = False  # whether UR's interfaces are open, on their own address if the system has several
    log: str = ""  # path of the robot's log


class MarkerError(ValueError):
    """A marker has invalid arguments; the message says which, and what is expected."""


def robot(robot: str) -> Part:
    """Name of the robot, such as "ur5e", or path of a robot file."""
    return {"robot": _text("tvist_robot", robot)}


def payload(kilograms: float) -> Part:
    """Mass that the arm carries and declares as payload [kg]."""
    return {"payload": _number("tvist_payload", kilograms, "a mass in kg")}


def shaper(shaper: str) -> Part:
    """Name of the shaper, such as "none" or "zv", or FILE.py:NAME."""
    return {"shaper": _text("tvist_shaper", shaper)}


def plant(plant: str) -> Part:
    """Arm to move instead of the simulated one: FILE.py:NAME, or the name of an installed plant, such as "mujoco"."""
    return {"plant": _text("tvist_plant", plant)}


def cell(cell: str) -> Part:
    """Cell around the robot: a TOML file with wires, tools, a gripper and parts; see `tvist serve --cell`."""
    return {"cell": _text("tvist_cell", cell)}


def state(
    start: str | None = None,
    *,
    q: Any = None,
    mode: str | None = None,
    payload: Mapping[str, Any] | None = None,
) -> Part:
    """State at the start: a pose such as "Q2", or a file; or q [rad], mode such as "POWER_OFF", carried payload."""
    given = {"q": q, "mode": mode, "payload": payload}
    fields = {name: value for name, value in given.items() if value is not None}
    part: Part = {"fields": fields} if fields else {}
    if start is not None:
        file = _text("tvist_state", start).endswith(FILES)
        if file and fields:
            raise MarkerError(f"tvist_state has the file {start} and {', '.join(fields)}: give one of both")
        part["state" if file else "start"] = start
    if not part:
        raise MarkerError(
            'tvist_state has no argument: give a pose such as "Q2", a file, or q=, mode=, payload='
        )
    return part


def faults(
    fault: str,
    *,
    joint: int | None = None,
    seconds: float | None = None,
    value: float | None = None,
    after: float = 0.0,
) -> Part:
    """Fault for simulation.inject with its fields, after a simulation time [s]; repeat the marker for more faults."""
    from tvist_protocol import faults as known

    if fault not in known.FAULTS:
        raise MarkerError(f"{FAULTS} has the fault {fault!r}: must be one of {', '.join(known.FAULTS)}")
    if _number(FAULTS, after, "a time in s") < 0.0:
        raise MarkerError(f"{FAULTS} has after={after:g}: must be at least 0 s")
    return {"faults": WantedFault(fault, joint, seconds, value, float(after))}


def program(program: str) -> Part:
    """URScript program to load: its text, or a file NAME.script; `arm.play_program()` or the dashboard plays it."""
    text = _text("tvist_program", program)
    if "\n" in text or not text.endswith(".script"):
        return {"program": ("test", text)}
    path = Path(text)
    try:
        return {"program": (path.stem, path.read_text(encoding="utf-8"))}
    except OSError as error:
        raise MarkerError(f"tvist_program has the file {text}: {error.strerror}") from error
    except UnicodeDecodeError:
        raise MarkerError(f"tvist_program has the file {text}: must be text in UTF-8") from None


def seed(seed: int) -> Part:
    """Seed of sensor noise and gear errors; without the marker, the value of --tvist-seed."""
    if not isinstance(seed, int) or isinstance(seed, bool):
        raise MarkerError(f"tvist_seed has {seed!r}: must be a whole number")
    return {"seed": seed}


MARKERS: dict[str, Callable[..., Part]] = {
    "tvist_robot": robot,
    "tvist_payload": payload,
    "tvist_shaper": shaper,
    "tvist_plant": plant,
    "tvist_cell": cell,
    "tvist_state": state,
    FAULTS: faults,
    "tvist_program": program,
    "tvist_seed": seed,
}


def described() -> list[str]:
    """Return the markers with their arguments and descriptions, as pytest lists them."""
    lines = []
    for name, function in MARKERS.items():
        signature = inspect.signature(function).replace(return_annotation=inspect.Signature.empty)
        plain = [one.replace(annotation=inspect.Parameter.empty) for one in signature.parameters.values()]
        lines.append(f"{name}{signature.replace(parameters=plain)}: {function.__doc__}")
    return lines


def combined(item: pytest.Item) -> Part:
    """Return what a test's markers describe; of repeated ones, only the nearest counts, but all faults do."""
    found: Part = {}
    for name, function in MARKERS.items():
        if name != FAULTS and (marker := item.get_closest_marker(name)) is not None:
            found |= _called(name, function, marker)
    injected = [_called(FAULTS, faults, marker)["faults"] for marker in item.iter_markers(FAULTS)]
    return found | {"faults": tuple(injected[::-1])}  # in the order of the source: markers come nearest first


def _called(name: str, function: Callable[..., Part], marker: pytest.Mark) -> Part:
    try:
        inspect.signature(function).bind(*marker.args, **marker.kwargs)
    except TypeError as error:
        takes = ", ".join(inspect.signature(function).parameters)
        raise MarkerError(f"{name} has wrong arguments, {error}: it takes {takes}") from None
    return function(*marker.args, **marker.kwargs)


def _text(name: str, value: object) -> str:
    if not isinstance(value, str | Path) or not str(value).strip():
        raise MarkerError(f"{name} has {value!r}: must be a non-empty string")
    return str(value)


def _number(name: str, value: object, what: str) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise MarkerError(f"{name} has {value!r}: must be {what}")
    return float(value)
