"""Admission of commands, and that nothing else is decoded."""

import math

import msgpack
import msgspec
import pytest

from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import admit, admit_setpoint
from tvist_controller.dispatch.rights import Authority, Lease, Presence, check_token
from tvist_controller.host import Host
from tvist_controller.motion.setpoints import TIMEOUT
from tvist_controller.refusal import RefusalError
from tvist_protocol import commands as c
from tvist_protocol.codec import MAX_BYTES, encode
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Done, Refused

from .robots import UR5E, H, Kept, setup

LEASE = Lease("anna", "anna#1", 30.0, None)
Q = (0.0,) * 6
JUNK = [{}] * 100_000
"""Takes a hundred ticks to read."""


def refused(message, lease=LEASE):
    reply = admit(message if isinstance(message, bytes) else msgpack.packb(message), lease)
    assert isinstance(reply, Refused)
    return reply.code, reply.where


def test_a_command_with_control_is_admitted_with_its_journal_content():
    command = c.MoveJ(token="anna#1", q=Q)
    admitted = admit(encode(command), LEASE)
    assert admitted.command == command
    assert admitted.content == msgspec.to_builtins(command)


LONG = {"type": "set_estimator", "token": "anna#1", "name": "polynomial", "calibration": {"a": JUNK}}


@pytest.mark.parametrize(("changes", "answer"), [
    ({"token": "x"}, ("stale_token", "token")), ({"token": None}, ("missing_field", "token")),
    ({"type": "move_j"}, ("malformed", "")), ({"type": "nonsense"}, ("malformed", "")),
    ({"type": None}, ("malformed", "")), ({"type": JUNK}, ("malformed", "type")),
    ({"token": JUNK}, ("malformed", "token")), ({}, ("unknown_field", "calibration.a")),
])  # fmt: skip
def test_a_long_message_is_decoded_only_after_its_token_is_checked(changes, answer):
    data = msgpack.packb(LONG | changes)
    assert EXPLAINED_BYTES < len(data) <= MAX_BYTES
    assert refused(data) == answer


def test_long_content_is_cut_in_refusals():
    reply = admit(msgpack.packb({"type": "x" * 100_000}), LEASE)
    assert len(reply.why) < 200


def test_set_points_need_control():
    setpoint = {"type": "setpoint", "token": "anna#1", "sequence": 3, "q": Q}
    assert admit_setpoint(msgpack.packb(setpoint), LEASE) == c.Setpoint(token="anna#1", sequence=3, q=Q)
    assert admit_setpoint(msgpack.packb(setpoint), None) is None
    for wrong in ({"token": "x"}, {"q": JUNK}):
        assert admit_setpoint(msgpack.packb(setpoint | wrong), LEASE) is None
    assert admit_setpoint(b"\xc1", LEASE) is None


def test_a_token_from_before_a_restart_is_invalid():
    given = (lambda _: None), (lambda *_, **__: None)
    before, after = (Authority(*given, realtime=True, instance=instance) for instance in ("1f", "2e"))
    old = before.take("a", 30.0, 0.0).token
    new = after.take("a", 30.0, 0.0).token
    assert (old, new) == ("a#1f.1", "a#2e.1")
    with pytest.raises(RefusalError, match="not that of the current lease"):
        check_token(after.lease, old)


@pytest.mark.parametrize("second", ["2f", ""])
def test_two_sessions_with_the_same_client_name_are_refused_control(second):
    presence = Presence()
    presence.seen("a", "1f")
    presence.seen("b", "1f")
    assert (presence.session_of("a"), presence.session_of("c")) == ("1f", None)
    assert presence.clients_of("1f") == ["a", "b"]
    presence.seen("a", second)
    with pytest.raises(RefusalError, match="'a'") as caught:
        presence.session_of("a")
    assert caught.value.reply.code == "no_control"
    presence.gone("a", second)
    presence.gone("a", second)  # once more changes nothing
    assert presence.session_of("a") == "1f"
    presence.gone("a", "1f")
    assert presence.clients_of("1f") == ["b"]


Q1 = UR5E.poses["Q1"]
SILENCE = round(TIMEOUT / H) + 1
"""Ticks after which a stream without set-points is stopped."""


@pytest.fixture
def streaming():
    """Return a host in real time with a streaming client, and its sink."""
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
        ({"q": Q1[:5]}, "q has 5 values: must be 6, one per joint"),
        ({"q": (math.nan, *Q1[1:])}, "q[0] is NaN, not a number"),
        ({"q": (*Q1[:5], math.inf)}, "q[5] is inf: must be at most 1000"),
        ({"q": (*Q1[:5], 6.5)}, "q[5] is 6.5 rad: must be within ±6.28319 rad"),
    ],
)
def test_a_silent_stream_ends_with_the_last_refusal(streaming, fault, said):
    host, sink = streaming
    offered(host, token=host.controller.session.lease.token, sequence=1)
    offered(host, **({"token": host.controller.session.lease.token} | fault))
    assert end_of(host, sink) == f"no set-point for 0.25 s; the last one was refused: {said}"
    assert host.controller.counters.setpoints_received == 2
    assert host.controller.counters.setpoints_refused == 1


@pytest.mark.parametrize("fault", [{}, {"q": Q1[:5]}, {"q": (math.nan, *Q1[1:])}])
def test_set_points_of_other_clients_are_not_reported_at_the_end_of_a_stream(streaming, fault):
    host, sink = streaming
    offered(host, token="other", **fault)
    assert end_of(host, sink) == "no set-point for 0.25 s"
    assert host.controller.counters.setpoints_refused == 1


@pytest.mark.parametrize("fault", [{}, {"q": (math.nan, *Q1[1:])}])
def test_a_set_point_needs_control_when_it_is_carried_out(streaming, fault):
    """A set-point may wait long after admission, and another client may have control by then."""
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


def test_refusals_of_an_earlier_stream_are_not_reported(streaming):
    host, sink = streaming
    token = host.controller.session.lease.token
    offered(host, token=token, q=Q1[:5])
    host.request(encode(c.ServoStop(token=token)))
    for _ in range(200):
        host.tick()
    sink.events.clear()
    assert host.request(encode(c.ServoStart(token=token))) == Done()
    assert end_of(host, sink) == "no set-point for 0.25 s"
