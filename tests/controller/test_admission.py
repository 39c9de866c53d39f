"""What is admitted, and that nothing else is even read."""

import msgpack
import msgspec
import pytest

from tvist_controller.dispatch.admission import admit, admit_setpoint
from tvist_controller.dispatch.rights import Lease
from tvist_protocol import commands as c
from tvist_protocol.codec import MAX_BYTES, encode
from tvist_protocol.explain import EXPLAINED_BYTES
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationStep, StepSetpoint

LEASE = Lease("anna", "anna#1", 30.0, None)
Q = (0.0,) * 6
JUNK = [{}] * 100_000
"""Takes a hundred ticks to read."""


def refused(message, lease=LEASE):
    reply = admit(message if isinstance(message, bytes) else msgpack.packb(message), lease)
    assert isinstance(reply, Refused)
    return reply.code, reply.where


def test_the_holder_s_command_is_admitted_with_what_the_journal_keeps():
    command = c.MoveJ(token="anna#1", q=Q)
    admitted = admit(encode(command), LEASE)
    assert admitted.command == command
    assert admitted.content == msgspec.to_builtins(command)


@pytest.mark.parametrize("token", ["", "anna#2", "bert#1"])
def test_a_stranger_s_command_is_not(token):
    assert refused(encode(c.MoveJ(token=token, q=Q))) == ("stale_token", "token")
    assert refused(encode(c.MoveJ(token=token, q=Q)), None) == ("no_control", "token")
    assert refused(encode(c.Stop(token=token))) == ("stale_token", "token")


def test_anybody_may_stop_and_ask_for_control_that_is_free_or_his():
    assert admit(encode(c.Stop()), LEASE).command == c.Stop()
    assert admit(encode(c.TakeControl(client="bert")), None).command.client == "bert"
    assert admit(encode(c.TakeControl(client="anna")), LEASE).command.client == "anna"
    assert refused(encode(c.TakeControl(client="bert"))) == ("no_control", "token")


LONG = {"type": "set_estimator", "token": "anna#1", "name": "polynomial", "calibration": {"a": JUNK}}


@pytest.mark.parametrize(
    ("changes", "answer"),
    [
        ({"token": "x"}, ("stale_token", "token")),
        ({"token": None}, ("missing_field", "token")),
        ({"type": "move_j"}, ("malformed", "")),
        ({"type": "nonsense"}, ("malformed", "")),
        ({"type": None}, ("malformed", "")),
        ({"type": JUNK}, ("malformed", "type")),
        ({"token": JUNK}, ("malformed", "token")),
        ({}, ("unknown_field", "calibration.a")),
    ],
)
def test_of_a_long_message_little_is_read_before_its_sender_is_known(changes, answer):
    data = msgpack.packb(LONG | changes)
    assert EXPLAINED_BYTES < len(data) <= MAX_BYTES
    assert refused(data) == answer


def test_a_long_sentence_of_the_sender_s_is_cut():
    reply = admit(msgpack.packb({"type": "x" * 100_000}), LEASE)
    assert len(reply.why) < 200


def test_a_step_of_a_thousand_setpoints_is_admitted():
    setpoints = tuple(StepSetpoint(sequence=n, q=(3.0,) * 7) for n in range(1000))
    command = SimulationStep(token="anna#1", ticks=1000, setpoints=setpoints)
    assert admit(encode(command), LEASE).command == command


def test_setpoints_are_the_holder_s_alone():
    setpoint = c.Setpoint(token="anna#1", sequence=3, q=Q)
    assert admit_setpoint(encode(setpoint), LEASE) == setpoint
    assert admit_setpoint(encode(setpoint), None) is None
    assert admit_setpoint(encode(c.Setpoint(token="x", sequence=3, q=Q)), LEASE) is None
    assert admit_setpoint(b"\xc1", LEASE) is None
    assert (
        admit_setpoint(
            msgpack.packb({"type": "setpoint", "token": "anna#1", "sequence": 0, "q": JUNK}), LEASE
        )
        is None
    )
