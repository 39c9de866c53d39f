"""Links that break, stand still, are slow, or carry what is no Zenoh."""

import random
import socket
from itertools import pairwise

import pytest
from tests.conformance.served import PATIENCE
from tests.conformance.wire import Q1, STOPPED, TICK, Wire

from .proxy import Proxy

pytestmark = pytest.mark.realtime

FAR = [2.0, *Q1[1:]]
DOWN = 750
"""Ticks for which a link is down: 1.5 s."""


def missing(wire):
    """How many states have not come; the others are in their order."""
    ticks = [state["tick"] for state in wire.received["state"]]
    assert all(later > earlier for earlier, later in pairwise(ticks))
    return ticks[-1] - ticks[0] + 1 - len(ticks)


@pytest.fixture
def proxy(realtime):
    with Proxy(realtime.endpoint) as proxy:
        yield proxy


def test_a_link_that_is_cut_ends_control_and_motion_at_once_and_the_client_is_back_by_itself(
    proxy, bystander, measured
):
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
        assert lost["why"] == "client 'far' is gone"  # its lease would have lasted
        bystander.until(cut + DOWN)
        proxy.restore()
        restored = bystander.until_later()["tick"]
        back = wire.wait("state", lambda state: state["tick"] >= restored)
        measured(
            "from the link's return to the first state [s of tick time]", (back["tick"] - restored) * TICK
        )
        refused = wire.command("keep_alive", token=token)
        assert (refused["type"], refused["code"]) == ("refused", "no_control")
        with wire.control("far") as token:
            assert wire.command("keep_alive", token=token) == {"type": "done"}
    assert proxy.connections == 2
    bystander.assert_undisturbed()


def test_a_link_that_stands_still_ends_the_stream_and_loses_states_but_no_event(proxy, bystander, measured):
    """A cable that is pulled and put back: both ends keep the connection."""
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
        for sequence in range(50, 100):  # on their way when it stood still
            wire.setpoint(token=token, sequence=sequence, q=FAR)
        stopped = bystander.event("stream_stopped")
        arrived = [state for state in bystander.received["state"] if state["tick"] <= stopped["tick"]]
        newest = max(state["setpoint_sequence"] or 0 for state in arrived)
        played = min(state["tick"] for state in arrived if state["setpoint_sequence"] == newest)
        assert 0 < stopped["tick"] - played <= 130
        at = bystander.next("state", lambda state: state["runtime_state"] == STOPPED)["target_q"]
        before = bystander.until(held + DOWN) and bystander.next("telemetry")
        proxy.flow()
        # The same session and the same lease; events that waited are told late, and set-points move nothing.
        assert wire.command("keep_alive", token=token) == {"type": "done"}
        wire.wait(
            "event", lambda event: event["kind"] == "stream_stopped" and event["tick"] == stopped["tick"]
        )
        refused = bystander.next(
            "telemetry", lambda told: told["setpoints_refused"] >= before["setpoints_refused"] + 50
        )
        assert bystander.until_later()["target_q"] == at
        wire.until(refused["tick"])
        measured("states missing", missing(wire))
        assert wire.command("release_control", token=token) == {"type": "done"}
    assert proxy.connections == 1
    bystander.assert_undisturbed()


def test_on_a_link_for_two_fifths_of_the_states_the_others_are_dropped_and_answers_go_first(
    proxy, bystander, measured
):
    with Wire(proxy.endpoint) as wire:
        wire.listen("state", "event")
        with wire.control("far", lease_s=60.0) as token:
            proxy.rate = 200_000  # bytes a second; the states need half a million
            began = bystander.until_later(1000)["tick"]
            motion = wire.command("move_j", token=token, q=[0.1, *Q1[1:]])["id"]
            assert wire.wait("event", lambda event: event["kind"] == "motion_done")["id"] == motion
            bystander.until(began + 1000)
            asked = bystander.until_later()["tick"]
            assert wire.command("keep_alive", token=token) == {"type": "done"}
            newest, came = bystander.received["state"][-1]["tick"], len(wire.received["state"])
            measured(
                "from a command to its answer [s of tick time]",
                (bystander.until_later()["tick"] - asked) * TICK,
            )
            proxy.rate = None
            wire.until(bystander.until_later()["tick"])
            under_way = sum(state["tick"] <= newest for state in wire.received["state"][came:])
            measured("states under way", under_way)
            assert under_way < 1000  # were nothing dropped, there would be 1200, and more from tick to tick
        measured("states dropped for this client", missing(wire))
    bystander.assert_undisturbed()


def test_garbage_on_the_port_is_ignored_and_those_who_send_it_are_dropped(realtime, bystander):
    rng = random.Random(0)
    host, port = realtime.endpoint.partition("/")[2].split(":")
    connections = [socket.create_connection((host, int(port))) for _ in range(50)]
    for number, connection in enumerate(connections):
        garbage = rng.randbytes(rng.randrange(1, 5000))
        if number % 2:  # Zenoh begins each batch by its length
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
