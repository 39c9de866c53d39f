"""Transports to a robot: over Zenoh, or in process."""

from tvist_client.transports.base import Topic, Transport
from tvist_client.transports.loopback import InProcessRobot, LoopbackTransport
from tvist_client.transports.zenoh import ZenohTransport

__all__ = ["InProcessRobot", "LoopbackTransport", "Topic", "Transport", "ZenohTransport"]
