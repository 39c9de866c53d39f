"""Links that break, stop, are slow, or carry garbage, and clients that are suspended or do not read."""

import random
import signal
import socket
from itertools import pairwise
from pathlib import Path

import pytest
from tests.conformance.served import PATIENCE, Served, free_endpoint
from tests.conformance.wire import Q1, STOPPED, TICK, Wire

from .relay import Relay

pytestmark = pytest.mark.realtime

FAR = [2.0, *Q1[1:]]
DOWN = 500  # ticks for which a link is down
CLIENT = Path(__file__).with_name("dying_client.py")
NEVER_READING = """
import json, sys, threading, zenoh
from zenoh.handlers import Callback
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1] + "#so_rcvbuf=8192"]))
session = zenoh.open(config)
asleep = threading.Event()
next(iter(session.get("tvist/ur5e/info")))
session.declare_subscriber("tvist/ur5e/state", Callback(lambda sample: asleep.wait(), indirect=False))
print("under way", flush=True)
while True:
    session.get("tvist/ur5e/info", Callback(lambda reply: None, indirect=False), timeout=60.0)
    asleep.wait(0.001)
"""


@pytest.fixture(scope="module")
def realtime():
    """A robot in real time, which has a small send buffer at a second endpoint, `narrow`."""
    narrow = free_endpoint()
    with Served("--listen", f"{narrow}#so_sndbuf=16384") as served:
        served.narrow = narrow
        yield served


def missing(wire):
    """Return how many states are missing; the others must be in order."""
    ticks = [state["tick"] for state in wire.received["state"]]
    assert all(later > earlier for earlier, later in pairwise(ticks))
    return ticks[-1] - ticks[0] + 1 - len(ticks)


@pytest.fixture
def proxy(realtime):
    with Relay(realtime.endpoint) as proxy:
        yield proxy


def test_client_loses_control_when_its_link_is_cut_and_reconnects(proxy, bystander, measured):
    with Wire(proxy.endpoint) as wire:
        wire.listen("state", "event")
        wire.announce("far")
        token = wire.command("take_control", client="far")["token"]
        motion = wire.command("move_j", token=token, q=FAR)["id"]
        cut = bystander.next("state", lambda state: state["target_qd"][0] > 0.2)["tick"]
        proxy.cut()
        lost = bystander.event("lease_lost")
        measured("from the cut to lease_lost [s of tick time]", round((lost["tick"] - cut) * TICK, 3))
        stopped = bystander.event("motion_stopped")
        assert (stopped["id"], stopped["tick"]) == (motion, lost["tick"])
        assert lost["why"] == "client 'far' is gone"  # its lease had not expired
        bystander.until(cut + DOWN)
        proxy.restore()
        restored = bystander.until_later()["tick"]
        back = wire.wait("state", lambda state: state["tick"] >= restored)
        measured("from its return to the first state [s of tick time]", (back["tick"] - restored) * TICK)
        assert wire.command("keep_alive", token=token)["code"] == "no_control"
        with wire.control("far") as token:
            assert wire.command("keep_alive", token=token) == {"type": "done"}
    assert proxy.connections == 2
    bystander.assert_undisturbed()


def test_stopped_link_ends_a_stream_and_loses_states_but_no_events(proxy, bystander, measured):
    """A cable is pulled and put back: both ends keep the connection."""
    with Wire(proxy.endpoint) as wire:
        wire.listen("state", "event")
        token = wire.command("take_control", client="far", lease_s=60.0)["token"]
        assert wire.command("servo_start", token=token, period=0.008) == {"type": "done"}
        tick = wire.state()["tick"]
        for sequence in range(50):
            tick = wire.until(tick + 4)["tick"]
            wire.setpoint(token=token, sequence=sequence, q=Q1)
        bystander.wait("state", lambda state: (state["setpoint_sequence"] or 0) >= 49)
        proxy.hold()
        held = bystander.state()["tick"]
        for sequence in range(50, 100):  # on their way while the link stands still
            wire.setpoint(token=token, sequence=sequence, q=FAR)
        stopped = bystander.event("stream_stopped")
        arrived = [state for state in bystander.received["state"] if state["tick"] <= stopped["tick"]]
        newest = max(state["setpoint_sequence"] or 0 for state in arrived)
        played = min(state["tick"] for state in arrived if state["setpoint_sequence"] == newest)
        assert 0 < stopped["tick"] - played <= 130
        at = bystander.next("state", lambda state: state["runtime_state"] == STOPPED)["target_q"]
        bystander.until(held + DOWN)
        least = bystander.next("telemetry")["setpoints_refused"] + 50
        proxy.flow()
        # Session and lease continue; waiting events arrive late, and set-points move nothing.
        assert wire.command("keep_alive", token=token) == {"type": "done"}
        wire.wait("event", lambda one: (one["kind"], one["tick"]) == ("stream_stopped", stopped["tick"]))
        refused = bystander.next("telemetry", lambda told: told["setpoints_refused"] >= least)
        assert bystander.until_later()["target_q"] == at
        wire.until(refused["tick"])
        measured("states missing", missing(wire))
        assert wire.command("release_control", token=token) == {"type": "done"}
    assert proxy.connections == 1
    bystander.assert_undisturbed()


def test_slow_link_drops_states_but_delivers_answers(proxy, bystander, measured):
    with Wire(proxy.endpoint) as wire:
        wire.listen("state", "event")
        with wire.control("far", lease_s=60.0) as token:
            proxy.rate = 200_000  # bytes per second; the states need 500 000
            bystander.until_later(400)
            motion = wire.command("move_j", token=token, q=[0.1, *Q1[1:]])["id"]
            assert wire.wait("event", lambda event: event["kind"] == "motion_done")["id"] == motion
            asked = bystander.until_later()["tick"]
            assert wire.command("keep_alive", token=token) == {"type": "done"}
            newest, came = bystander.received["state"][-1]["tick"], len(wire.received["state"])
            answered = bystander.until_later()["tick"]
            measured("from a command to its answer [s of tick time]", (answered - asked) * TICK)
            proxy.rate = None
            wire.until(bystander.until_later()["tick"])
            under_way = sum(state["tick"] <= newest for state in wire.received["state"][came:])
            measured("states under way", under_way)
            assert under_way < 400  # buffers hold about 250; a queue without end would have 460
        dropped = missing(wire)
        measured("states dropped for this client", dropped)
        assert dropped > 0
    bystander.assert_undisturbed()


def test_connections_that_send_garbage_are_closed(realtime, bystander):
    rng = random.Random(0)
    host, port = realtime.endpoint.partition("/")[2].split(":")
    connections = [socket.create_connection((host, int(port))) for _ in range(50)]
    for number, connection in enumerate(connections):
        garbage = rng.randbytes(rng.randrange(1, 5000))
        if number % 2:  # each of Zenoh's batches begins with its length
            garbage = len(garbage).to_bytes(2, "little") + garbage
        connection.sendall((b"GET / HTTP/1.1\r\n\r\n", garbage)[number % 5 > 0])
    with Wire(realtime.endpoint) as wire:
        assert wire.info()["type"] == "info"
    for connection in connections:
        connection.settimeout(PATIENCE)
        try:
            while connection.recv(4096):
                pass
        except ConnectionResetError:
            pass
        connection.close()
    bystander.assert_undisturbed()
    realtime.assert_quiet()


@pytest.mark.nightly
def test_suspended_client_loses_control_when_its_link_times_out(realtime, bystander, start, measured):
    """Its move continues to the end; control is free about 12 s later."""
    frozen = start(CLIENT, realtime.endpoint, "move", "announced")
    tick = bystander.next("state", lambda state: state["target_qd"][0] > 0.1)["tick"]
    frozen.send_signal(signal.SIGSTOP)
    done = bystander.event("motion_done")
    lost = bystander.event("lease_lost")
    assert "dying" in lost["why"]
    measured("from SIGSTOP to lease_lost [s of tick time]", (lost["tick"] - tick) * TICK)
    assert done["tick"] < lost["tick"]
    with bystander.control("heir"):
        pass
    bystander.assert_undisturbed()


def test_client_that_queries_without_reading_is_disconnected(realtime, bystander, start, measured):
    """Its answers delay those to others, once, for about a second, but no states."""
    start("-c", NEVER_READING, realtime.narrow)
    while not waiting(realtime.narrow):
        bystander.until_later(10)
    longest = 0
    while waiting(realtime.narrow):
        asked = bystander.received["state"][-1]["tick"]
        bystander.info()
        longest = max(longest, bystander.received["state"][-1]["tick"] - asked)
    measured("longest time to an answer meanwhile [s of tick time]", longest * TICK)
    bystander.assert_undisturbed()
    realtime.assert_quiet()


def waiting(endpoint):
    """Return how many bytes sent by a server of this machine have not been read."""
    port = int(endpoint.rpartition(":")[2])
    rows = [line.split() for line in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]]
    return sum(int(row[4].partition(":")[0], 16) for row in rows if int(row[1].partition(":")[2], 16) == port)
