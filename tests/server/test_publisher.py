"""What a robot says waits in order, is dropped and counted or waited for, and is handed on when somebody comes."""

import threading
from copy import copy

from tests.controller.robots import Robot

from tvist_protocol.codec import decode
from tvist_protocol.stream import Event, State
from tvist_server.courier import Courier
from tvist_server.gateways.base import Gateway
from tvist_server.publisher import MAX_WAITING, Publisher

WAIT = 30.0
ROBOT = Robot()
STATE, IO = ROBOT.tick(), ROBOT.controller.io()
REPORT = ROBOT.controller.report
TRUTH = ROBOT.controller.truth()


class NotingGateway(Gateway):
    """Keeps what is published; may hold up whoever publishes."""

    def __init__(self):
        self.published = []
        self.free = threading.Event()
        self.free.set()
        self.news = threading.Event()

    def publish(self, topic, _message, data):
        assert self.free.wait(WAIT)
        self.published.append((topic, data))
        self.news.set()

    def close(self):
        """Nothing is open."""


def publisher(*, lossless=False):
    gateway, made = NotingGateway(), Publisher(lossless=lossless)
    made.open([gateway])
    return gateway, made


def test_messages_and_answers_go_out_in_their_order():
    gateway, made = publisher()
    made.event(Event(tick=1, kind="warning"))
    made.report(REPORT)
    made.answer(lambda: gateway.published.append(("reply", None)))
    assert gateway.published == []
    made.hand_on()
    assert [topic for topic, _ in gateway.published] == ["event", "state", "reply"]
    assert decode(Event, gateway.published[0][1]).tick == 1
    assert decode(State, gateway.published[1][1]) == STATE


def test_in_real_time_states_without_room_are_dropped_and_counted_and_events_are_not():
    gateway, made = publisher()
    for _ in range(MAX_WAITING + 10):
        made.report(REPORT)
    made.event(Event(tick=1, kind="warning"))
    made.hand_on()
    assert made.dropped == 10
    assert [topic for topic, _ in gateway.published] == ["state"] * MAX_WAITING + ["event"]


def test_in_lockstep_the_robot_waits_for_room_and_nothing_is_lost():
    gateway, made = publisher(lossless=True)
    courier = Courier([made])
    made.open([gateway], courier.wake)
    gateway.free.clear()
    courier.start()
    states = MAX_WAITING + 500
    robot = threading.Thread(target=lambda: [made.report(REPORT) for _ in range(states)])
    robot.start()
    gateway.free.set()
    robot.join(WAIT)
    courier.close()
    made.hand_on()
    assert len(gateway.published) == states
    assert made.dropped == 0


def test_whoever_waits_for_room_goes_on_when_the_robot_is_about_to_end():
    _, made = publisher(lossless=True)
    robot = threading.Thread(target=lambda: [made.report(REPORT) for _ in range(MAX_WAITING + 1)])
    robot.start()
    made.hurry()
    robot.join(WAIT)
    assert not robot.is_alive()
    assert made.dropped <= 1


def test_one_courier_empties_the_outlets_of_several_robots():
    pairs = [publisher() for _ in range(3)]
    courier = Courier([made for _, made in pairs])
    courier.start()
    for _, made in pairs:
        made.report(REPORT)
    courier.wake()
    for gateway, _ in pairs:
        assert gateway.news.wait(WAIT)
    courier.close()


def test_a_gateway_that_fails_is_logged_and_the_next_message_goes_out(caplog):
    gateway, made = publisher()
    made.answer(lambda: 1 / 0)
    made.report(REPORT)
    made.hand_on()
    assert "ZeroDivisionError" in caplog.text
    assert [topic for topic, _ in gateway.published] == ["state"]


def test_the_state_and_io_are_told_again_to_those_who_come_late():
    gateway, made = publisher()
    made.repeat(REPORT, IO)
    made.hand_on()
    assert [topic for topic, _ in gateway.published] == ["io", "state"]


def test_what_no_gateway_takes_is_neither_queued_nor_made():
    gateway, made = publisher()
    gateway.takes = {"event"}
    report = copy(REPORT)
    report.made = report.written = None
    made.report(report)
    made.truth(TRUTH)
    assert not made.waiting
    made.event(Event(tick=1, kind="warning"))
    made.io(IO)
    made.hand_on()
    assert [topic for topic, _ in gateway.published] == ["event"]
    gateway.takes = {"event", "state"}
    made.report(report)
    made.hand_on()
    assert decode(State, gateway.published[-1][1]) == STATE


def test_a_courier_is_not_woken_when_nothing_waits():
    gateway, made = publisher()
    calls = []
    made.hand_on = lambda: calls.append(len(made.waiting)) or Publisher.hand_on(made)
    courier = Courier([made])
    courier.start()
    courier.wake()
    made.report(REPORT)
    courier.wake()
    assert gateway.news.wait(WAIT)
    courier.close()
    assert calls[0] == 1
