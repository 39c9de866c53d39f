"""Endpoints that other machines can reach are protected, and access rules grant only what a role needs."""

import socket

import pytest

from tvist_protocol.codec import MAX_BYTES
from tvist_server.gateways.access import access_control, open_access, router_access
from tvist_server.gateways.security import is_local, server_security
from tvist_server.option_values import StartError

LOCAL = """
tcp/127.0.0.1:7447 tcp/127.1.2.3:7447 tcp/[::1]:7447 udp/127.0.0.1:7447 tls/127.0.0.1:7447 tcp/localhost:7447
unixsock-stream//tmp/robot.sock tcp/127.0.0.1:7447?rel=1 tcp/127.0.0.1:7447#so_sndbuf=65000
"""
EXPOSED = """
tcp/0.0.0.0:7447 tcp/[::]:7447 udp/0.0.0.0:7447 tcp/192.168.1.5:7447 tcp/[fe80::1%eth0]:7447 udp/224.0.0.224:7446
tcp/[::ffff:192.0.2.1]:7447 tcp/0:7447 tcp/:7447 tcp/nowhere.invalid:7447 serial//dev/ttyUSB0 vsock/-1:7447
TCP/127.0.0.1:7447 tcp/0.0.0.0:7447#iface=lo tcp/0.0.0.0:7447?from=127.0.0.1:1 unixpipe//tmp/robot
tcp/127.0.0.1.evil.invalid:7447
"""


def test_loopback_endpoints_are_local():
    assert [endpoint for endpoint in LOCAL.split() if not is_local(endpoint)] == []


@pytest.mark.parametrize("endpoint", EXPOSED.split())
def test_an_exposed_endpoint_is_refused_with_both_remedies(endpoint):
    assert not is_local(endpoint)
    with pytest.raises(StartError) as refused:
        server_security(["tcp/127.0.0.1:7447", endpoint], ["ur5e"], security=None, insecure=False)
    for words in (f"listen is {endpoint}", "--security DIR", "--insecure"):
        assert words in str(refused.value)


@pytest.mark.parametrize("endpoint", ["", "7447", "http://localhost:80", "tcp/", "/127.0.0.1:7447"])
def test_a_malformed_endpoint_is_refused_with_the_expected_form(endpoint):
    assert not is_local(endpoint)
    with pytest.raises(StartError, match=r"must have the form tcp/ADDRESS:PORT, such as tcp/127.0.0.1:7447"):
        server_security([endpoint], ["ur5e"], security=None, insecure=True)


def test_a_host_name_is_local_only_if_all_its_addresses_are_loopback(monkeypatch):
    def addresses(*of):
        return lambda *_, **__: [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, 0)) for address in of]

    loopback, mixed = ("127.0.0.1", "127.0.0.2"), ("127.0.0.1", "192.0.2.1")
    for found, local in ((loopback, True), (mixed, False), ((), False)):
        monkeypatch.setattr(socket, "getaddrinfo", addresses(*found))
        assert is_local("tcp/robot:7447") is local


def test_insecure_gives_open_access_with_a_limit_on_message_size():
    endpoints, settings = server_security(["tcp/0.0.0.0:7447"], ["ur5e"], security=None, insecure=True)
    assert endpoints == ["tcp/0.0.0.0:7447"]
    assert settings == {
        "transport/link/rx/max_message_size": 2 * MAX_BYTES,
        "access_control": open_access(["ur5e"]),
    }


@pytest.mark.parametrize("endpoint", ["tls/127.0.0.1:7447", "quic/127.0.0.1:7447"])
def test_an_encrypted_endpoint_needs_certificates(endpoint):
    with pytest.raises(StartError, match="--security DIR"):
        server_security([endpoint], ["ur5e"], security=None, insecure=True)


ROLES = {"anna": "operator", "wall": "viewer", "otto": "operator"}


def granted(subject, flow, message, made=None):
    """Return the keys that a role, or a robot, may use with a kind of message."""
    made = made or access_control(["ur5e"], ROLES)
    (policy,) = (policy for policy in made["policies"] if policy["subjects"] == [subject])
    rules = [rule for rule in made["rules"] if rule["id"] in policy["rules"]]
    assert {rule["permission"] for rule in rules} == {"allow"}
    return {
        key
        for rule in rules
        if rule["flows"] == [flow] and message in rule["messages"]
        for key in rule["key_exprs"]
    }


def test_an_operator_may_also_send_commands_set_points_and_its_liveliness():
    assert granted("operator", "ingress", "query") == {"tvist/ur5e/info", "tvist/ur5e/command"}
    assert granted("operator", "ingress", "put") == {"tvist/ur5e/setpoint"}
    assert granted("operator", "ingress", "liveliness_token") == {"tvist/ur5e/client/**"}
    for message in ("delete", "reply", "declare_queryable"):
        assert not granted("operator", "ingress", message)


@pytest.mark.parametrize("role", ["viewer", "operator"])
def test_both_roles_receive_the_robots_topics_and_no_commands(role):
    streams = {f"tvist/ur5e/{topic}" for topic in ("state", "event", "telemetry", "truth", "io")}
    assert granted(role, "egress", "put") == streams
    assert granted(role, "egress", "query") == set()
    asked = {key.replace("tvist/ur5e", "**/tvist/*") for key in streams}
    assert granted(role, "ingress", "declare_subscriber") == asked


def test_rules_cover_exactly_the_served_robots():
    made = access_control(("left", "right"), ROLES)
    setpoints = {"tvist/left/setpoint", "tvist/right/setpoint"}
    assert granted("operator", "ingress", "put", made) == setpoints
    keys = {key for rule in made["rules"] for key in rule["key_exprs"]}
    many = {"state", "event", "telemetry", "truth", "io", "alive"}
    shared = {"tvist/*/alive", *(f"**/tvist/*/{leaf}" for leaf in many)}
    assert {key.split("/")[1] for key in keys - shared} == {"left", "right"}
    assert shared < keys


def test_all_rules_are_inside_the_namespace():
    made = access_control(["ur5e"], ROLES, "hall-3")
    keys = {key for rule in made["rules"] for key in rule["key_exprs"] if "*/" not in key}
    assert keys
    assert all(key.startswith("hall-3/tvist/ur5e/") for key in keys)


def test_a_router_lets_a_robot_publish_only_under_its_name_or_namespace():
    made = router_access({"hall-3": "robot", "anna": "operator"})
    puts = granted("hall-3", "ingress", "put", made)
    assert {key.rpartition("/")[0] for key in puts} == {"**/tvist/hall-3", "**/hall-3/tvist/*"}
    assert not granted("hall-3", "ingress", "query", made)


@pytest.mark.parametrize(("name", "role"), ROLES.items())
def test_access_rules_leave_out_a_role_without_clients(name, role):
    made = access_control(["ur5e"], {name: role})
    assert made["subjects"] == [{"id": role, "cert_common_names": [name]}]
    assert [policy["subjects"] for policy in made["policies"]] == [[role]]
