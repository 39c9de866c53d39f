"""The robots that one process serves, from a list such as `ur5e*16` or `ur5e*2,other.toml`."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from tvist_protocol.errors import ProtocolError
from tvist_protocol.keys import check_robot_name

MOST = 64
"""Largest number of robots in one process: more than a core can run in real time, and enough for lockstep tests."""


@dataclass(frozen=True)
class Member:
    """One of the robots that `robots` lists."""

    robot: str
    """Name of a robot that comes with the package, or path of a robot file."""
    name: str
    """Name of the robot on the network."""


def members(text: str, most: int = MOST) -> list[Member]:
    """Parse a list of robots such as `ur5e*2,other.toml`: ROBOT[*COUNT], separated by commas.

    A robot is named after its file. A robot that is listed several times gets a number: `ur5e-1`, `ur5e-2`.

    Args:
        text: The list.
        most: Largest number of robots.

    Raises:
        ValueError: A count or a name is invalid, two robots would have the same name, or there are more than `most`.
    """
    robots: list[str] = []
    for entry in text.split(","):
        robot, star, count = entry.strip().partition("*")
        if not robot:
            raise ValueError(
                f"robots is {text!r}: must be a list such as ur5e*2,other.toml; a robot is missing"
            )
        robots += [robot] * (_count(entry, count, most) if star else 1)
        if len(robots) > most:
            raise ValueError(
                f"robots is {text!r}: one process serves at most {MOST} robots, and more workers serve more"
            )
    stems = [Path(robot).stem for robot in robots]
    total, so_far = Counter(stems), Counter[str]()
    found: list[Member] = []
    for robot, stem in zip(robots, stems, strict=True):
        so_far[stem] += 1
        name = stem if total[stem] == 1 else f"{stem}-{so_far[stem]}"
        try:
            found.append(Member(robot, check_robot_name(name)))
        except ProtocolError as error:
            raise ValueError(
                f"robots has {robot!r}, whose file name is not a robot's name: {error.why}"
            ) from error
    twice = [name for name, times in Counter(member.name for member in found).items() if times > 1]
    if twice:
        raise ValueError(f"robots is {text!r}: two robots would be named {twice[0]}; rename a file")
    return found


def recording_of(record: str, name: str) -> Path:
    """Return the file that one of several robots records into: `out-ur5e-3.mcap` for `out.mcap`."""
    path = Path(record)
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


def _count(entry: str, count: str, most: int) -> int:
    number = int(count) if count.isascii() and count.isdigit() and len(count) < 10 else 0
    if not 1 <= number <= most:
        raise ValueError(
            f"robots has {entry.strip()!r}: the count after * must be a whole number from 1 to {most}"
        )
    return number
