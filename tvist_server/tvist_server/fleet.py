"""Which robots one process serves: `ur5e*16`, or `ur5e*2,other.toml`."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from tvist_protocol.errors import ProtocolError
from tvist_protocol.keys import check_robot_name

MOST = 64
"""Robots in one process. More than a core can tick in real time, and enough for a test in lockstep."""


@dataclass(frozen=True)
class Member:
    """One robot of several."""

    robot: str
    """Robot that comes with the package, or path of a robot file."""
    name: str
    """Its name on the network."""


def members(text: str) -> list[Member]:
    """Robots of a list like `ur5e*2,other.toml`: ROBOT[*COUNT], with commas.

    A robot is named after its file. One that is there several times has a number behind: `ur5e-1`, `ur5e-2`.

    Raises:
        ValueError: A count is none, a name cannot be one or stands for two, or there are more than `MOST`.
    """
    robots: list[str] = []
    for entry in text.split(","):
        robot, star, count = entry.strip().partition("*")
        if not robot:
            raise ValueError(f"robots is {text!r}: it is a list like ur5e*2,other.toml; a robot is missing")
        robots += [robot] * (_count(entry, count) if star else 1)
        if len(robots) > MOST:
            raise ValueError(f"robots is {text!r}: at most {MOST} robots are served by one process")
    stems = [Path(robot).stem for robot in robots]
    total, so_far = Counter(stems), Counter[str]()
    found: list[Member] = []
    for robot, stem in zip(robots, stems, strict=True):
        so_far[stem] += 1
        name = stem if total[stem] == 1 else f"{stem}-{so_far[stem]}"
        try:
            found.append(Member(robot, check_robot_name(name)))
        except ProtocolError as error:
            raise ValueError(f"robots has {robot!r}, whose file does not make a name: {error.why}") from error
    twice = [name for name, times in Counter(member.name for member in found).items() if times > 1]
    if twice:
        raise ValueError(f"robots is {text!r}: two of them would be named {twice[0]}; rename a file")
    return found


def recording_of(record: str, name: str) -> Path:
    """File that one robot of several is recorded into: `out-ur5e-3.mcap` where `out.mcap` was asked for."""
    path = Path(record)
    return path.with_name(f"{path.stem}-{name}{path.suffix}")


def _count(entry: str, count: str) -> int:
    number = int(count) if count.isascii() and count.isdigit() and len(count) < 10 else 0
    if not 1 <= number <= MOST:
        raise ValueError(
            f"robots has {entry.strip()!r}: behind * stands how many, a whole number from 1 to {MOST}"
        )
    return number
