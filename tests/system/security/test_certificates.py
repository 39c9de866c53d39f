"""Certificates of a secured robot and its clients, and limits on connections and sizes."""

import socket
import ssl

import pytest
import zenoh
from cryptography.x509.oid import ExtendedKeyUsageOID
from tests.conformance.served import Served
from tests.conformance.wire import PATIENCE, Wire
from tests.places import free_endpoint
from tests.system.keyring import TLS, forge, free_tls_endpoint, made, shown
from tests.system.shell import tvist

from tvist_client.blocking import Robot as BlockingRobot
from tvist_client.errors import NotConnectedError
from tvist_client.transports import certificates
from tvist_client.transports.session import open_session
from tvist_protocol.codec import MAX_BYTES
from tvist_server.gateways import network
from tvist_server.gateways.network import GatewayError, Network

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """Keys of another robot for an operator of the same name."""
    return made(tmp_path_factory.mktemp("elsewhere") / "ring", "--operator", "anna")


def signed(ring, who=None):
    """Return the files of a signing certificate and key: the authority's, or a client's."""
    folder, name = (ring, "authority") if who is None else (ring / who, "client")
    return folder / f"{name}.pem", folder / f"{name}.key"


class TestNoSession:
    """The handshake fails."""

    def test_with_an_invalid_or_foreign_certificate(self, served, ring, elsewhere, tmp_path):
        def forged(name, **how):
            return shown(forge(tmp_path / name, "anna", **how), authority=ring / "authority.pem")

        robot, usage = ring / "robot.pem", ExtendedKeyUsageOID.SERVER_AUTH
        for settings in (
            {f"{TLS}root_ca_certificate": str(ring / "authority.pem")},  # none
            {"connect/endpoints": [served.endpoint.replace("tls/", "tcp/")]},
            shown(elsewhere / "anna", authority=ring / "authority.pem"),
            shown(ring / "anna", authority=elsewhere / "authority.pem"),
            shown(ring / "wall", certificate=ring / "anna" / "client.pem"),
            shown(ring, certificate=robot, key=ring / "robot.key"),
            forged("by a viewer", issuer=signed(ring, "wall")),
            forged("with its chain", issuer=signed(ring, "wall"), chain=True),
            forged("by itself", key=ring / "wall" / "client.key"),
            forged("expired", issuer=signed(ring), days=-1),
            forged("made for robots", issuer=signed(ring), usage=usage),
        ):
            with pytest.raises(zenoh.ZError), Wire(served.endpoint, settings=settings):
                pass
        with Wire(served.endpoint, settings=forged("sound", issuer=signed(ring))) as wire:
            assert wire.info()["type"] == "info"

    def test_with_a_robot_that_shows_a_certificate_of_a_client(self, ring):
        endpoint = free_tls_endpoint()
        config = zenoh.Config.from_json5(
            f"""{{mode: "router", listen: {{endpoints: ["{endpoint}"]}},
            scouting: {{delay: 0, multicast: {{enabled: false}}}},
            transport: {{link: {{tls: {{listen_certificate: "{ring / "otto" / "client.pem"}",
            listen_private_key: "{ring / "otto" / "client.key"}"}}}}}}}}"""
        )
        with zenoh.open(config), pytest.raises(NotConnectedError, match="not trusted"):
            BlockingRobot.connect(endpoint, security=ring / "anna")

    def test_without_a_certificate_and_the_reason_is_reported(self, served, monkeypatch):
        monkeypatch.setitem(network.CONNECT, "connect/timeout_ms", 200)
        plain = served.endpoint.replace("tls/", "tcp/")
        what = (
            f"demands certificates: give {served.endpoint}, and as security the folder that `tvist keys` made"
        )
        with pytest.raises(NotConnectedError, match=f"no connection to {plain}: the robot there {what}"):
            open_session(plain)
        with pytest.raises(GatewayError, match=f"the router there {what}"):
            Network([], connect=[plain])

    def test_with_an_unsecured_robot_and_the_reason_is_reported(self, ring, monkeypatch):
        accepts = network.CONFIG["transport/unicast/accept_timeout"]
        assert 1.5 * accepts < 1000 * certificates.PROBE_S  # the probe waits longer than the robot
        monkeypatch.setitem(network.CONFIG, "transport/unicast/accept_timeout", 500)
        endpoint = free_tls_endpoint()
        plain = endpoint.replace("tls/", "tcp/")
        without = Network([plain])
        try:
            said = f"the robot there has no certificates: give {plain} without"
            with pytest.raises(NotConnectedError, match=said):
                open_session(endpoint, ring / "anna")
        finally:
            without.close()

    def test_with_a_silent_server_and_no_reason_is_reported(self, ring, monkeypatch):
        monkeypatch.setattr(certificates, "PROBE_S", 0.1)
        with socket.create_server(("127.0.0.1", 0)) as silent:
            place = f"127.0.0.1:{silent.getsockname()[1]}"
            assert certificates.why_refused(f"tcp/{place}", None) is None
            assert certificates.why_refused(f"tls/{place}", ring / "anna") is None

    def test_with_an_expired_or_foreign_certificate_and_reports_why(self, served, ring, elsewhere, tmp_path):
        expired = forge(tmp_path / "anna", "anna", issuer=signed(ring), days=-1)
        (expired / "authority.pem").write_bytes((ring / "authority.pem").read_bytes())
        for folder, why in ((expired, "certificate expired"), (elsewhere / "anna", "not trusted")):
            tvist("check", served.endpoint, "--security", folder).assert_failed(1, why)


def test_session_is_closed_when_its_certificate_expires(served, ring, operator, tmp_path):
    brief = forge(tmp_path / "otto", "otto", issuer=signed(ring), days=3 / 86400)
    wire = Wire(served.endpoint, settings=shown(brief, authority=ring / "authority.pem"))
    wire.announce("otto")
    assert wire.command("take_control", client="otto")["type"] == "accepted"
    assert "otto" in operator.wait("event", lambda event: event["kind"] == "lease_lost")["why"]
    wire.session.close()


def test_too_large_message_is_dropped_and_the_next_one_arrives(served, operator):
    tick = operator.info()["tick"]
    began = operator.wait("telemetry", lambda telemetry: telemetry["tick"] > tick)
    too_large = bytes(4 * MAX_BYTES)
    operator.put(too_large)
    for ask in ({"payload": too_large}, {"payload": b"", "attachment": too_large}):
        replies = list(operator.session.get(operator.key("command"), timeout=0.5, **ask))
        # The server has never received all of it.
        assert [reply.err.payload.to_bytes() for reply in replies] == [b"Timeout"]
    assert operator.raw(bytes(MAX_BYTES + 1))["limit"] == MAX_BYTES
    until = operator.info()["tick"]
    after = operator.wait("telemetry", lambda telemetry: telemetry["tick"] > until)
    assert after["setpoints_received"] == began["setpoints_received"]
    served.assert_quiet()


def half_a_handshake():
    hello, nothing = ssl.MemoryBIO(), ssl.MemoryBIO()
    half = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).wrap_bio(nothing, hello, server_hostname="localhost")
    with pytest.raises(ssl.SSLWantReadError):
        half.do_handshake()
    return hello.read()


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("secure", "first"),
    [(True, b""), (True, half_a_handshake()), (False, b"")],
    ids=["idle", "half a handshake", "unsecured"],
)
def test_hundred_connections_do_not_lock_clients_out(secure, first, ring):
    """By default Zenoh accepts nobody while a hundred connections make no handshake."""
    endpoint, options, keys = free_endpoint(), (), None
    if secure:
        endpoint, options, keys = free_tls_endpoint(), ("--security", str(ring)), ring / "anna"
    with Served(*options, endpoint=endpoint), BlockingRobot.connect(endpoint, security=keys) as connected:
        host, port = endpoint.partition("/")[2].split(":")
        connections = [socket.create_connection((host, int(port))) for _ in range(100)]
        for connection in connections:
            connection.sendall(first)
        with BlockingRobot.connect(endpoint, security=keys) as robot:
            tick = robot.info().tick
        for connection in connections:
            connection.settimeout(PATIENCE)
            assert secure or connection.recv(1) == b""
            connection.close()
        # With security, Zenoh now counts a hundred failed handshakes, and accepts nobody for 100 ms after each.
        with BlockingRobot.connect(endpoint, security=keys) as robot:
            assert robot.info().tick > tick
        assert next(connected.states()).tick > tick
