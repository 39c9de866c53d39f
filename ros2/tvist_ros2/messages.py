"""The messages of ROS 2 that the gateway uses, read from messages.txt, and their types, from hashes.txt."""

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from types import SimpleNamespace
from typing import Any, NamedTuple

from msgspec import defstruct


class RosType(NamedTuple):
    """Type of a topic or service."""

    name: str  # ROS 2's name
    hash: str  # RIHS01, without the prefix
    request: Any
    """Class of a topic's messages, or of a service's requests."""
    response: Any = None
    """Class of a service's responses; None for a topic."""


@cache
def parts_of(kind: str) -> tuple[str, bool, int | None]:
    """Return the type of an entry, whether there are several, and their number; None if the data tells it."""
    inner, bracket, size = kind.rstrip("]").partition("[")
    return inner, bool(bracket), int(size) if size else None


def seconds(duration: Any) -> float:
    """Return a Duration or a Time as a number [s]."""
    return float(duration.sec + 1e-9 * duration.nanosec)


def _lines(file: str) -> list[str]:
    """Return the lines of a file of this package without comments; a line that ends with a comma continues."""
    text = files("tvist_ros2").joinpath(file).read_text(encoding="utf-8").replace(",\n", ",")
    return [line for line in text.splitlines() if line and not line.startswith("#")]


def _fields() -> Iterator[tuple[str, tuple[tuple[str, str], ...]]]:
    for line in _lines("messages.txt"):
        name, _, fields = line.partition(":")
        words = fields.replace(",", " ").split()
        yield name, tuple(zip(words[::2], words[1::2], strict=True))


def _default(kind: str, known: dict[str, Any]) -> Any:
    """Return the value that a field of this type has if it is not given, as in ROS 2."""
    inner, several, size = parts_of(kind)
    if size is not None:
        return bytes(size) if inner == "uint8" else (0.0,) * size
    if several:
        return []
    if inner in known:
        return known[inner]()
    return "" if inner == "string" else 0


def _classes() -> dict[str, Any]:
    known: dict[str, Any] = {}
    for name, fields in FIELDS.items():
        known[name] = defstruct(
            name, [(field, Any, _default(kind, known)) for kind, field in fields], frozen=True
        )
    return known


def _types() -> Iterator[RosType]:
    for name, known in map(str.split, _lines("hashes.txt")):
        own = name.rpartition("/")[2]
        if own in FIELDS:
            yield RosType(name, known, getattr(ros, own))
        else:
            yield RosType(name, known, getattr(ros, f"{own}_Request"), getattr(ros, f"{own}_Response"))


FIELDS = dict(_fields())
"""Type and name of each field of a message, by the message's name."""
ros = SimpleNamespace(**_classes())
"""The classes of the messages, by their names without the package."""
TYPES = {kind.name: kind for kind in _types()}
"""The types of topics and services, by their names."""
FEEDBACK = TYPES["control_msgs/action/FollowJointTrajectory_FeedbackMessage"]
JAZZY_FEEDBACK = TYPES["control_msgs/action/JazzyFeedbackMessage"]._replace(name=FEEDBACK.name)
"""The type of the feedback before control_msgs 6.3, which brought two more fields."""
