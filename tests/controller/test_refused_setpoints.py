"""Nobody answers a set-point: that one was refused stands in the event of the stream that fell silent over it."""

import math

import msgspec
import pytest

from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import admit_setpoint
from tvist_controller.host import Host
from tvist_controller.motion.setpoints import TIMEOUT
from tvist_protocol import commands as c
from tvist_protocol.codec import encode
from tvist_protocol.journal import Entry
from tvist_protocol.replies import Done

from .robots import UR5E, H, Kept, setup

Q1 = UR5E.poses["Q1"]
SILENCE = round(TIMEOUT / H) + 1
"""Ticks after which a stream without set-points is stopped."""


@pytest.fixture
def streaming():
    """A host in real time whose client streams, and its sink."""
    sink = Kept()
    host = Host(Controller(setup(clock="realtime")), sink)
    host.request(encode(c.TakeControl(client="a")))
    host.request(encode(c.ServoStart(token=host.controller.session.lease.token)))
    return host, sink


def offered(host, **changes):
    host.setpoint(encode(c.Setpoint(**{"token": "a#1", "sequence": 0, "q": Q1} | changes)))


def end_of(host, sink):
    for _ in range(SILENCE):
        host.tick()
    (event,) = [event for event in sink.events if event.kind == "stream_stopped"]
    return event.why


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ({"q": Q1[:5]}, "q has 5 angles; the arm has 6"),
        ({"q": (math.nan, *Q1[1:])}, "q[0] is NaN, not a number"),
        ({"q": (*Q1[:5], math.inf)}, "q[5] is inf: must be at most 1000"),
        ({"q": (*Q1[:5], 6.5)}, "q[5] is 6.5 rad; the joint goes to ±6.28319"),
    ],
)
def test_the_end_of_a_silent_stream_names_the_last_refusal(streaming, fault, said):
    host, sink = streaming
    offered(host, token=host.controller.session.lease.token, sequence=1)
    offered(host, **({"token": host.controller.session.lease.token} | fault))
    assert end_of(host, sink) == f"no set-point for 0.25 s; the last one was refused: {said}"
    assert host.controller.counters.setpoints_received == 2
    assert host.controller.counters.setpoints_refused == 1


def test_a_stream_that_simply_ceases_names_no_refusal(streaming):
    host, sink = streaming
    token = host.controller.session.lease.token
    offered(host, token=token, q=Q1[:5])
    offered(host, token=token)
    assert end_of(host, sink) == "no set-point for 0.25 s"


@pytest.mark.parametrize("fault", [{}, {"q": Q1[:5]}, {"q": (math.nan, *Q1[1:])}])
def test_a_stranger_s_set_points_are_not_blamed(streaming, fault):
    host, sink = streaming
    offered(host, token="other", **fault)
    assert end_of(host, sink) == "no set-point for 0.25 s"
    assert host.controller.counters.setpoints_refused == 1


@pytest.mark.parametrize("fault", [{}, {"q": (math.nan, *Q1[1:])}])
def test_the_lease_at_the_moment_of_carrying_out_counts(streaming, fault):
    """A set-point may wait long after its admission: then it is none of the client's that has control meanwhile."""
    host, sink = streaming
    token = host.controller.session.lease.token
    waiting = admit_setpoint(
        encode(c.Setpoint(**{"token": token, "sequence": 1, "q": Q1} | fault)), host.standing.lease
    )
    host.request(encode(c.ReleaseControl(token=token)))
    host.request(encode(c.TakeControl(client="b")))
    known = len(sink.entries)
    host.receive_setpoint(waiting)
    assert len(sink.entries) == known
    assert host.controller.counters.setpoints_received == 1
    assert host.controller.counters.setpoints_refused == 1


def test_what_was_refused_in_an_earlier_stream_is_not_blamed_for_the_end_of_the_next(streaming):
    host, sink = streaming
    token = host.controller.session.lease.token
    offered(host, token=token, q=Q1[:5])
    host.request(encode(c.ServoStop(token=token)))
    for _ in range(200):
        host.tick()
    sink.events.clear()
    assert host.request(encode(c.ServoStart(token=token))) == Done()
    assert end_of(host, sink) == "no set-point for 0.25 s"


def test_equal_journals_give_equal_events_also_where_a_set_point_could_not_be_read():
    """A replay is given what the journal holds: of bytes that are no set-point, why they are none."""
    from tvist_lab.replay import replay

    start, sink = setup(clock="realtime"), Kept()
    host = Host(Controller(start), sink)
    host.request(encode(c.TakeControl(client="a")))
    token = host.controller.session.lease.token
    host.request(encode(c.ServoStart(token=token)))
    offered(host, token=token, q=(math.nan, *Q1[1:]))
    end_of(host, sink)
    kept = [msgspec.convert(msgspec.to_builtins(entry), Entry) for entry in sink.entries]
    again = replay(start, kept, sink.states)
    assert again.first_difference is None
    assert again.events == sink.events
