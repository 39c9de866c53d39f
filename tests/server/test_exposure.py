"""What others can reach is guarded, or asked for in so many words; the rules of access are data."""

import socket

import pytest

from tvist_protocol.codec import MAX_BYTES
from tvist_server.gateways.access import access_control, open_access, router_access
from tvist_server.gateways.exposure import guarded, is_local
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


def test_what_only_this_machine_reaches_needs_nothing():
    assert [endpoint for endpoint in LOCAL.split() if not is_local(endpoint)] == []


@pytest.mark.parametrize("endpoint", EXPOSED.split())
def test_whatever_else_is_refused_with_both_ways_out(endpoint):
    assert not is_local(endpoint)
    with pytest.raises(StartError) as refused:
        guarded(["tcp/127.0.0.1:7447", endpoint], ["ur5e"], security=None, insecure=False)
    for words in (f"listen is {endpoint}", "--security DIR", "--insecure"):
        assert words in str(refused.value)


@pytest.mark.parametrize("endpoint", ["", "7447", "http://localhost:80", "tcp/", "/127.0.0.1:7447"])
def test_what_is_no_endpoint_is_told_the_form_of_one(endpoint):
    assert not is_local(endpoint)
    with pytest.raises(StartError, match=r"must have the form tcp/ADDRESS:PORT, such as tcp/127.0.0.1:7447"):
        guarded([endpoint], ["ur5e"], security=None, insecure=True)


def test_a_name_with_one_address_that_leaves_the_machine_is_not_local(monkeypatch):
    def addresses(*of):
        return lambda *_, **__: [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (address, 0)) for address in of]

    for found, local in (
        (("127.0.0.1", "127.0.0.2"), True),
        (("127.0.0.1", "192.0.2.1"), False),
        ((), False),
    ):
        monkeypatch.setattr(socket, "getaddrinfo", addresses(*found))
        assert is_local("tcp/robot:7447") is local


def test_insecure_lets_everybody_in_and_still_limits_the_size_of_a_message():
    endpoints, settings = guarded(["tcp/0.0.0.0:7447"], ["ur5e"], security=None, insecure=True)
    assert endpoints == ["tcp/0.0.0.0:7447"]
    assert settings == {
        "transport/link/rx/max_message_size": 2 * MAX_BYTES,
        "access_control": open_access(["ur5e"]),
    }


@pytest.mark.parametrize("endpoint", ["tls/127.0.0.1:7447", "quic/127.0.0.1:7447"])
def test_an_encrypted_endpoint_needs_certificates(endpoint):
    with pytest.raises(StartError, match="--security DIR"):
        guarded([endpoint], ["ur5e"], security=None, insecure=True)


class TestAccess:
    ROLES = {"anna": "operator", "wall": "viewer", "otto": "operator"}  # noqa: RUF012  never changed

    def granted(self, role, flow, message, robots=("ur5e",)):
        """Keys that a role has for a kind of message."""
        made = access_control(robots, self.ROLES)
        (policy,) = (policy for policy in made["policies"] if policy["subjects"] == [role])
        rules = [rule for rule in made["rules"] if rule["id"] in policy["rules"]]
        assert {rule["permission"] for rule in rules} == {"allow"}
        return {
            key
            for rule in rules
            if rule["flows"] == [flow] and message in rule["messages"]
            for key in rule["key_exprs"]
        }

    def test_a_viewer_may_send_nothing_but_questions(self):
        sends = {message: self.granted("viewer", "ingress", message) for message in (*SENT, *ASKED)}
        assert {message for message, keys in sends.items() if keys} == {
            "query", "declare_subscriber", "declare_liveliness_subscriber", "liveliness_query",
        }  # fmt: skip
        assert sends["query"] == {"tvist/ur5e/info"}

    def test_an_operator_may_besides_command_stream_and_be_there_and_no_more(self):
        assert self.granted("operator", "ingress", "query") == {"tvist/ur5e/info", "tvist/ur5e/command"}
        assert self.granted("operator", "ingress", "put") == {"tvist/ur5e/setpoint"}
        assert self.granted("operator", "ingress", "liveliness_token") == {"tvist/ur5e/client/**"}
        for message in ("delete", "reply", "declare_queryable"):
            assert not self.granted("operator", "ingress", message)

    @pytest.mark.parametrize("role", ["viewer", "operator"])
    def test_both_hear_what_the_robot_tells_and_nothing_that_clients_send(self, role):
        streams = {f"tvist/ur5e/{topic}" for topic in ("state", "event", "telemetry", "truth", "io")}
        assert self.granted(role, "egress", "put") == streams
        assert self.granted(role, "egress", "query") == set()
        asked = {key.replace("tvist/ur5e", "**/tvist/*") for key in streams}
        assert self.granted(role, "ingress", "declare_subscriber") == asked

    def test_every_robot_served_has_its_keys_and_no_other_has(self):
        robots = ("left", "right")
        setpoints = {f"tvist/{robot}/setpoint" for robot in robots}
        assert self.granted("operator", "ingress", "put", robots) == setpoints
        keys = {key for rule in access_control(robots, self.ROLES)["rules"] for key in rule["key_exprs"]}
        many = {"state", "event", "telemetry", "truth", "io", "alive"}
        shared = {"tvist/*/alive", *(f"**/tvist/*/{leaf}" for leaf in many)}
        assert {key.split("/")[1] for key in keys - shared} == {"left", "right"}
        assert shared < keys

    def test_in_a_namespace_every_right_is_one_within_it(self):
        made = access_control(["ur5e"], self.ROLES, "hall-3")
        keys = {key for rule in made["rules"] for key in rule["key_exprs"] if "*/" not in key}
        assert keys
        assert all(key.startswith("hall-3/tvist/ur5e/") for key in keys)

    def test_a_routers_robot_speaks_for_its_name_and_its_namespace_alone(self):
        made = router_access({"hall-3": "robot", "anna": "operator"})
        (policy,) = (policy for policy in made["policies"] if policy["subjects"] == ["hall-3"])
        rules = [rule for rule in made["rules"] if rule["id"] in policy["rules"]]
        puts = [
            key
            for rule in rules
            if rule["flows"] == ["ingress"] and "put" in rule["messages"]
            for key in rule["key_exprs"]
        ]
        assert {key.rpartition("/")[0] for key in puts} == {"**/tvist/hall-3", "**/hall-3/tvist/*"}
        assert not any(rule["flows"] == ["ingress"] and "query" in rule["messages"] for rule in rules)

    @pytest.mark.parametrize(("name", "role"), ROLES.items())
    def test_a_role_without_names_is_left_out_since_zenoh_would_take_it_for_everybody(self, name, role):
        made = access_control(["ur5e"], {name: role})
        assert made["subjects"] == [{"id": role, "cert_common_names": [name]}]
        assert [policy["subjects"] for policy in made["policies"]] == [[role]]


SENT = ("put", "delete", "reply", "declare_queryable", "liveliness_token")
ASKED = ("query", "declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
