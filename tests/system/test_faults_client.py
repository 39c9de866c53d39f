"""Clients that die, are suspended or do not read: the arm stops if it must, and others are not disturbed.

Clients that are killed in a motion: test_who_is_who.py.
"""

import signal
from pathlib import Path

import pytest
from tests.conformance.served import SLOWER, Served, free_endpoint
from tests.conformance.wire import TICK

pytestmark = pytest.mark.realtime

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
    """A robot which has a small send buffer at a second endpoint, `narrow`."""
    narrow = free_endpoint()
    with Served("--listen", f"{narrow}#so_sndbuf=16384", *SLOWER) as served:
        served.narrow = narrow
        yield served


@pytest.mark.nightly
def test_suspended_client_loses_control_when_its_link_times_out(realtime, bystander, start, measured):
    """Its move continues to the end; control is free about 12 s later."""
    frozen = start(CLIENT, realtime.endpoint, "move", "announced")
    tick = bystander.next("state", lambda state: state["target_qd"][0] > 0.1)["tick"]
    frozen.send_signal(signal.SIGSTOP)
    done = bystander.event("motion_done")
    lost = bystander.event("lease_lost")
    assert "dying" in lost["why"]
    measured("from SIGSTOP to lease_lost [s of slower time]", (lost["tick"] - tick) * TICK)
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
    measured("longest time to an answer meanwhile [s of slower time]", longest * TICK)
    bystander.assert_undisturbed()
    realtime.assert_quiet()


def waiting(endpoint):
    """Return how many bytes sent by a server of this machine have not been read."""
    port = int(endpoint.rpartition(":")[2])
    rows = [line.split() for line in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]]
    return sum(int(row[4].partition(":")[0], 16) for row in rows if int(row[1].partition(":")[2], 16) == port)
