"""Messages reach listeners and iterators in order; invalid ones are dropped."""

import asyncio
import logging
import threading
from types import SimpleNamespace

import msgspec
import pytest

from tvist_client import AnswerTimeoutError, ArgumentError, NotConnectedError
from tvist_client.feed import Feed
from tvist_client.transports.inbox import MAX_WAITING, Inbox
from tvist_protocol.codec import encode
from tvist_protocol.generate import FOLDER
from tvist_protocol.stream import Event, State

STATE = msgspec.json.decode((FOLDER / "fixtures/v1/state.json").read_bytes(), type=State)


def state(tick):
    return msgspec.structs.replace(STATE, tick=tick)


@pytest.fixture
def source():
    """A transport's subscriptions alone."""
    callbacks = []

    def put(data):
        for callback in callbacks:
            callback(data)

    return SimpleNamespace(callbacks=callbacks, put=put, subscribe=lambda _, one: callbacks.append(one))


@pytest.fixture
def states(source):
    return Feed(source, "state", State, once_a_tick=True)


async def test_a_slow_reader_loses_the_oldest_messages_and_counts_them(source, states):
    stream = states.stream(3)
    for tick in range(1, 11):
        source.put(encode(state(tick)))
    states.end(NotConnectedError("closed"), closed=True)
    assert [one.tick async for one in stream] == [8, 9, 10]
    assert stream.dropped == 7


async def test_repeated_and_late_states_are_dropped(source, states):
    stream = states.stream(10)
    for tick in (5, 5, 6, 4, 6, 7):
        source.put(encode(state(tick)))
    states.end(NotConnectedError("closed"), closed=True)
    assert [one.tick async for one in stream] == [5, 6, 7]


async def test_ticks_may_restart_after_a_reconnection(source, states):
    stream = states.stream(10)
    source.put(encode(state(500)))
    states.end(NotConnectedError("gone"))
    source.put(encode(state(1)))
    assert (await anext(stream)).tick == 500
    assert (await anext(stream)).tick == 1
    with pytest.raises(NotConnectedError, match="gone"):
        await anext(stream)


async def test_invalid_messages_are_dropped_counted_and_logged_once(source, states, caplog):
    stream = states.stream(10)
    event = encode(Event(tick=1, kind="warning"))
    for data in (b"", b"\xc1", b"junk", event, encode(state(1)), event, encode(state(2))):
        source.put(data)
    states.end(NotConnectedError("closed"), closed=True)
    assert [one.tick async for one in stream] == [1, 2]
    assert states.malformed == 5
    assert len(caplog.records) == 1


async def test_an_exception_in_a_listener_does_not_affect_other_listeners(source, states):
    raised, seen = [], []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: raised.append(context["exception"]))

    def clumsy(_):
        raise ZeroDivisionError

    states.listen(clumsy)
    end = states.listen(lambda one: (seen.append(one.tick), end()))
    source.put(encode(state(1)))
    source.put(encode(state(2)))
    assert seen == [1], "a listener may end itself while it is called"
    assert [type(error) for error in raised] == [ZeroDivisionError] * 2


async def test_an_invalid_callback_or_buffer_is_refused_before_subscribing(source, states):
    with pytest.raises(ArgumentError, match="callback is None: must be a function of one state message"):
        states.listen(None)
    for size in (0, -1, "big", 1.5):
        with pytest.raises(ArgumentError, match=r"buffer is .*: must be .*at least 1"):
            states.stream(size)
    assert not source.callbacks


async def test_waiting_ends_with_the_message_the_timeout_or_the_connection(source, states):
    loop = asyncio.get_running_loop()
    loop.call_soon(source.put, encode(state(1)))
    loop.call_soon(source.put, encode(state(2)))
    assert (await states.next(lambda one: one.tick > 1, 10.0)).tick == 2
    with pytest.raises(AnswerTimeoutError, match="no state came within 0 s"):
        await states.next(lambda _: True, 0.0)
    loop.call_soon(states.end, NotConnectedError("gone"))
    with pytest.raises(NotConnectedError):
        await states.next(lambda _: True, 10.0)


async def test_all_events_of_a_tick_are_delivered(source):
    events = Feed(source, "event", Event, once_a_tick=False)
    stream = events.stream(10)
    for _ in range(3):
        source.put(encode(Event(tick=1, kind="warning")))
    events.end(NotConnectedError("closed"), closed=True)
    assert len([event async for event in stream]) == 3


async def test_messages_from_threads_reach_the_loop_complete_and_in_order():
    seen, ended = [], asyncio.Event()
    mailbox = Inbox(asyncio.get_running_loop())

    def receive(data):
        seen.append(int(data))
        if len(seen) == 5000:
            ended.set()

    def send():
        for number in range(5000):
            mailbox.put(receive, b"%d" % number, droppable=True)

    threading.Thread(target=send).start()
    await ended.wait()
    assert seen == list(range(5000))
    assert mailbox.dropped == 0


async def test_a_busy_loop_drops_states_but_no_events(caplog):
    caplog.set_level(logging.WARNING)
    states, events, ended = [], [], asyncio.Event()
    mailbox = Inbox(asyncio.get_running_loop())
    for number in range(MAX_WAITING + 10):
        mailbox.put(states.append, b"%d" % number, droppable=True)
    mailbox.put(events.append, b"event", droppable=False)
    mailbox.put(lambda _: ended.set(), b"", droppable=False)
    await ended.wait()
    assert (len(states), len(events), mailbox.dropped) == (MAX_WAITING, 1, 10)
    assert len(caplog.records) == 1
