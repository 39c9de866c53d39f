"""When the client in control is killed, the arm stops and control becomes free."""

from functools import partial
from pathlib import Path

import pytest
from tests.conformance.served import PATIENCE
from tests.conformance.wire import Q1, STOPPED

CLIENT = Path(__file__).with_name("dying_client.py")
FAR = [2.0, *Q1[1:]]


@pytest.fixture
def client(realtime, start):
    """Return a function that starts a client of the robot."""
    return partial(start, CLIENT, realtime.endpoint)


@pytest.fixture(autouse=True)
def at_home(live):
    """Bring the arm to Q1, with control free, before and after each test."""
    live.listen("state", "event")
    with live.control("home"):
        pass
    live.next("state", lambda state: state["target_q"] == Q1)
    yield
    with live.control("home"):
        pass
    live.next("state", lambda state: state["target_q"] == Q1)


def kill(process):
    process.kill()
    process.wait(PATIENCE)


def test_killed_client_with_a_liveliness_token_loses_control_at_once(client, live):
    process = client("move", "announced")
    live.next("state", lambda state: state["target_qd"][0] > 0.2)
    kill(process)
    lost = live.wait("event", lambda event: event["kind"] == "lease_lost")
    stopped = live.wait("event", lambda event: event["kind"] == "motion_stopped")
    rest = live.next("state", lambda state: state["runtime_state"] == STOPPED)
    assert stopped["tick"] == lost["tick"]
    assert lost["why"] == "client 'dying' is gone"  # its lease had not expired
    assert rest["target_q"][0] < FAR[0]
    assert live.info()["control"] is None
    with live.control("heir") as token:
        assert live.command("keep_alive", token=token) == {"type": "done"}


def test_killed_client_without_a_liveliness_token_keeps_control_until_its_lease_expires(client, live):
    process = client("move", "lease_s=1.0")
    live.next("state", lambda state: state["target_qd"][0] > 0.1)
    kill(process)
    refused = live.command("take_control", client="heir")
    assert (refused["type"], refused["code"]) == ("refused", "no_control")
    lost = live.wait("event", lambda event: event["kind"] == "lease_lost")
    stopped = live.wait("event", lambda event: event["kind"] == "motion_stopped")
    assert stopped["tick"] == lost["tick"]
    with live.control("heir"):
        pass
