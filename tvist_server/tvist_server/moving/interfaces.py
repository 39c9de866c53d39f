"""What a robot's other interfaces say: its limits and dimensions, and the answers of its dashboard."""

import socket
import time
from collections.abc import Callable, Sequence
from struct import Struct, error
from typing import NamedTuple, TypeVar

import numpy as np
from msgspec.structs import replace

from tvist_plant.description import RobotDescription
from tvist_protocol.errors import short
from tvist_server.watching.place import Place

PATIENCE = 2.0
"""Longest duration of a conversation [s]."""
MOST = 1 << 20
"""Most bytes that are taken as an answer."""
DASHBOARD = 29999
"""Port of the dashboard server on a robot of UR's."""
_UNKNOWN = "could not understand"
_PACKAGE, _PART, _DATA = Struct(">iB"), Struct(">IB"), Struct(">53d4i")
PRIMARY = 30001
"""Port of the primary interface on a robot of UR's."""
STATE, CONFIGURATION = 16, 6
"""Type of the packages with a robot's state, and number of the part with its configuration."""
FAR, TURNED = 5e-3, 0.01
"""Differences of its dimensions from the robot file, from which on it is another model [m, rad]."""
T = TypeVar("T")


class NoAnswerError(Exception):
    """An interface does not answer; the message says which, and why."""


def ask(place: Place, question: bytes, answer: Callable[[bytes], T | None]) -> T:
    """Send a question, and return what its answer says.

    Args:
        place: The interface.
        question: What to send, as soon as the connection is there.
        answer: Reads what has come so far; None if more has to come.

    Raises:
        NoAnswerError: There is no interface, or it does not answer in time.
    """
    heard, ends = b"", time.monotonic() + PATIENCE
    try:
        with socket.create_connection((place.host, place.port), PATIENCE) as connection:
            connection.sendall(question)
            while len(heard) < MOST and (left := ends - time.monotonic()) > 0.0:
                connection.settimeout(left)
                data = connection.recv(1 << 16)
                heard += data
                found = answer(heard)
                if found is not None:
                    return found
                if not data:
                    break
    except OSError as error:
        raise NoAnswerError(f"port {place.port} of {place.host}: {error.strerror or error}") from error
    raise NoAnswerError(f"port {place.port} of {place.host} gives no answer within {PATIENCE:g} s")


def asked(place: Place, questions: Sequence[str]) -> dict[str, str]:
    """Return the answers by question; those that it does not understand are left out, all if there is no dashboard."""
    text = "".join(f"{question}\n" for question in (*questions, "quit")).encode()

    def answers(heard: bytes) -> dict[str, str] | None:
        # Without the greeting, and what is incomplete.
        lines = heard.decode(errors="replace").split("\n")[1:-1]
        if len(lines) < len(questions):
            return None
        found = zip(questions, lines, strict=False)
        return {question: short(line.strip()) for question, line in found if _UNKNOWN not in line}

    try:
        return ask(place.beside(DASHBOARD), text, answers)
    except NoAnswerError:
        return {}


class Configuration(NamedTuple):
    """What a robot is, and may do; all arrays have shape (6,)."""

    least: np.ndarray
    """Smallest joint angles [rad]."""
    most: np.ndarray
    """Largest joint angles [rad]."""
    velocity: np.ndarray
    """Largest velocities [rad/s]."""
    acceleration: np.ndarray
    """Largest accelerations [rad/s²]."""
    a: np.ndarray
    """Denavit and Hartenberg's lengths [m], as the next [m] and angles [rad]."""
    d: np.ndarray
    alpha: np.ndarray

    def trouble(self) -> str | None:
        """Return why no motion can be planned within its limits, equal in both directions; None if it can."""
        for name, found, least, most in (
            ("smallest angles", self.least, -1e3, -0.1),
            ("largest angles", self.most, 0.1, 1e3),
            ("largest velocities", self.velocity, 0.05, 1e2),
            ("largest accelerations", self.acceleration, 0.5, 1e4),
        ):
            if not ((least <= found) & (found <= most)).all():
                must = f"must be {least:g} to {most:g}"
                return f"the {name} of its joints are {found.tolist()}: {must}; correct them in its safety settings"
        return None

    def is_of(self, description: RobotDescription) -> bool:
        """Return whether its dimensions are those of a robot file."""
        file = description.kinematics
        pairs = (self.a, file.a, FAR), (self.d, file.d, FAR), (self.alpha, file.alpha, TURNED)
        return all(np.abs(own - np.array(there)).max() <= apart for own, there, apart in pairs)


def configuration_of(place: Place) -> Configuration | None:
    """Ask a robot for its configuration; None if it does not tell any."""
    try:
        return ask(place.beside(PRIMARY), b"", found)
    except NoAnswerError:
        return None


def found(heard: bytes) -> Configuration | None:
    """Return the configuration in what a primary interface has sent so far; None if it has not come yet."""
    try:
        for package in _split(heard, _PACKAGE, STATE):
            for part in _split(package, _PART, CONFIGURATION):
                return _read(part)
    except error:  # the rest is still to come
        pass
    return None


def _split(data: bytes, head: Struct, wanted: int) -> list[bytes]:
    """Return the bodies of the packages of a type; each begins with its length and its type."""
    at, bodies = 0, list[bytes]()
    while len(data) - at >= head.size:
        length, kind = head.unpack_from(data, at)
        if length < head.size or len(data) - at < length:
            break
        if kind == wanted:
            bodies.append(data[at + head.size : at + length])
        at += length
    return bodies


def _read(part: bytes) -> Configuration:
    numbers = np.array(_DATA.unpack_from(part)[:53])
    position, motion = numbers[:12].reshape(6, 2), numbers[12:24].reshape(6, 2)
    a, d, alpha, _ = numbers[29:].reshape(4, 6)
    return Configuration(position[:, 0], position[:, 1], motion[:, 0], motion[:, 1], a, d, alpha)


def narrowed(
    description: RobotDescription, configuration: Configuration | None, speed_cap: float
) -> RobotDescription:
    """Return a robot file with limits no wider than the robot's own, nor than the speed cap.

    Args:
        description: The robot file.
        configuration: What the robot says; None if it says nothing.
        speed_cap: Largest velocity of every joint [rad/s].
    """
    limits = description.limits
    position, velocity, acceleration = map(np.array, (limits.position, limits.velocity, limits.acceleration))
    velocity = np.minimum(velocity, speed_cap)
    if configuration is not None:
        position = np.minimum(position, np.minimum(-configuration.least, configuration.most))
        velocity = np.minimum(velocity, configuration.velocity)
        acceleration = np.minimum(acceleration, configuration.acceleration)
    own = {"position": position, "velocity": velocity, "acceleration": acceleration}
    return replace(
        description, limits=replace(limits, **{name: tuple(most.tolist()) for name, most in own.items()})
    )
