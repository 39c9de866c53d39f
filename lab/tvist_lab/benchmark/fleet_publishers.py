"""A process that poses as many robots: `python -m tvist_lab.benchmark.fleet_publishers ENDPOINT FIRST COUNT`.

Each has a session of its own, a liveliness token, and publishes its state at the rate that the last line of stdin gave,
in turn with the others. It prints `ready` and ends when its stdin is closed.
"""

import math
import sys
import threading
import time
from collections.abc import Sequence

import zenoh

from tvist_client.transports.session import close_session, open_session
from tvist_controller.api import Controller
from tvist_lab.in_process import free_setup
from tvist_protocol import keys
from tvist_protocol.codec import encode
from tvist_server.config import ServeConfig


def main() -> None:
    """Publish until stdin is closed."""
    endpoint, first, count = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    sessions = [open_session(endpoint) for _ in range(count)]
    names = [f"robot-{first + number}" for number in range(count)]
    tokens = [
        session.liveliness().declare_token(keys.alive(name))
        for session, name in zip(sessions, names, strict=True)
    ]
    publishers = [
        session.declare_publisher(keys.state(name), congestion_control=zenoh.CongestionControl.DROP)
        for session, name in zip(sessions, names, strict=True)
    ]
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    _Publishing(publishers).run()
    del tokens
    for session in sessions:
        close_session(session)


class _Publishing:
    """Publishes in turn, while another thread reads the rate."""

    def __init__(self, publishers: Sequence[zenoh.Publisher]) -> None:
        self._publishers = publishers
        self._rate: float | None = 0.0
        self._changed = threading.Event()

    def run(self) -> None:
        threading.Thread(target=self._read, daemon=True).start()
        payload, count, number = (
            encode(Controller(free_setup(ServeConfig(clock="free"))).latest),
            len(self._publishers),
            0,
        )
        rate, began = 0.0, time.monotonic()
        while self._rate is not None:
            if rate != self._rate:
                rate, began, number = self._rate, time.monotonic(), 0
            wait = began + number / (rate * count) - time.monotonic() if rate else math.inf
            if wait > 0.0:
                self._changed.wait(min(wait, 1.0))
                self._changed.clear()
                continue
            stamp = time.monotonic_ns().to_bytes(8, "little")
            self._publishers[number % count].put(payload, attachment=stamp)
            number += 1

    def _read(self) -> None:
        for line in sys.stdin:
            self._rate = float(line)
            self._changed.set()
        self._rate = None
        self._changed.set()


if __name__ == "__main__":
    main()
