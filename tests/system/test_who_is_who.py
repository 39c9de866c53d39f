"""Leases and identity without certificates: copies of a name and token, and forged messages."""

import subprocess
import sys
from pathlib import Path

import msgpack
import pytest
import zenoh
from tests.conformance.served import PATIENCE
from tests.conformance.wire import Q1, Wire
from tests.system.shell import Begun

pytestmark = pytest.mark.realtime

HOLDER = """
import sys
sys.path.insert(0, sys.argv[1])
from tests.conformance.wire import Q1, Wire
with Wire(sys.argv[2]) as wire:
    session = str(wire.session.info.zid())
    _alive = wire.session.liveliness().declare_token(f"tvist/ur5e/client/twin/{session}")
    token = wire.command("take_control", client="twin")["token"]
    wire.command("move_j", token=token, q=[2.5, *Q1[1:]], velocity=0.4)
    print(session, token, flush=True)
    sys.stdin.read()
"""
ROOT = Path(__file__).parents[2]
AT_ONCE = 250  # ticks that a busy machine may need; a lease lasts for 15 000


@pytest.fixture
def holder(realtime, live):
    """A process in control that moves the arm, its session and its token."""
    live.listen("state", "event", "telemetry")
    command = [sys.executable, "-c", HOLDER, str(ROOT), realtime.endpoint]
    with Begun(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        session, token = process.stdout.readline().split()
        live.next("state", lambda state: state["target_qd"][0] > 0.2)
        yield process, session, token
    with live.control("home"):
        pass
    live.next("state", lambda state: state["target_q"] == Q1)


@pytest.fixture
def copy(realtime):
    with Wire(realtime.endpoint) as wire:
        yield wire


def lost(live, since):
    event = live.wait("event", lambda event: event["kind"] == "lease_lost" and event["tick"] > since)
    return event["tick"] - since


@pytest.mark.parametrize("copied", ["its own session", "the holder's session"])
def test_copied_name_and_token_do_not_keep_a_lease_alive(holder, copy, live, measured, copied):
    process, session, token = holder
    of = {"its own session": f"/{copy.session.info.zid()}", "the holder's session": f"/{session}"}
    _alive = copy.session.liveliness().declare_token(f"tvist/ur5e/client/twin{of[copied]}")
    assert copy.command("keep_alive", token=token) == {"type": "done"}
    if copied != "the holder's session":
        assert copy.command("take_control", client="twin")["code"] == "no_control"
    since = live.state()["tick"]
    process.kill()
    ticks = lost(live, since)
    measured("from the kill to lease_lost [ticks, seen from outside]", ticks)
    assert ticks <= AT_ONCE
    assert copy.command("keep_alive", token=token)["code"] == "no_control"


def test_copy_that_disconnects_does_not_end_the_lease(holder, realtime, live):
    process, session, token = holder
    with Wire(realtime.endpoint) as copy:
        declare = copy.session.liveliness().declare_token
        sessions = (session, copy.session.info.zid())
        _tokens = [declare(f"tvist/ur5e/client/twin/{of}") for of in sessions]
        copy.info()
    live.until(live.state()["tick"] + AT_ONCE)
    assert not [event for event in live.received["event"] if event["kind"] == "lease_lost"]
    assert live.command("keep_alive", token=token) == {"type": "done"}
    since = live.state()["tick"]
    process.kill()
    assert lost(live, since) <= AT_ONCE


STREAMS = ("state", "event", "truth", "telemetry", "io")
FORGED = msgpack.packb({"type": "event", "tick": 10**9, "kind": "warning", "why": "forged"})


def test_only_the_server_answers_and_publishes(realtime, live):
    """Another session of the machine can neither intercept commands nor publish, by any key."""
    heard, told = [], []
    with Wire(realtime.endpoint) as intruder, Wire(realtime.endpoint) as victim:
        session = intruder.session
        keys = [f"tvist/ur5e/{leaf}" for leaf in (*STREAMS, "command", "info", "setpoint", "alive")]
        everywhere = [*keys, "tvist/*/command", "tvist/**", "**"]
        victim.session.declare_subscriber("tvist/**", lambda sample: told.append(sample.payload.to_bytes()))
        for key in everywhere:
            session.declare_queryable(key, lambda query: heard.append(str(query.key_expr)), complete=True)
            session.declare_subscriber(key, lambda _: None)
        _tokens = [session.liveliness().declare_token(f"tvist/{name}/alive") for name in ("ur5e", "another")]
        for key in everywhere:
            session.put(key, FORGED)
            session.delete(key)
        assert victim.command("stop") == {"type": "done"}
        answers = list(victim.session.get("tvist/ur5e/command", payload=msgpack.packb({"type": "stop"}),
                                          target=zenoh.QueryTarget.ALL, timeout=PATIENCE))  # fmt: skip
        assert [msgpack.unpackb(answer.ok.payload.to_bytes()) for answer in answers] == [{"type": "done"}]
        assert victim.info()["name"] == "ur5e"
        live.listen("state", "telemetry")
        live.next("telemetry")
        robots = [str(reply.ok.key_expr) for reply in victim.session.liveliness().get("tvist/*/alive")]
    assert robots == ["tvist/ur5e/alive"]
    assert heard == []
    assert told
    assert not [payload for payload in told if b"forged" in payload]
