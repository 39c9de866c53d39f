"""Keys of a robot on the network; built keys contain no wildcard, but received ones may."""

import re
from typing import Literal

from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import (
    CLIENT_NAME_PATTERN,
    NAMESPACE_PATTERN,
    PATTERN_MEANINGS,
    ROBOT_NAME_PATTERN,
    SESSION_PATTERN,
)

PREFIX = "tvist"
Leaf = Literal["state", "truth", "event", "telemetry", "io", "command", "setpoint", "info", "alive", "client"]
"""Last part of a robot's keys; after `client`, the client's name follows."""

ANY_ALIVE = f"{PREFIX}/*/alive"
"""Selects the liveliness tokens of all robots, by which clients find robots."""

ANYWHERE_ALIVE = f"**/{ANY_ALIVE}"
"""Selects the liveliness tokens of all robots of all namespaces, for a session without a namespace."""
ANYWHERE = f"**/{PREFIX}/*"  # selects all robots of all namespaces; a leaf such as `/state` follows

_NAMESPACE = re.compile(NAMESPACE_PATTERN)
_ROBOT = re.compile(ROBOT_NAME_PATTERN)
_CLIENT = re.compile(CLIENT_NAME_PATTERN)
_SESSION = re.compile(SESSION_PATTERN)


def check_robot_name(name: str) -> str:
    """Return a robot's name; ProtocolError (`out_of_range`, `robot`) if it is not `[a-z0-9][a-z0-9_-]{0,63}`."""
    return _checked("robot", name, _ROBOT)


def check_namespace(name: str) -> str:
    """Return a namespace; ProtocolError if it is not 1 to 8 chunks like a robot's name, separated by `/`."""
    return _checked("namespace", name, _NAMESPACE)


def within(namespace: str, key: str) -> str:
    """Return a key preceded by a namespace, as the network carries it; if the namespace is empty, the key itself."""
    return f"{namespace}/{key}" if namespace else key


def place(key: str) -> tuple[str, str] | None:
    """Return namespace (or "") and name of the robot that a key belongs to; None if the key is no robot's."""
    above, prefix, rest = f"/{key}".rpartition(f"/{PREFIX}/")
    robot, slash, leaf = rest.partition("/")
    namespace = above.removeprefix("/")
    sound = prefix and slash and leaf and _ROBOT.match(robot)
    return (namespace, robot) if sound and (not namespace or _NAMESPACE.match(namespace)) else None


def check_client_name(name: str) -> str:
    """Return a client's name; ProtocolError if it does not match `CLIENT_NAME_PATTERN`."""
    return _checked("client", name, _CLIENT)


def key(robot: str, leaf: Leaf) -> str:
    """Return a key of a robot; `channels.CHANNELS` describes them."""
    return f"{PREFIX}/{check_robot_name(robot)}/{leaf}"


def client(robot: str, name: str, session: str = "") -> str:
    """Return the key of a client's liveliness token; `session`, Zenoh's id, distinguishes clients of the same name."""
    own = f"{key(robot, 'client')}/{check_client_name(name)}"
    return f"{own}/{_checked('session', session, _SESSION)}" if session else own


def any_client(robot: str) -> str:
    """Return the selector of the liveliness tokens of all clients of a robot."""
    return f"{key(robot, 'client')}/**"


def client_of(robot: str, own: str) -> tuple[str, str] | None:
    """Return name and session (or "") in the key of a client's token at this robot; None for other keys."""
    prefix = f"{key(robot, 'client')}/"
    name, slash, session = own.removeprefix(prefix).partition("/")
    sound = _CLIENT.match(name) and bool(_SESSION.match(session)) == bool(slash)
    return (name, session) if own.startswith(prefix) and sound else None


def _checked(what: str, name: str, pattern: re.Pattern[str]) -> str:
    if not isinstance(name, str) or not pattern.match(name):
        why = f"{what} is {name!r:.80}: must be {PATTERN_MEANINGS[pattern.pattern]}"
        raise ProtocolError("out_of_range", what, why)
    return name
