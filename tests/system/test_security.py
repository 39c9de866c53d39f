"""Rights of clients of a secured robot, and limits on connections and sizes, with real certificates."""

import queue
import socket
import ssl

import msgpack
import pytest
import zenoh
from cryptography.x509.oid import ExtendedKeyUsageOID
from tests.conformance.served import Served
from tests.conformance.wire import PATIENCE, Q1, Wire
from tests.places import free_endpoint
from zenoh.handlers import Callback

from tvist_client import Robot
from tvist_client.blocking import Robot as BlockingRobot
from tvist_client.errors import DeniedError, NotConnectedError
from tvist_client.fleet import Fleet, RobotPlace
from tvist_client.transports import certificates
from tvist_client.transports.session import open_session
from tvist_protocol.codec import MAX_BYTES
from tvist_server.gateways import network
from tvist_server.gateways.network import GatewayError, Network
from tvist_view.pilot import Pilot

from .keyring import TLS, forge, free_tls_endpoint, leave_out, made, shown
from .shell import tvist

pytestmark = pytest.mark.realtime

NEAR, FAR = ([angle, *Q1[1:]] for angle in (0.1, 1.0))
STREAMS = ("state", "event", "telemetry", "truth")
REMOTE = zenoh.Locality.REMOTE


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    """Keys of a robot for two operators, a viewer, and a client whose rights were revoked."""
    people = ("--operator", "anna", "--operator", "otto", "--viewer", "wall", "--viewer", "gone")
    folder = made(tmp_path_factory.mktemp("keys") / "ring", *people)
    leave_out(folder, "gone")
    return folder


@pytest.fixture(scope="module")
def elsewhere(tmp_path_factory):
    """Keys of another robot for an operator of the same name."""
    return made(tmp_path_factory.mktemp("elsewhere") / "ring", "--operator", "anna")


@pytest.fixture(scope="module")
def served(ring):
    """A secured robot."""
    endpoint = free_tls_endpoint()
    with Served("--security", str(ring), "--truth", endpoint=endpoint) as served:
        yield served


@pytest.fixture
def session(served, ring):
    """Return a function that opens a session with a client's keys; each file can be replaced."""
    opened = []

    def open_as(name, mode="client", endpoint=served.endpoint, **files):
        wire = Wire(endpoint, settings={"mode": mode, **shown(ring / name, **files)})
        opened.append(wire)
        return wire

    yield open_as
    for wire in opened:
        wire.session.close()


@pytest.fixture
def operator(session):
    return session("anna").listen(*STREAMS)


@pytest.fixture(params=["client", "router"])
def viewer(session, request):
    """A viewer, also as a Zenoh router, which receives most and forwards messages of others."""
    return session("wall", mode=request.param)


def arrived(wire):
    """Wait until everything that this session has sent has arrived, by a query on the same way."""
    return wire.info()


def counted(operator, since):
    """Return the first telemetry after a tick."""
    return operator.wait("telemetry", lambda telemetry: telemetry["tick"] > since)


def everything(wire):
    """Return a queue of everything that reaches a session from outside on any key."""
    heard = queue.Queue()
    direct = Callback(heard.put, indirect=False)
    leaves = (*STREAMS, "setpoint", "command", "info", "alive", "client/*")
    for key in ("**", "tvist/**", "tvist/ur5e/*", "tvist/*/alive", *map(wire.key, leaves)):
        wire.session.declare_subscriber(key, direct, allowed_origin=REMOTE)
        wire.session.declare_queryable(key, direct, allowed_origin=REMOTE)
        wire.session.liveliness().declare_subscriber(key, direct, history=True)
    return heard


def keys_in(heard):
    """Return the keys of what such a queue contains."""
    found = set()
    while not heard.empty():
        item = heard.get()
        found.add(str(item.key_expr))
        if isinstance(item, zenoh.Query):
            item.drop()
    return found


class TestOperator:
    def test_moves_and_streams_and_receives_everything(self, operator):
        with operator.control("anna") as token:
            motion = operator.command("move_j", token=token, q=NEAR)["id"]
            operator.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
            assert operator.state()["target_q"] == pytest.approx(NEAR, abs=1e-6)
            assert operator.wait("truth")["type"] == "truth"
            operator.command("servo_start", token=token)
            operator.setpoint(token=token, sequence=0, q=NEAR)
            operator.next("state", lambda state: state["setpoint_sequence"] == 0)
            operator.command("servo_stop", token=token)

    def test_loses_control_when_its_liveliness_token_goes(self, session, operator):
        other = session("otto")
        other.announce("otto")
        assert other.command("take_control", client="otto")["type"] == "accepted"
        before = len(operator.received["event"])
        other.session.close()
        lost = operator.wait("event", lambda event: event["kind"] == "lease_lost", since=before)
        assert "otto" in lost["why"]


class TestViewer:
    def test_receives_all_topics(self, viewer, operator):
        viewer.listen(*STREAMS)
        assert viewer.info()["type"] == "info"
        with operator.control("anna") as token:
            motion = operator.command("move_j", token=token, q=[0.1, *Q1[1:]])["id"]
            viewer.wait("event", lambda event: event["kind"] == "motion_done" and event["id"] == motion)
        for topic in STREAMS:
            assert viewer.wait(topic)["tick"] > 0
        alive = list(viewer.session.liveliness().get("tvist/*/alive", timeout=PATIENCE))
        assert [str(reply.ok.key_expr) for reply in alive] == ["tvist/ur5e/alive"]

    def test_cannot_command_the_robot_even_with_the_token_of_the_lease(self, viewer, operator):
        everywhere = ("tvist/*/{}", "tvist/ur5e/*", "tvist/**", "**")
        with operator.control("anna") as token:
            operator.command("servo_start", token=token)
            operator.setpoint(token=token, sequence=0, q=Q1)
            began = operator.next("state", lambda state: state["setpoint_sequence"] == 0)
            before = counted(operator, arrived(operator)["tick"])
            for key in ("tvist/ur5e/command", *everywhere):
                for fields in ({"type": "move_j", "token": token, "q": FAR}, {"type": "stop"}):
                    assert viewer.ask(key.format("command"), msgpack.packb(fields)) == []
            for sequence, key in enumerate(("tvist/ur5e/setpoint", *everywhere), 1):
                spoilt = {"type": "setpoint", "token": token, "sequence": sequence, "q": [0.01, *Q1[1:]]}
                viewer.session.put(key.format("setpoint"), msgpack.packb(spoilt))
                viewer.session.delete(key.format("setpoint"))
            until = arrived(viewer)["tick"]
            after = counted(operator, until)
        states = [state for state in operator.received["state"] if state["tick"] >= began["tick"]]
        assert {state["setpoint_sequence"] for state in states} <= {0, None}
        assert all(state["target_q"] == Q1 for state in states)
        for name in ("commands", "setpoints_received"):
            assert after[name] == before[name]

    def test_cannot_end_the_lease_of_an_operator_by_a_liveliness_token_of_its_name(self, viewer, operator):
        # A lease ends with a liveliness token that existed when control was taken.
        forged = viewer.session.liveliness().declare_token("tvist/ur5e/client/anna")
        arrived(viewer)
        with operator.control("anna") as token:
            forged.undeclare()
            until = arrived(viewer)["tick"]
            operator.until(until + 10)
            assert operator.command("keep_alive", token=token) == {"type": "done"}

    def test_cannot_publish_or_answer_in_place_of_the_robot(self, viewer, operator, session):
        heard = everything(viewer)
        other = session("otto").listen("state", "event")
        for leaf in ("state", "event", "*"):
            forged = msgpack.packb({"type": "forged"})
            viewer.session.put(viewer.key(leaf), forged, encoding="application/msgpack")
        arrived(viewer)
        with operator.control("anna") as token:
            operator.command("servo_start", token=token)
            operator.setpoint(token=token, sequence=0, q=Q1)
            operator.next("state", lambda state: state["setpoint_sequence"] == 0)
        operator.next("telemetry")
        arrived(viewer)
        for wire in (operator, other):
            arrived(wire)
            messages = [message for topic in wire.received.values() for message in topic]
            assert "forged" not in {message["type"] for message in messages}
        assert keys_in(heard) == {f"tvist/ur5e/{topic}" for topic in (*STREAMS, "alive")}

    async def test_gets_the_reason_from_client_page_and_fleet(self, served, ring):
        said = []
        async with await Robot.connect(served.endpoint, security=ring / "wall") as robot:
            with pytest.raises(DeniedError, match="may only watch: use an operator's certificate"):
                async with robot.control("wall"):
                    pass
            pilot = Pilot(robot, "page", said.append)
            assert not await pilot.take(1)
            await pilot.stop()
        async with Fleet(served.endpoint, security=ring / "wall") as fleet:
            said += [report.said for report in await fleet.stop([RobotPlace("", "ur5e")])]
        assert len(said) == 3
        assert all("takes no commands from this client" in sentence for sentence in said)
        assert all("an operator's certificate" in sentence for sentence in said)


class TestStranger:
    @pytest.mark.parametrize("mode", ["client", "router"])
    def test_with_a_certificate_but_no_role_receives_nothing(self, session, operator, mode):
        stranger = session("gone", mode=mode)
        heard = everything(stranger)
        for key in ("tvist/ur5e/info", "tvist/ur5e/command", "tvist/ur5e/*", "tvist/**", "**"):
            asked = stranger.session.get(key, payload=b"", timeout=PATIENCE, allowed_destination=REMOTE)
            assert [*asked, *stranger.session.liveliness().get(key, timeout=PATIENCE)] == []
        assert list(stranger.session.liveliness().get("tvist/*/alive", timeout=PATIENCE)) == []
        with operator.control("anna") as token:
            operator.command("servo_start", token=token)
            operator.setpoint(token=token, sequence=0, q=Q1)
            operator.next("state", lambda state: state["setpoint_sequence"] == 0)
        operator.next("telemetry")
        assert keys_in(heard) == set()

    def test_gets_the_reason_from_the_client(self, served, ring):
        with pytest.raises(NotConnectedError, match="that the robot lists the name of this certificate"):
            BlockingRobot.connect(served.endpoint, security=ring / "gone")


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

    def test_with_an_expired_or_foreign_certificate_and_the_reason_is_reported(
        self, served, ring, elsewhere, tmp_path
    ):
        expired = forge(tmp_path / "anna", "anna", issuer=signed(ring), days=-1)
        (expired / "authority.pem").write_bytes((ring / "authority.pem").read_bytes())
        for folder, why in ((expired, "certificate expired"), (elsewhere / "anna", "not trusted")):
            tvist("check", served.endpoint, "--security", folder).assert_failed(1, why)


def test_session_is_closed_when_its_certificate_expires(served, ring, operator, tmp_path):
    brief = forge(tmp_path / "otto", "otto", issuer=signed(ring), days=3 / 86400)
    wire = Wire(served.endpoint, settings=shown(brief, authority=ring / "authority.pem"))
    wire.announce("otto")
    assert wire.command("take_control", client="otto")["type"] == "accepted"
    lost = operator.wait("event", lambda event: event["kind"] == "lease_lost")
    assert "otto" in lost["why"]
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


def a_hundred(endpoint, first=b""):
    """Open a hundred connections that send `first` and nothing else."""
    host, port = endpoint.partition("/")[2].split(":")
    connections = [socket.create_connection((host, int(port))) for _ in range(100)]
    for connection in connections:
        connection.sendall(first)
    return connections


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
        connections = a_hundred(endpoint, first)
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
