"""Rights of clients on the network, as rules for Zenoh's access control; computed from names alone.

Zenoh silently denies everything that no rule allows. A rule applies to a key only if the rule's key includes it, so
`tvist/**` is denied where only `tvist/ur5e/state` is allowed. Flows are named from the server's point of view:
`ingress` is what a client sends, `egress` is what reaches it. A client learns of a subscriber or queryable only
through its declaration, so declarations need permission on egress; without it, a client would not even send its put
or query.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from tvist_protocol import keys

Role = Literal["operator", "viewer", "robot", "router"]
"""An operator moves the robot and sees what it does; a viewer only sees. A router knows two more roles: a robot, whose
name or namespace is that of its certificate, and another router, which it trusts."""

STREAMS = ("state", "event", "telemetry", "truth", "io")
"""Topics that everyone with a role may read and only the robot may publish."""
MESSAGES = (
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply", "liveliness_token",
    "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip
"""Everything that Zenoh's access control knows."""


def access_control(robots: Sequence[str], roles: Mapping[str, Role], namespace: str = "") -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a server with certificates, which has at least one role.

    The names are the common names of certificates. Names without a role, and clients without a certificate,
    are denied everything.
    """
    robots = [_at(namespace, robot) for robot in robots]
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


def open_access(robots: Sequence[str], namespace: str = "") -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a server without certificates: every client is an operator.

    Only the server may answer commands or publish the robot's topics. Otherwise another session could swallow a stop
    or make up states.
    """
    robots = [_at(namespace, robot) for robot in robots]
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


def router_access(roles: Mapping[str, Role]) -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a router with certificates.

    Operators and viewers have their rights on all robots. A robot may publish and answer as the robot of its
    certificate's name, and as all robots of the namespace of that name. Another router may do everything.
    """
    everywhere = [keys.ANYWHERE]
    viewing, operating = _viewing(everywhere), _operating(everywhere)
    rules, policies = [*viewing, *operating], list[dict[str, Any]]()
    subjects = [{"id": name, "cert_common_names": [name]} for name in roles]
    for name, role in roles.items():
        own: list[dict[str, Any]] = []
        if role == "robot":
            places = [f"**/{keys.PREFIX}/{name}", f"**/{name}/{keys.PREFIX}/*"]
            # What reaches a client of its robot leaves the robot, and the reverse.
            own = [_turned(rule, name) for rule in (*_viewing(places), *_operating(places))]
            own[0]["key_exprs"] = [f"{keys.ANYWHERE}/{leaf}" for leaf in STREAMS]
        elif role == "router":
            own = [{**_rule(f"all {name}", "ingress", MESSAGES, ["**"]), "flows": ["ingress", "egress"]}]
        rules += own
        allowed = own or [*viewing, *(operating if role == "operator" else [])]
        policies.append({"id": name, "rules": [rule["id"] for rule in allowed], "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def with_robots_behind(
    access: Mapping[str, Any], robots: Sequence[str], namespace: str, protocol: str
) -> dict[str, Any]:
    """Return `access_control` settings that also let the robots themselves connect, over a protocol of their own.

    Nobody but them can connect over that protocol.
    """
    places = [_at(namespace, robot) for robot in robots]
    # What reaches a client of a robot leaves the robot, and the reverse.
    own = [_turned(rule, "robots") for rule in (*_viewing(places), *_operating(places))]
    return {
        **access,
        "rules": [*access["rules"], *own],
        "subjects": [*access["subjects"], {"id": "robots", "link_protocols": [protocol]}],
        "policies": [
            *access["policies"],
            {"id": "robots", "rules": [rule["id"] for rule in own], "subjects": ["robots"]},
        ],
    }


def _turned(rule: dict[str, Any], name: str) -> dict[str, Any]:
    """Return a rule for the other end of a link."""
    flow = "egress" if rule["flows"] == ["ingress"] else "ingress"
    return {**rule, "id": f"{rule['id']} of {name}", "flows": [flow]}


def _viewing(robots: Sequence[str]) -> list[dict[str, Any]]:
    streams = _keys(robots, *STREAMS)
    info, alive = _keys(robots, "info"), _keys(robots, "alive")
    return [
        # Subscribers may ask for the streams of all robots; `streams` decides which ones they get.
        _rule("read", "ingress", ["declare_subscriber"], _keys([keys.ANYWHERE], *STREAMS)),
        _rule("streams", "egress", ["put"], streams),
        _rule("ask info", "ingress", ["query"], info),
        _rule("answer info", "egress", ["declare_queryable", "reply"], info),
        _rule(
            "look for robots",
            "ingress",
            ["declare_liveliness_subscriber", "liveliness_query"],
            [*alive, keys.ANY_ALIVE, keys.ANYWHERE_ALIVE],
        ),
        _rule("alive", "egress", ["liveliness_token"], alive),
    ]


def _operating(robots: Sequence[str]) -> list[dict[str, Any]]:
    command, setpoint, clients = (
        _keys(robots, "command"),
        _keys(robots, "setpoint"),
        _keys(robots, "client/**"),
    )
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


def _at(namespace: str, robot: str) -> str:
    """Place of a robot: what its keys begin with."""
    return keys.within(namespace, f"{keys.PREFIX}/{keys.check_robot_name(robot)}")


def _keys(places: Sequence[str], *leaves: str) -> list[str]:
    return [f"{place}/{leaf}" for place in places for leaf in leaves]


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
