"""Rights of clients on the network, as rules for Zenoh's access control; computed from names alone.

Zenoh silently denies everything that no rule allows. A rule applies to a key only if the rule's key includes it, so
`tvist/**` is denied where only `tvist/ur5e/state` is allowed. Flows are named from the server's point of view:
`ingress` is what a client sends, `egress` is what reaches it. A client learns of a subscriber or queryable only
through its declaration, so declarations need permission on egress; without it, a client would not even send its put
or query.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from tvist_protocol import keys

Role = Literal["operator", "viewer"]
"""An operator moves the robot and sees what it does; a viewer only sees."""

ROBOT_PUTS = (keys.state, keys.event, keys.telemetry, keys.truth, keys.io)
"""Topics that everyone with a role may read and only the robot may publish."""


def access_control(robots: Sequence[str], roles: Mapping[str, Role]) -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a server with certificates.

    Args:
        robots: Names of the robots it serves.
        roles: Role by common name of a client's certificate; at least one.

    Returns:
        Rules and the clients they apply to. Everything else is denied: to names without a role, and to clients without
        a certificate.
    """
    viewing, operating = _viewing(robots), _operating(robots)
    rules_of: dict[Role, list[dict[str, Any]]] = {"viewer": viewing, "operator": [*viewing, *operating]}
    named = {role: [name for name, its in roles.items() if its == role] for role in rules_of}
    # Zenoh rejects an empty list of names, since that would apply to everyone.
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
    """Return Zenoh's `access_control` settings for a server without certificates: every client is an operator.

    Only the server may answer commands or publish the robot's topics. Otherwise another session could swallow a stop
    or make up states.

    Args:
        robots: Names of the robots it serves.
    """
    # Keys with wildcards are allowed too: egress is restricted below, and only the server answers queries.
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
        # When a client's token disappears, its lease ends. A viewer with a token of that name could end an
        # operator's.
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
