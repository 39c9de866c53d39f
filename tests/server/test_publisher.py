"""A robot's messages go to all gateways that take them, and one that fails keeps them from no other."""

from copy import copy

from tests.controller.robots import Robot

from tvist_protocol.codec import decode
from tvist_protocol.stream import Event, State
from tvist_server.gateways.base import Gateway
from tvist_server.publisher import Publisher

ROBOT = Robot()
STATE, IO = ROBOT.tick(), ROBOT.controller.io()
REPORT = ROBOT.controller.report
TRUTH = ROBOT.controller.truth()


class NotingGateway(Gateway):
    """Keeps what is published."""

    def __init__(self):
        self.published = []

    def publish(self, topic, _message, data):
        self.published.append((topic, data))

    def close(self):
        """Nothing is open."""


class FailingGateway(NotingGateway):
    """Cannot publish anything."""

    def publish(self, *_):
        raise ZeroDivisionError


def publisher(*gateways):
    made = Publisher()
    made.open(gateways)
    return made


def topics(gateway):
    return [topic for topic, _ in gateway.published]


def test_messages_go_to_every_gateway_in_their_order():
    one, other = NotingGateway(), NotingGateway()
    made = publisher(one, other)
    made.event(Event(tick=1, kind="warning"))
    made.report(REPORT)
    assert one.published == other.published
    assert topics(one) == ["event", "state"]
    assert decode(Event, one.published[0][1]).tick == 1
    assert decode(State, one.published[1][1]) == STATE


def test_a_gateway_that_fails_is_logged_and_the_others_get_the_message(caplog):
    gateway = NotingGateway()
    made = publisher(FailingGateway(), gateway)
    made.io(IO)
    made.report(REPORT)
    assert caplog.text.count("is not published") == 2
    assert topics(gateway) == ["io", "state"]


def test_what_no_gateway_takes_is_not_made():
    gateway = NotingGateway()
    made = publisher(gateway)
    gateway.takes = {"event"}
    report = copy(REPORT)
    report.made = report.written = None
    made.report(report)
    made.truth(TRUTH)
    made.event(Event(tick=1, kind="warning"))
    made.io(IO)
    assert topics(gateway) == ["event"]
    assert report.made is None
    assert report.written is None
    gateway.takes = {"event", "state"}
    made.report(report)
    assert decode(State, gateway.published[-1][1]) == STATE
