"""What somebody without a key, or with one, can do to the others by sheer number and size."""

import socket
import ssl

import pytest
from tests.conformance.served import Served
from tests.conformance.wire import PATIENCE, Wire

from tvist_client.blocking import Robot
from tvist_protocol.codec import MAX_BYTES

from .keyring import free_tls_endpoint, made, shown

pytestmark = pytest.mark.realtime


@pytest.fixture(scope="module")
def ring(tmp_path_factory):
    return made(tmp_path_factory.mktemp("keys") / "ring", "--operator", "anna")


@pytest.fixture(scope="module")
def served(ring):
    """A robot that others could reach."""
    with Served("--security", str(ring), endpoint=free_tls_endpoint()) as served:
        yield served


@pytest.fixture
def operator(served, ring):
    with Wire(served.endpoint, settings=shown(ring / "anna")) as wire:
        yield wire.listen("state", "telemetry")


def idle_connections(endpoint):
    host, port = endpoint.partition("/")[2].split(":")
    return [socket.create_connection((host, int(port))) for _ in range(100)]


@pytest.mark.nightly
def test_a_hundred_idle_connections_lock_nobody_out(served, operator, ring):
    """By default Zenoh turns everybody away while a hundred connections shake no hands."""
    idle = idle_connections(served.endpoint)
    with Wire(served.endpoint, settings=shown(ring / "anna")) as wire:
        assert wire.info()["type"] == "info"
    for connection in idle:
        connection.close()
    # Zenoh now counts a hundred failed handshakes, and accepts nobody for 100 ms after each.
    tick = operator.state()["tick"]
    with Robot.connect(served.endpoint, security=ring / "anna") as robot:
        assert robot.info().tick > tick
    assert operator.state()["tick"] > tick  # and the connected stay so


@pytest.mark.nightly
def test_a_hundred_idle_connections_lock_nobody_out_where_there_is_no_security():
    with Served() as plain:
        idle = idle_connections(plain.endpoint)
        with Wire(plain.endpoint) as wire:
            assert wire.info()["type"] == "info"
        for connection in idle:
            connection.settimeout(PATIENCE)
            assert connection.recv(1) == b""
            connection.close()


@pytest.mark.nightly
def test_a_hundred_that_shake_hands_half_way_lock_nobody_out(served, ring):
    hello, nothing = ssl.MemoryBIO(), ssl.MemoryBIO()
    half = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).wrap_bio(nothing, hello, server_hostname="localhost")
    with pytest.raises(ssl.SSLWantReadError):
        half.do_handshake()
    first = hello.read()
    idle = idle_connections(served.endpoint)
    for connection in idle:
        connection.sendall(first)
    with Wire(served.endpoint, settings=shown(ring / "anna")) as wire:
        assert wire.info()["type"] == "info"
    for connection in idle:
        connection.close()


def test_a_message_above_the_cap_does_not_pass_and_the_next_one_does(served, operator):
    tick = operator.info()["tick"]
    began = operator.wait("telemetry", lambda telemetry: telemetry["tick"] > tick)
    too_large = bytes(4 * MAX_BYTES)
    operator.put(too_large)
    for ask in ({"payload": too_large}, {"payload": b"", "attachment": too_large}):
        replies = list(operator.session.get(operator.key("command"), timeout=0.5, **ask))
        # It came to nothing: the server never had it whole.
        assert [reply.err.payload.to_bytes() for reply in replies] == [b"Timeout"]
    assert operator.raw(bytes(MAX_BYTES + 1))["limit"] == MAX_BYTES
    until = operator.info()["tick"]
    after = operator.wait("telemetry", lambda telemetry: telemetry["tick"] > until)
    assert after["setpoints_received"] == began["setpoints_received"]
    served.assert_quiet()
