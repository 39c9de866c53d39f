"""Clients that read every state, each over its own connection, all in this process.

    python -m proof.bench.observers ENDPOINT ROBOT COUNT

A line on stdout says that all of them listen. They read until stdin ends; then another line gives the numbers of
states that each received and missed.
"""

import json
import sys
from functools import partial

import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_protocol import keys
from tvist_protocol.codec import decode_state


class Observer:
    """Reads states.

    Args:
        session: A session used by no other observer.
        robot: Name of the robot.
    """

    def __init__(self, session: zenoh.Session, robot: str) -> None:
        self.received = 0
        self.lost = 0
        """Number of states missing between two that arrived."""
        self._last: int | None = None
        session.declare_subscriber(keys.state(robot), Callback(self._on_state, indirect=False))

    def _on_state(self, sample: zenoh.Sample) -> None:
        tick = decode_state(sample.payload.to_bytes()).tick
        if self._last is not None:
            self.lost += tick - self._last - 1
        self._last = tick
        self.received += 1


def main(endpoint: str, robot: str, count: int) -> None:
    """Observe until stdin ends."""
    sessions = [open_session(endpoint) for _ in range(count)]
    observers = list(map(partial(Observer, robot=robot), sessions))
    for session in sessions:
        list(session.get(keys.info(robot)))  # goes the same way as the subscription
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    sys.stdin.read()
    result = [{"received": observer.received, "lost": observer.lost} for observer in observers]
    for session in sessions:
        close_session(session)
    sys.stdout.write(json.dumps(result) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
