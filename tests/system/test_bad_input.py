"""Whatever a client streams is counted, and a server goes on.

Which commands are refused is tested without a network: protocol/test_bad_input.py, controller/test_refusals.py.
"""

import math

import msgpack
import pytest
from tests.conformance.wire import Q1, STOPPED, Wire


def pack(type, **fields):  # noqa: A002  the wire's name
    return msgpack.packb({"type": type, **fields})


@pytest.fixture(scope="module")
def wire(realtime):
    with Wire(realtime.endpoint) as wire, wire.control("guard", lease_s=600.0) as wire.token:
        yield wire.listen("state", "telemetry")
        realtime.assert_quiet()


def unless(field, value):
    """Q1 with one angle changed."""
    return [value if number == field else angle for number, angle in enumerate(Q1)]


def test_bad_set_points_of_a_stream_are_refused_and_counted_and_the_good_one_is_played(wire):
    """Nobody waits for an answer to a set-point."""
    good = {"token": wire.token, "sequence": 0, "q": Q1}
    near = unless(0, 0.01)
    spoilt = (
        {"token": "stale", "q": near}, {"token": 3, "q": near}, {"q": Q1[:5]}, {"q": unless(0, math.nan)},
        {"q": unless(0, 6.5)}, {"q": "home"}, {"q": near, "sequence": -1}, {"q": near, "speed": 1.0},
    )  # fmt: skip
    raw = (b"", b"\xc1", pack("setpoint", **good)[:-3], pack("stop"), pack("move_j", q=Q1))
    before, state = wire.next("telemetry"), wire.state()
    assert wire.command("servo_start", token=wire.token) == {"type": "done"}
    for changes in spoilt:
        wire.setpoint(**{**good, **changes})
    for payload in raw:
        wire.put(payload)
    for key in ("tvist/*/setpoint", "tvist/**"):  # access control drops these: they would reach others, too
        wire.session.put(key, pack("setpoint", **good))
    wire.setpoint(**good)
    wire.next("state", lambda state: state["setpoint_sequence"] == 0)
    assert wire.command("servo_stop", token=wire.token) == {"type": "done"}
    wire.next("state", lambda state: state["runtime_state"] == STOPPED)
    tick = wire.info()["tick"]  # a query goes the same way: what was put before has arrived
    after = wire.wait("telemetry", lambda telemetry: telemetry["tick"] > tick)
    assert wire.state()["target_q"] == state["target_q"]
    refused = len(spoilt) + len(raw)
    assert after["setpoints_received"] - before["setpoints_received"] == refused + 1
    assert after["setpoints_refused"] - before["setpoints_refused"] == refused
