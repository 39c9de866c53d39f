"""Whatever the bytes, a whole server in process answers each, and what it refuses changes nothing.

The decoders alone are `protocol/test_fuzz`'s, whose messages these are: random, nearly right, right.
"""

import gc
import math
import tracemalloc
from dataclasses import dataclass
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from tests.examples import share
from tests.protocol.test_fuzz import changed, damaged, fields, keys, values

from tvist_controller.loopback import LoopbackHost
from tvist_protocol.codec import decode, decode_reply, encode
from tvist_protocol.commands import ReleaseControl, Stop, TakeControl
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.stream import State

from .robots import Q1, setup

HOME = tuple(map(float, Q1))
TICKS = 20
"""A golden step has a hundred times as many."""
NAMED = {"unknown_field", "missing_field", "out_of_range"}
"""Codes of refusals that are about a field, whose name stands in `where`."""
NAMELESS = msgpack.packb("")
"""A field may have no name."""
TOGETHER = 20
"""Messages of one sequence."""


@dataclass(frozen=True)
class Message:
    """What a client sends: bytes, or a value to be packed."""

    value: Any
    near: bool = False
    """Whether it is to be heard: with the lease's token, and near to where the arm is."""
    end: int | None = None
    """Where it is cut off."""

    def packed(self, token):
        if isinstance(self.value, bytes):
            return self.value
        return msgpack.packb(self.aimed(token) if self.near else self.value)[: self.end]

    def aimed(self, token):
        value = dict(self.value)
        if isinstance(value.get("token"), str):
            value["token"] = token
        if isinstance(value.get("ticks"), int) and TICKS < value["ticks"] <= 1000:
            value["ticks"] = TICKS
        if isinstance(value.get("q"), list) and len(value["q"]) == len(HOME):
            value["q"] = [angle + 0.1 if isinstance(angle, float) else angle for angle in HOME]
        return value


random_values = values.filter(lambda value: not isinstance(value, bytes))
messages = st.one_of(
    st.builds(Message, st.binary(max_size=64) | damaged()),
    st.builds(Message, random_values | st.dictionaries(fields | keys, values, max_size=6)),
    *[st.builds(Message, changed(), st.booleans())] * 3,
    st.builds(Message, changed(), st.booleans(), st.integers(0, 200)),
)


class Server:
    """A robot in process with its lease; its output is checked."""

    def __init__(self):
        self.host = LoopbackHost(setup(clock="lockstep"))
        self.host.subscribe("state", self._on_state)
        self.token = self._take()

    def send(self, data):
        before = self.looks()
        reply = decode_reply(self.host.request("fuzz", data))
        if isinstance(reply, Refused):
            assert 0 < len(reply.why) < 500
            assert reply.where or reply.code not in NAMED or NAMELESS in data, reply
            assert self.looks() == before
        self._hold_on()
        return reply

    def looks(self):
        """Return everything that a refused command must not change."""
        controller = self.host.controller
        info = msgspec.msgpack.decode(self.host.info())
        lease = controller.session.lease
        return (
            info,
            controller.tick_number,
            controller.motion.activity,
            controller.motion.motions.speed,
            controller.cycle.sample.reference.tolist(),
            None if lease is None else (lease.client, lease.token),
        )

    def again(self):
        """Reset, except for the counters."""
        for command in (Stop(), SimulationReset(token=self.token, q=HOME, mode="RUNNING", shaper="zv")):
            self.host.request("fuzz", encode(command))
        self.host.entries.clear()

    def _take(self):
        reply = decode_reply(self.host.request("fuzz", encode(TakeControl(client="fuzz"))))
        assert isinstance(reply, Accepted), reply
        return reply.token

    def _hold_on(self):
        """Take the lease again if a valid message gave it away."""
        lease = self.host.controller.session.lease
        if lease is not None and lease.client != "fuzz":
            self.host.request("fuzz", encode(ReleaseControl(token=lease.token)))
            lease = None
        self.token = self._take() if lease is None else lease.token

    @staticmethod
    def _on_state(data):
        state = decode(State, data)
        assert all(map(math.isfinite, (*state.target_q, *state.actual_q, *state.actual_moment)))


@pytest.fixture(scope="module")
def server():
    return Server()


@pytest.mark.parametrize(
    "count", [2_000, pytest.param(15_000, marks=[pytest.mark.nightly, pytest.mark.timeout(3600)])]
)
def test_every_message_gets_a_reply_and_refused_ones_change_nothing(server, count):
    @settings(
        max_examples=share(count // TOGETHER),
        deadline=None,
        derandomize=count == 2_000,
        phases=[Phase.generate],  # to make a sequence of twenty smaller takes minutes
        suppress_health_check=[
            HealthCheck.too_slow,
            HealthCheck.large_base_example,
            HealthCheck.data_too_large,
        ],
    )
    @given(sequence=st.lists(st.tuples(messages, st.booleans()), min_size=TOGETHER, max_size=TOGETHER))
    def run(sequence):
        server.again()
        for message, setpoint in sequence:
            data = message.packed(server.token)
            if setpoint:
                server.host.put_setpoint("fuzz", data)
            server.send(data)

    run()


UNDER_TEST = tracemalloc.Filter(inclusive=True, filename_pattern="*/tvist_*")
"""Allocations of the code under test; threads of the test runner allocate, too."""


def test_a_flood_of_messages_leaks_no_memory(server):
    """Memory after the last flood equals that after the one before."""
    sent = []

    @settings(max_examples=60, deadline=None, derandomize=True, database=None)
    @given(message=messages)
    def collect(message):
        sent.append(message)

    collect()

    def flood():
        for _ in range(2):
            server.again()
            for message in sent:
                data = message.packed(server.token)
                server.host.put_setpoint("fuzz", data)
                server.send(data)
        server.again()
        gc.collect()
        snapshot = tracemalloc.take_snapshot().filter_traces([UNDER_TEST])
        return sum(trace.size for trace in snapshot.traces)

    tracemalloc.start()
    try:
        flood()
        before = flood()
        after = flood()
    finally:
        tracemalloc.stop()
    assert after - before < 12_000  # bytes; 240 messages have come
