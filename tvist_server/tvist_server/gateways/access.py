"""Rights of clients on the network, as rules for Zenoh's access control.

Zenoh silently denies everything that no rule allows. A rule for `tvist/ur5e/state` does not allow `tvist/**`. Flows
are the server's: `ingress` is what a client sends, `egress` what it receives. Declarations need permission on egress:
without it, a client knows of no subscriber or queryable and sends neither puts nor queries.
"""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

from tvist_protocol import keys

Role = Literal["operator", "viewer", "robot", "router"]
"""An operator sees and moves the robot; a viewer only sees it. On a router, a `robot` serves the robot or the
namespace that its certificate names, and a `router` is trusted fully."""

Rule = dict[str, Any]
STREAMS = ("state", "event", "telemetry", "truth", "io")
"""Topics that every role may read and only the robot may publish."""
MESSAGES = (
    "put", "delete", "declare_subscriber", "query", "declare_queryable", "reply", "liveliness_token",
    "declare_liveliness_subscriber", "liveliness_query",
)  # fmt: skip
"""All message types of Zenoh's access control."""
ROS2 = [f"{domain}/{rest}" for domain in range(233) for rest in ("**", "**/@adv/**")] + ["@ros2_lv/**"]
"""Keys of ROS 2 nodes with rmw_zenoh: topics and services of each ROS_DOMAIN_ID, with history, and tokens."""


def access_control(robots: Sequence[str], roles: Mapping[str, Role], namespace: str = "") -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a server with certificates. Without a role: no access."""
    robots = [_at(namespace, robot) for robot in robots]
    viewing, operating = _viewing(robots), _operating(robots)
    rules_of: dict[Role, list[Rule]] = {"viewer": viewing, "operator": [*viewing, *operating]}
    named = {role: [name for name, its in roles.items() if its == role] for role in rules_of}
    # Zenoh rejects an empty list of names, because it would apply to everyone.
    granted = [
        ({"id": role, "cert_common_names": named[role]}, own) for role, own in rules_of.items() if named[role]
    ]
    return _settings([*viewing, *operating], granted)


def open_access(robots: Sequence[str], namespace: str = "", *, ros2: bool = False) -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a server without certificates: every client is an operator.

    Only the server may answer commands and publish the robot's topics; another session could otherwise
    intercept a stop command or forge states. With `ros2`, clients may do everything on the keys of ROS 2.
    """
    robots = [_at(namespace, robot) for robot in robots]
    # Keys with wildcards are allowed because egress is restricted below, and only the server answers queries.
    asking = ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query", "query"]
    rules = [*_viewing(robots), *_operating(robots), _rule("ask for anything", "ingress", asking, ["**"])]
    if ros2:
        rules.append({**_rule("ROS 2", "ingress", MESSAGES, ROS2), "flows": ["ingress", "egress"]})
    return _settings(rules, [({"id": "anybody"}, rules)])


def router_access(roles: Mapping[str, Role]) -> dict[str, Any]:
    """Return Zenoh's `access_control` settings for a router with certificates.

    Operators and viewers have their rights on all robots. A `robot` may publish and answer as the robot of
    its certificate's name, and as all robots in the namespace of that name. A `router` may do everything.
    """
    everywhere = [keys.ANYWHERE]
    viewing, operating = _viewing(everywhere), _operating(everywhere)
    rules, granted = [*viewing, *operating], list[tuple[Rule, list[Rule]]]()
    for name, role in roles.items():
        own: list[Rule] = []
        if role == "robot":
            own = _serving([f"**/{keys.PREFIX}/{name}", f"**/{name}/{keys.PREFIX}/*"], name)
            own[0]["key_exprs"] = [f"{keys.ANYWHERE}/{leaf}" for leaf in STREAMS]
        elif role == "router":
            own = [{**_rule(f"all {name}", "ingress", MESSAGES, ["**"]), "flows": ["ingress", "egress"]}]
        rules += own
        allowed = own or [*viewing, *(operating if role == "operator" else [])]
        granted.append(({"id": name, "cert_common_names": [name]}, allowed))
    return _settings(rules, granted)


def with_robots_behind(
    access: Mapping[str, Any], robots: Sequence[str], namespace: str, protocol: str
) -> dict[str, Any]:
    """Return `access` extended for robots' processes, which connect over a `protocol` that only they use."""
    own = _serving([_at(namespace, robot) for robot in robots], "robots")
    more = _settings(own, [({"id": "robots", "link_protocols": [protocol]}, own)])
    return {**access, **{part: [*access[part], *more[part]] for part in ("rules", "subjects", "policies")}}


def _settings(rules: list[Rule], granted: Sequence[tuple[Rule, list[Rule]]]) -> dict[str, Any]:
    """Return settings with these rules; `granted` has each subject with its rules. All else is denied."""
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [subject for subject, _ in granted],
        "policies": [
            {"id": subject["id"], "rules": [rule["id"] for rule in own], "subjects": [subject["id"]]}
            for subject, own in granted
        ],
    }


def _serving(places: Sequence[str], name: str) -> list[Rule]:
    """Return a router's rules for robots that connect: those for clients, with ingress and egress swapped."""
    return [
        {
            **rule,
            "id": f"{rule['id']} of {name}",
            "flows": ["egress" if rule["flows"] == ["ingress"] else "ingress"],
        }
        for rule in (*_viewing(places), *_operating(places))
    ]


def _viewing(robots: Sequence[str]) -> list[dict[str, Any]]:
    streams = _keys(robots, *STREAMS)
    info, alive = _keys(robots, "info"), _keys(robots, "alive")
    return [
        # Subscribers may ask for the streams of all robots; the rule `streams` decides which ones they get.
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
    command, setpoint, clients = (_keys(robots, leaf) for leaf in ("command", "setpoint", "client/**"))
    return [
        _rule("command", "ingress", ["query"], command),
        _rule("answer command", "egress", ["declare_queryable", "reply"], command),
        _rule("set-points", "ingress", ["put"], setpoint),
        _rule("take set-points", "egress", ["declare_subscriber"], setpoint),
        # A lease ends when its client's token disappears: a viewer with that token could end an operator's.
        _rule("be there", "ingress", ["liveliness_token"], clients),
        _rule("look for clients", "egress", ["declare_liveliness_subscriber", "liveliness_query"], clients),
    ]


def _at(namespace: str, robot: str) -> str:
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
