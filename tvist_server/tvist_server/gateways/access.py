"""Rights of clients on the network, as rules for Zenoh's access control: data made of names, nothing else.

What no rule allows is denied, without a word to whoever tried. A rule holds for a key only where its own key
includes it, so `tvist/**` is denied where `tvist/ur5e/state` is allowed. Flows are the server's: `ingress` is
what a client sends, `egress` what reaches it. A client learns of a subscriber or queryable only by its
declaration, so these need leave to go out; without it a put or query would not even be sent.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from tvist_protocol import keys

Role = Literal["operator", "viewer"]
"""An operator moves the robot and sees what it does; a viewer sees."""

ROBOT_PUTS = (keys.state, keys.event, keys.telemetry, keys.truth, keys.io)
"""Topics everybody with a role may read, and nobody but the robot may put."""


def access_control(robots: Sequence[str], roles: Mapping[str, Role]) -> dict[str, Any]:
    """Zenoh's `access_control` for a server.

    Args:
        robots: Names of the robots it serves.
        roles: Role by common name of a client's certificate; at least one.

    Returns:
        Rules, who they are for, and that everything else is denied: to a name without a role, and to whoever
        shows no certificate.
    """
    viewing, operating = _viewing(robots), _operating(robots)
    rules_of: dict[Role, list[dict[str, Any]]] = {"viewer": viewing, "operator": [*viewing, *operating]}
    named = {role: [name for name, its in roles.items() if its == role] for role in rules_of}
    # Zenoh takes no empty list of names: one would stand for everybody.
    there = [role for role in rules_of if named[role]]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": [*viewing, *operating],
        "subjects": [{"id": role, "cert_common_names": named[role]} for role in there],
        "policies": [
            {"id": role, "rules": [rule["id"] for rule in rules_of[role]], "subjects": [role]}
            for role in there
        ],
    }


def open_access(robots: Sequence[str]) -> dict[str, Any]:
    """Zenoh's `access_control` for a server that knows no certificates: whoever reaches it is an operator.

    Nobody but the server may answer commands or put what the robot says: another session could otherwise swallow a
    stop, or make up states.

    Args:
        robots: Names of the robots it serves.
    """
    # By keys with wildcards, too: what may go out is said below, and a query reaches nobody but the server.
    asking = ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query", "query"]
    rules = [*_viewing(robots), *_operating(robots), _rule("ask for anything", "ingress", asking, ["**"])]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": "anybody"}],
        "policies": [{"id": "anybody", "rules": [rule["id"] for rule in rules], "subjects": ["anybody"]}],
    }


def _viewing(robots: Sequence[str]) -> list[dict[str, Any]]:
    streams = _keys(robots, *ROBOT_PUTS)
    info, alive = _keys(robots, keys.info), _keys(robots, keys.alive)
    return [
        _rule("read", "ingress", ["declare_subscriber"], streams),
        _rule("streams", "egress", ["put"], streams),
        _rule("ask info", "ingress", ["query"], info),
        _rule("answer info", "egress", ["declare_queryable", "reply"], info),
        _rule(
            "look for robots",
            "ingress",
            ["declare_liveliness_subscriber", "liveliness_query"],
            [*alive, keys.ANY_ALIVE],
        ),
        _rule("alive", "egress", ["liveliness_token"], alive),
    ]


def _operating(robots: Sequence[str]) -> list[dict[str, Any]]:
    command, setpoint = _keys(robots, keys.command), _keys(robots, keys.setpoint)
    clients = _keys(robots, keys.any_client)
    return [
        _rule("command", "ingress", ["query"], command),
        _rule("answer command", "egress", ["declare_queryable", "reply"], command),
        _rule("set-points", "ingress", ["put"], setpoint),
        _rule("take set-points", "egress", ["declare_subscriber"], setpoint),
        # The going of a client's token ends its lease: a viewer could end an operator's with one of that name.
        _rule("be there", "ingress", ["liveliness_token"], clients),
        _rule("look for clients", "egress", ["declare_liveliness_subscriber", "liveliness_query"], clients),
    ]


def _keys(robots: Sequence[str], *of: Callable[[str], str]) -> list[str]:
    return [key(robot) for robot in robots for key in of]


def _rule(
    name: str, flow: Literal["ingress", "egress"], messages: Sequence[str], key_exprs: Sequence[str]
) -> dict[str, Any]:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": list(messages),
        "key_exprs": list(key_exprs),
    }
