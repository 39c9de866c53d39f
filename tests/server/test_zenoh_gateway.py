"""The Zenoh gateway between a recording intake and plain Zenoh clients."""

import json
import queue
import signal
import subprocess
import sys
import threading
import time

import msgpack
import psutil
import pytest
import zenoh
from tests import forked
from tests.conformance.session import plain_session as connect
from tests.places import free_endpoint
from tests.system.waiting import eventually

from tvist_protocol.codec import MAX_BYTES
from tvist_server.gateways.base import GatewayError
from tvist_server.gateways.network import Network

WAIT = 60.0


class RecordingIntake:
    """Notes what arrives, in order, and answers from another thread unless `hold` is set."""

    def __init__(self):
        self.notes, self.held, self.hold = queue.Queue(), [], False

    def request(self, data, reply):
        self.notes.put(("request", data))
        self._answer(reply, b"answer to " + data)

    def setpoint(self, data):
        self.notes.put(("setpoint", data))

    def info(self, reply):
        self.notes.put(("info", b""))
        self._answer(reply, b"info")

    def client_seen(self, name, session=""):
        self.notes.put(("seen", name, session))

    def client_gone(self, name, session=""):
        self.notes.put(("gone", name, session))

    def session_gone(self, session):
        self.notes.put(("ended", session))

    def next(self, *, ended=False):
        """Return the next note; ends of sessions only if `ended`."""
        while True:
            note = self.notes.get(timeout=WAIT)
            if ended or note[0] != "ended":
                return note

    def _answer(self, reply, data):
        if self.hold:
            self.held.append(lambda: reply(lambda: data))
        else:
            threading.Thread(target=reply, args=(lambda: data,)).start()


def replies(session, key, payload=None):
    return list(session.get(key, payload=payload, timeout=WAIT))


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def intake():
    return RecordingIntake()


@pytest.fixture
def network(endpoint):
    network = Network([endpoint])
    yield network
    network.close()


@pytest.fixture
def gateway(network, intake):
    return network.gateway("ur5e", intake, lockstep=False, truth=False)


@pytest.fixture
def session(endpoint, gateway):
    with connect(endpoint) as session:
        yield session


COMMAND = "tvist/ur5e/command"
REFUSED = [
    (COMMAND, None, {}, "payload"),
    (COMMAND, bytes(5_000_000), {"limit": MAX_BYTES}, "5000000 bytes"),
    *((key, b"a command", {"where": "key"}, key) for key in (
        "tvist/*/command", "tvist/ur5e/$*mand", "tvist/**/command", "tvist/*/info"
    )),
]  # fmt: skip


@pytest.mark.parametrize(("key", "payload", "fields", "said"), REFUSED, ids=lambda _: "")
def test_an_invalid_query_is_refused_by_the_gateway(gateway, intake, session, key, payload, fields, said):
    (reply,) = replies(session, key, payload)
    assert reply.ok is not None
    assert str(reply.ok.encoding) == "application/msgpack"
    message = msgpack.unpackb(reply.ok.payload.to_bytes())
    assert message | {"type": "refused", "code": "malformed"} | fields == message
    assert said in message["why"]
    assert intake.notes.empty()


def test_set_points_on_wildcards_or_too_large_are_counted_and_dropped(gateway, intake, session):
    for key, payload in (
        ("tvist/*/setpoint", b"wild"),
        ("tvist/**", b"wilder"),
        ("tvist/ur5e/setpoint", bytes(MAX_BYTES + 1)),
        ("tvist/ur5e/setpoint", b"good"),
    ):
        session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK)
    assert intake.next() == ("setpoint", b"good")
    assert gateway.setpoints_refused == 3


def test_a_client_is_seen_before_its_next_command_and_when_it_leaves(gateway, intake, endpoint):
    for number in range(5):
        client = connect(endpoint)
        _token = client.liveliness().declare_token(f"tvist/ur5e/client/me {number}")
        replies(client, "tvist/ur5e/command", b"take")
        assert intake.next() == ("seen", f"me {number}", "")
        assert intake.next() == ("request", b"take")
        client.close()
        assert intake.next() == ("gone", f"me {number}", "")


def test_the_end_of_a_session_is_reported_while_another_holds_its_token(gateway, intake, endpoint):
    with connect(endpoint) as copy:
        client = connect(endpoint)
        session = str(client.info.zid())
        key = f"tvist/ur5e/client/me/{session}"
        _tokens = [each.liveliness().declare_token(key) for each in (client, copy)]
        for each in (client, copy):
            replies(each, "tvist/ur5e/info")  # the tokens have passed
        assert {intake.next() for _ in range(3)} == {("seen", "me", session), ("info", b"")}
        client.close()
        assert intake.next(ended=True) == ("ended", session)
    assert intake.next() == ("gone", "me", session)


def taken(gateway, topic, *, taken):
    """Wait until a gateway wants a topic, or no longer wants it."""
    end = time.monotonic() + WAIT
    while (topic in gateway.wanted_topics) != taken:
        assert time.monotonic() < end
        time.sleep(0.002)


@pytest.mark.parametrize("key", ["tvist/ur5e/state", "**"])
def test_in_real_time_states_are_wanted_only_with_subscribers(gateway, session, endpoint, key):
    assert gateway.wanted_topics == {"event", "telemetry", "io"}
    with connect(endpoint) as other:
        others = other.declare_subscriber(key, queue.Queue().put)
        taken(gateway, "state", taken=True)
        subscriber = session.declare_subscriber(key, queue.Queue().put)
        replies(session, "tvist/ur5e/info")
        others.undeclare()
        replies(other, "tvist/ur5e/info")
        assert "state" in gateway.wanted_topics
        subscriber.undeclare()
        taken(gateway, "state", taken=False)
        other.declare_subscriber(key, queue.Queue().put)
        taken(gateway, "state", taken=True)
    taken(gateway, "state", taken=False)  # it has left without a word


def test_subscribers_from_before_the_start_are_noticed(network, endpoint, intake):
    network.expect(["ur5e"], intake)
    with connect(endpoint) as early:
        early.declare_subscriber("tvist/ur5e/truth", queue.Queue().put)
        replies(early, "tvist/ur5e/info")
        told = []
        gateway = network.gateway("ur5e", intake, lockstep=False, truth=False, wanted=told.append)
        taken(gateway, "truth", taken=True)
        assert told == [True]
        assert "state" not in gateway.wanted_topics


def test_close_ends_pending_queries_and_ignores_late_replies(network, gateway, intake, session):
    intake.hold = True
    pending = session.get("tvist/ur5e/command", payload=b"wait", timeout=WAIT)
    assert intake.next() == ("request", b"wait")
    network.close()
    assert list(pending) == []
    intake.held[0]()
    gateway.publish("state", None, b"nobody hears it")
    network.close()


@pytest.mark.parametrize(
    ("endpoint", "sentence"),
    [
        ("nonsense", "an endpoint has the form tcp/<address>:<port>"),
        ("tcp/127.0.0.1:99999", "a port is a number up to 65535"),
        ("tcp/nowhere.invalid:7447", "there is no host of this name"),
        ("tcp/192.0.2.1:7447", "does not have this address"),
    ],
)
def test_an_endpoint_that_cannot_listen_is_refused_with_the_reason(endpoint, sentence):
    with pytest.raises(GatewayError) as raised:
        Network([endpoint])
    assert endpoint in str(raised.value)
    assert sentence in str(raised.value)


READER = """
import json, sys, zenoh
from tests.conformance.session import plain_session
counts = {"state": 0, "event": 0}
def on(sample):
    counts[str(sample.key_expr).split("/")[2]] += 1
    if sample.payload.to_bytes() == b"last":
        print(json.dumps(counts), flush=True)
with plain_session(sys.argv[1]) as session:
    direct = zenoh.handlers.Callback(on, indirect=False)
    session.declare_subscriber("tvist/ur5e/state", direct)
    session.declare_subscriber("tvist/ur5e/event", direct)
    list(session.get("tvist/ur5e/info"))  # the subscriptions have passed
    print("ready", flush=True)
    sys.stdin.read()
"""


def test_a_stopped_reader_loses_states_but_no_events(gateway, endpoint):
    command = [sys.executable, "-c", READER, endpoint]
    with forked.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as reader:
        assert reader.stdout.readline() == "ready\n"
        reader.send_signal(signal.SIGSTOP)
        eventually(lambda: psutil.Process(reader.pid).status() == psutil.STATUS_STOPPED)
        for number in range(2000):
            gateway.publish("state", None, bytes(9000))
            if number % 10 == 0:
                gateway.publish("event", None, bytes(100))
        reader.send_signal(signal.SIGCONT)
        gateway.publish("event", None, b"last")
        counts = json.loads(reader.stdout.readline())
        assert counts["event"] == 201  # had a put waited for it, Zenoh would have cut it off in the end
        assert counts["state"] < 2000
        reader.stdin.close()
