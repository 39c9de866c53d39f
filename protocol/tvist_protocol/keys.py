"""Keys of a robot on the network, as strings.

Each chunk is checked where a key is built, so no key built here holds a wildcard. Keys that arrive may:
a server compares them with its own.
"""

import re

from tvist_protocol.errors import ProtocolError
from tvist_protocol.values import (
    CLIENT_NAME_PATTERN,
    NAMESPACE_PATTERN,
    PATTERN_MEANINGS,
    ROBOT_NAME_PATTERN,
    SESSION_PATTERN,
)

PREFIX = "tvist"
ANY_ALIVE = f"{PREFIX}/*/alive"
"""Selects the liveliness tokens of all robots: how a client finds them."""

ANYWHERE_ALIVE = f"**/{ANY_ALIVE}"
"""Selects the liveliness tokens of all robots of all namespaces, for a session without a namespace."""
ANYWHERE = f"**/{PREFIX}/*"
"""Selects all robots of all namespaces; a leaf such as `/state` follows."""

_NAMESPACE = re.compile(NAMESPACE_PATTERN)
_ROBOT = re.compile(ROBOT_NAME_PATTERN)
_CLIENT = re.compile(CLIENT_NAME_PATTERN)
_SESSION = re.compile(SESSION_PATTERN)


def check_robot_name(name: str) -> str:
    """Give back a robot's name if it may stand in a key.

    Raises:
        ProtocolError: The name is not `[a-z0-9][a-z0-9_-]{0,63}`; code `out_of_range`, where `robot`.
    """
    return _checked("robot", name, _ROBOT)


def check_namespace(name: str) -> str:
    """Give back a namespace if it may precede a key.

    Raises:
        ProtocolError: It is not 1 to 8 chunks like a robot's name, separated by `/`; code `out_of_range`, where
            `namespace`.
    """
    return _checked("namespace", name, _NAMESPACE)


def within(namespace: str, key: str) -> str:
    """Key as the network carries it: behind its namespace; an empty one changes nothing."""
    return f"{namespace}/{key}" if namespace else key


def place(key: str) -> tuple[str, str] | None:
    """Namespace (empty if there is none) and name of the robot that a key belongs to; None if it is no robot's."""
    above, prefix, rest = f"/{key}".rpartition(f"/{PREFIX}/")
    robot, slash, leaf = rest.partition("/")
    namespace = above.removeprefix("/")
    sound = prefix and slash and leaf and _ROBOT.match(robot)
    return (namespace, robot) if sound and (not namespace or _NAMESPACE.match(namespace)) else None


def check_client_name(name: str) -> str:
    """Give back a client's name if it may stand in a key.

    Raises:
        ProtocolError: The name is not 1 to 64 printable ASCII characters without `/ * ? # $`, the first not `@`;
            code `out_of_range`, where `client`.
    """
    return _checked("client", name, _CLIENT)


def state(robot: str) -> str:
    """Key the 500 Hz stream is put on."""
    return _key(robot, "state")


def truth(robot: str) -> str:
    """Key what no robot can know is put on."""
    return _key(robot, "truth")


def event(robot: str) -> str:
    """Key events are put on."""
    return _key(robot, "event")


def telemetry(robot: str) -> str:
    """Key the server's own figures are put on, once a second."""
    return _key(robot, "telemetry")


def io(robot: str) -> str:
    """Key inputs, outputs and registers are put on when they change."""
    return _key(robot, "io")


def command(robot: str) -> str:
    """Key of the queryable that takes commands."""
    return _key(robot, "command")


def setpoint(robot: str) -> str:
    """Key a client puts its set-points on."""
    return _key(robot, "setpoint")


def info(robot: str) -> str:
    """Key of the queryable that says what the robot is."""
    return _key(robot, "info")


def alive(robot: str) -> str:
    """Liveliness token of the server."""
    return _key(robot, "alive")


def client(robot: str, name: str, session: str = "") -> str:
    """Liveliness token of a client.

    Args:
        robot: The robot's name.
        name: The client's.
        session: Zenoh's id of its session, which tells it from another one of that name; empty leaves it out.

    Raises:
        ProtocolError: A name or the id is invalid; code `out_of_range`.
    """
    key = f"{_key(robot, 'client')}/{check_client_name(name)}"
    return f"{key}/{_checked('session', session, _SESSION)}" if session else key


def any_client(robot: str) -> str:
    """Selects the liveliness tokens of all clients of a robot."""
    return f"{_key(robot, 'client')}/**"


def client_name(robot: str, key: str) -> str | None:
    """Name in a client's liveliness token, None where the key is not one of this robot's."""
    found = _client(robot, key)
    return None if found is None else found[0]


def client_session(robot: str, key: str) -> str:
    """Session in a client's liveliness token; empty where the token has none."""
    found = _client(robot, key)
    return "" if found is None else found[1]


def _client(robot: str, key: str) -> tuple[str, str] | None:
    prefix = f"{_key(robot, 'client')}/"
    name, slash, session = key.removeprefix(prefix).partition("/")
    sound = _CLIENT.match(name) and bool(_SESSION.match(session)) == bool(slash)
    return (name, session) if key.startswith(prefix) and sound else None


def _key(robot: str, leaf: str) -> str:
    return f"{PREFIX}/{check_robot_name(robot)}/{leaf}"


def _checked(what: str, name: str, pattern: re.Pattern[str]) -> str:
    if not isinstance(name, str) or not pattern.match(name):
        why = f"{what} is {name!r:.80}: must be {PATTERN_MEANINGS[pattern.pattern]}"
        raise ProtocolError("out_of_range", what, why)
    return name
