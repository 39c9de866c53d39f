"""Passes one robot's states, events and figures to the gateways, in the controller's thread.

In real time no gateway blocks; in lockstep gateways wait for clients between two ticks, since no state may be lost.
"""

import logging
from collections.abc import Sequence

from tvist_controller.instruments.report import Report, Sink
from tvist_protocol.codec import encode
from tvist_server.gateways.base import Gateway, Message, topic_of

log = logging.getLogger(__name__)


class Publisher(Sink):
    """Passes everything to the gateways; a failing gateway does not affect the others."""

    def __init__(self) -> None:
        self.gateways: Sequence[Gateway] = ()  # each gets every message

    def want_truth(self, wanted: bool) -> None:
        """Note whether a client subscribes to `truth`; any thread may call this."""
        self.wants_truth = wanted

    def report(self, report: Report) -> None:
        """Publish a tick's state."""
        for gateway in self.gateways:
            if "state" in gateway.wanted_topics:
                try:
                    gateway.report(report)
                except Exception:
                    log.exception("a state is not published")

    def publish(self, message: Message) -> None:
        """Publish a message other than a state."""
        topic = topic_of(message)
        takers = [gateway for gateway in self.gateways if topic in gateway.wanted_topics]
        if not takers:
            return
        try:
            data = encode(message)  # once for all gateways
        except Exception:
            log.exception("a message of the topic %s is not published", topic)
            return
        for gateway in takers:
            try:
                gateway.publish(topic, message, data)
            except Exception:
                log.exception("a message of the topic %s is not published", topic)

    event = truth = io = publish
