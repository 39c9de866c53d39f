"""Queries to a real robot's other interfaces: its limits and dimensions, and the answers of its dashboard."""

import socket
import time
from collections.abc import Callable, Sequence
from struct import Struct, error
from typing import NamedTuple, TypeVar

import numpy as np
from msgspec.structs import replace

from tvist_plant.description import RobotDescription
from tvist_protocol.errors import short
from tvist_server.watching.address import RobotAddress

PATIENCE = 2.0  # longest duration of a conversation [s]
MAX_ANSWER = 1 << 20  # largest answer [bytes]
DASHBOARD = 29999  # port of the dashboard server on a UR robot
_UNKNOWN = "could not understand"
_PACKAGE, _PART, _DATA = Struct(">iB"), Struct(">IB"), Struct(">53d4i")
PRIMARY = 30001  # port of the primary interface on a UR robot
STATE, CONFIGURATION = 16, 6  # type of robot state packages, and number of their part with the configuration
FAR, TURNED = 5e-3, 0.01  # larger differences from the robot file mean another model [m, rad]
T = TypeVar("T")


class NoAnswerError(Exception):
    """An interface does not answer; the message names it and gives the reason."""


def query(place: RobotAddress, question: bytes, answer: Callable[[bytes], T | None]) -> T:
    """Return an interface's reply once `answer` parses it (None: partial); NoAnswerError after `PATIENCE`."""
    heard, ends = b"", time.monotonic() + PATIENCE
    try:
        with socket.create_connection((place.host, place.port), PATIENCE) as connection:
            connection.sendall(question)
            while len(heard) < MAX_ANSWER and (left := ends - time.monotonic()) > 0.0:
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


def query_dashboard(place: RobotAddress, questions: Sequence[str]) -> dict[str, str]:
    """Return the dashboard's answers to questions it understands, by question; empty without a dashboard."""
    text = "".join(f"{question}\n" for question in (*questions, "quit")).encode()

    def answers(heard: bytes) -> dict[str, str] | None:
        # Skip the greeting and an incomplete last line.
        lines = heard.decode(errors="replace").split("\n")[1:-1]
        if len(lines) < len(questions):
            return None
        found = zip(questions, lines, strict=False)
        return {question: short(line.strip()) for question, line in found if _UNKNOWN not in line}

    try:
        return query(place.beside(DASHBOARD), text, answers)
    except NoAnswerError:
        return {}


class Configuration(NamedTuple):
    """Dimensions and limits that a robot reports; all arrays have shape (6,)."""

    least: np.ndarray  # smallest joint angles [rad]
    most: np.ndarray  # largest joint angles [rad]
    velocity: np.ndarray  # largest velocities [rad/s]
    acceleration: np.ndarray  # largest accelerations [rad/s²]
    a: np.ndarray  # Denavit-Hartenberg link lengths [m]; `d` are offsets [m] and `alpha` twists [rad]
    d: np.ndarray
    alpha: np.ndarray

    def trouble(self) -> str | None:
        """Return why motions cannot be planned within these limits; None if they can."""
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
        """Return whether the dimensions agree with a robot file."""
        file = description.kinematics
        pairs = (self.a, file.a, FAR), (self.d, file.d, FAR), (self.alpha, file.alpha, TURNED)
        return all(np.abs(own - np.array(there)).max() <= apart for own, there, apart in pairs)


def configuration_of(place: RobotAddress) -> Configuration | None:
    """Ask a robot for its configuration; None if it does not report one."""
    try:
        return query(place.beside(PRIMARY), b"", configuration_in)
    except NoAnswerError:
        return None


def configuration_in(heard: bytes) -> Configuration | None:
    """Return the configuration in the data of a primary interface; None if it has not arrived yet."""
    try:
        for package in _split(heard, _PACKAGE, STATE):
            for part in _split(package, _PART, CONFIGURATION):
                return _read(part)
    except error:  # the rest has not arrived
        pass
    return None


def _split(data: bytes, head: Struct, wanted: int) -> list[bytes]:
    """Return the bodies of the packages of one type; each package starts with its length and type."""
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


def narrow_limits(
    description: RobotDescription, configuration: Configuration | None, speed_cap: float
) -> RobotDescription:
    """Return the robot file with limits no wider than the robot reports, and with no velocity above the cap [rad/s]."""
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
