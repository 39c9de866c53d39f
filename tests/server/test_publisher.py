"""Messages of a robot go to all gateways that want them, even if another gateway fails."""

from copy import copy

from tests.controller.robots import Robot

from tvist_protocol.codec import decode
from tvist_protocol.stream import Event, State
from tvist_server.gateways.base import Gateway
from tvist_server.publisher import Publisher


class NotingGateway(Gateway):
    """Keeps what is published, unless it fails."""

    def __init__(self, *, fails=False):
        self.published, self.fails = [], fails

    def publish(self, topic, _message, data):
        if self.fails:
            raise ZeroDivisionError
        self.published.append((topic, data))


def test_a_failing_gateway_does_not_affect_the_others(caplog):
    robot, gateways, publisher = (
        Robot(),
        [NotingGateway(fails=fails) for fails in (False, True, False)],
        Publisher(),
    )
    publisher.gateways = gateways
    state = robot.tick()
    publisher.event(Event(tick=1, kind="warning"))
    publisher.io(robot.controller.io())
    publisher.report(robot.controller.report)
    assert caplog.text.count("is not published") == 3
    assert gateways[0].published == gateways[2].published
    assert [topic for topic, _ in gateways[0].published] == ["event", "io", "state"]
    assert decode(State, gateways[0].published[2][1]) == state


def test_messages_without_a_reader_are_not_built():
    robot, gateway, publisher = Robot(truth=True), NotingGateway(), Publisher()
    publisher.gateways = [gateway]
    gateway.wanted_topics = {"event"}
    state, report = robot.tick(), copy(robot.controller.report)
    report.made = report.written = None
    publisher.report(report)
    publisher.truth(robot.controller.truth())
    publisher.event(Event(tick=1, kind="warning"))
    assert [topic for topic, _ in gateway.published] == ["event"]
    assert (report.made, report.written) == (None, None)
    gateway.wanted_topics = {"event", "state"}
    publisher.report(report)
    assert decode(State, gateway.published[-1][1]) == state
