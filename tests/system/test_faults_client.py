"""Clients that die, freeze, or do not read: the arm stops where it must, and nobody else notices.

A client killed in mid-move or mid-stream is `test_lease`'s.
"""

import signal
from pathlib import Path

import pytest
from tests.conformance.served import Served, free_endpoint
from tests.conformance.wire import STOPPED, TICK

from .bystander import Bystander

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
while "asking" in sys.argv:
    session.get("tvist/ur5e/info", Callback(lambda reply: None, indirect=False), timeout=60.0)
    asleep.wait(0.001)
asleep.wait()
"""


def test_a_client_frozen_in_mid_stream_is_stopped_and_what_it_sends_when_it_thaws_moves_nothing(
    realtime, bystander, start
):
    frozen = start(CLIENT, realtime.endpoint, "stream", "announced")
    bystander.next("state", lambda state: (state["setpoint_sequence"] or 0) > 20)
    frozen.send_signal(signal.SIGSTOP)
    stopped = bystander.event("stream_stopped")
    rest = bystander.next("state", lambda state: state["runtime_state"] == STOPPED)
    before = bystander.next("telemetry", lambda telemetry: telemetry["tick"] > stopped["tick"])
    assert bystander.info()["control"] == "dying"  # its lease lasts on: it may come back
    frozen.send_signal(signal.SIGCONT)
    bystander.next(
        "telemetry", lambda telemetry: telemetry["setpoints_refused"] > before["setpoints_refused"] + 20
    )
    assert bystander.until_later()["target_q"] == rest["target_q"]
    bystander.assert_undisturbed()
    frozen.kill()
    bystander.event("lease_lost")


@pytest.mark.nightly
def test_a_client_frozen_in_mid_move_is_missed_when_its_link_is(realtime, bystander, start, measured):
    """Its move goes on to the end, as it would with the client waiting for it; control is free some 12 s later."""
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


def test_clients_that_never_read_hold_up_nobody_else(start):
    """Their sockets are full after some thirty states; many more go to everybody else."""
    narrow, readers = free_endpoint(), 4
    with Served("--listen", f"{narrow}#so_sndbuf=16384") as served, Bystander(served.endpoint) as bystander:
        for _ in range(readers):
            start("-c", NEVER_READING, narrow)
        while waiting(narrow) < readers * 20_000:  # bytes: the kernel doubles what was asked for
            bystander.until_later(50)
        with bystander.control("mover") as token:
            motion = bystander.command("move_j", token=token, q=[0.1, *bystander.state()["target_q"][1:]])[
                "id"
            ]
            done = bystander.event("motion_done")
            assert done["id"] == motion
        bystander.until_later(500)
        bystander.assert_undisturbed()
        served.assert_quiet()


def test_one_that_goes_on_asking_and_never_reads_is_cut_off(start, measured):
    """Its answers find no room. Everybody's wait behind them, for about a second, once; states do not."""
    narrow = free_endpoint()
    with Served("--listen", f"{narrow}#so_sndbuf=16384") as served, Bystander(served.endpoint) as bystander:
        start("-c", NEVER_READING, narrow, "asking")
        while not waiting(narrow):
            bystander.until_later(10)
        longest = 0
        while waiting(narrow):
            asked = bystander.received["state"][-1]["tick"]
            bystander.info()
            longest = max(longest, bystander.received["state"][-1]["tick"] - asked)
        measured("longest time to an answer meanwhile [s of tick time]", longest * TICK)
        bystander.assert_undisturbed()
        served.assert_quiet()


def waiting(endpoint):
    """Bytes that a server on this machine has sent and nobody has read."""
    port = int(endpoint.rpartition(":")[2])
    rows = [line.split() for line in Path("/proc/net/tcp").read_text(encoding="ascii").splitlines()[1:]]
    return sum(int(row[4].partition(":")[0], 16) for row in rows if int(row[1].partition(":")[2], 16) == port)
