"""Parses values of start options: files, durations, numbers, postures and lists of robots."""

import math
import re
import tomllib
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from tvist_plant.user_file import read_bytes, read_toml
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.keys import check_robot_name

if TYPE_CHECKING:
    from tvist_plant.description import RobotDescription

T = TypeVar("T")

RATE = 500  # number of ticks in a second of simulation time
SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}  # seconds in each unit of a duration
LONGEST = 1000.0 * 3600.0
"""Longest accepted duration [s]."""
MAX_ROBOTS = 64
"""Largest number of robots in one process: more than a core can run in real time, and enough for lockstep tests."""

_DURATION = re.compile(r"\s*(?P<number>\d+(\.\d+)?)\s*(?P<unit>s|min|h)\s*", re.IGNORECASE | re.ASCII)


class StartError(ValueError):
    """A file or an option is invalid; the message gives name, key, value and what is allowed."""


def read_start_file(path: str | Path, what: str, kind: type[T]) -> T:
    """Read a TOML or .json file and check its content; StartError or UserFileError if it is invalid."""
    try:
        is_json = Path(path).suffix == ".json"
        return checked(parse_json(read_bytes(path, what)) if is_json else read_toml(path, what), kind)
    except OSError as error:
        raise StartError(f"{what} {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise StartError(f"{what} {path}: it is not valid TOML: {error}") from error
    except ProtocolError as error:
        raise StartError(f"{what} {path}: {error.why}") from error


def ticks_of(text: str, name: str) -> int:
    """Return the number of ticks of a duration such as `90s`, `10min` or `2h`; `name` is the option."""
    found = _DURATION.fullmatch(text)
    seconds = 0.0 if found is None else float(found["number"]) * SECONDS[found["unit"].lower()]
    if not 1.0 <= seconds <= LONGEST:
        raise StartError(
            f"{name} is {text!r:.40}: must be a duration such as 90s, 10min or 2h, from 1s to 1000h"
        )
    return round(seconds * RATE)


def posture(start: str | tuple[float, ...], description: "RobotDescription") -> tuple[float, ...]:
    """Return the joint angles of a pose, given by its name or as angles separated by commas [rad]."""
    if not isinstance(start, str):
        return start
    for name, pose in description.poses.items():
        if name.lower() == start.strip().lower():
            return pose
    try:
        return tuple(float(angle) for angle in start.split(","))
    except ValueError:
        known = ", ".join(description.poses)
        raise StartError(
            f"start is {start.strip()!r}: must be one of {known}, or angles separated by commas"
        ) from None


def numbers_of(name: str, given: str | tuple[float, ...], count: int) -> tuple[float, ...]:
    """Return the numbers of an option, given as a tuple or as text separated by commas."""
    try:
        numbers = tuple(map(float, given.split(",") if isinstance(given, str) else given))
    except ValueError:
        numbers = ()
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise StartError(f"{name} is {given!r}: must be {count} numbers, separated by commas")
    return numbers


def robots_in(text: str, most: int = MAX_ROBOTS) -> list[tuple[str, str]]:
    """Return file and name of each robot in a list: `ur5e*2,other.toml` gives names ur5e-1, ur5e-2, other."""
    robots: list[str] = []
    for entry in text.split(","):
        robot, star, count = entry.strip().partition("*")
        if not robot:
            raise StartError(
                f"robots is {text!r}: must be a list such as ur5e*2,other.toml; a robot is missing"
            )
        robots += [robot] * (count_of(f"robots has {entry.strip()!r}", count, most) if star else 1)
        if len(robots) > most:
            raise StartError(
                f"robots is {text!r}: one process serves at most {MAX_ROBOTS} robots, and more workers serve more"
            )
    stems = [Path(robot).stem for robot in robots]
    total, so_far = Counter(stems), Counter[str]()
    found: list[tuple[str, str]] = []
    for robot, stem in zip(robots, stems, strict=True):
        so_far[stem] += 1
        name = stem if total[stem] == 1 else f"{stem}-{so_far[stem]}"
        try:
            found.append((robot, check_robot_name(name)))
        except ProtocolError as error:
            raise StartError(
                f"robots has {robot!r}, whose file name is not a robot's name: {error.why}"
            ) from error
    twice = [name for name, times in Counter(name for _, name in found).items() if times > 1]
    if twice:
        raise StartError(f"robots is {text!r}: two robots would be named {twice[0]}, so rename a file")
    return found


def recording_of(record: str, name: str) -> Path:
    """Return the recording file of one of several robots: `out-ur5e-3.mcap` for `out.mcap`."""
    path = Path(record)
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


def count_of(what: str, count: str, most: int) -> int:
    """Return the count after a `*`; StartError, which begins with `what`, unless it is 1 to `most`."""
    number = int(count) if count.isascii() and count.isdigit() and len(count) < 10 else 0
    if not 1 <= number <= most:
        raise StartError(f"{what}: the count after * must be a whole number from 1 to {most}")
    return number
