"""Clients that read every state, each over its own connection, all in a process of their own.

    python -m proof.bench.observers ENDPOINT ROBOT COUNT

A line on stdout says that all of them listen. They read until stdin ends; then another line gives the numbers of
states that each received and missed.
"""

import json
import sys
from asyncio.subprocess import PIPE, create_subprocess_exec
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial

import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_protocol import keys
from tvist_protocol.codec import decode_state


@asynccontextmanager
async def observed(endpoint: str, robot: str, count: int) -> AsyncIterator[list[dict[str, int]]]:
    """Let clients read in a process of their own.

    Yields:
        A list, which at the end contains the numbers received and lost of each client.
    """
    said: list[dict[str, int]] = []
    command = [sys.executable, "-m", "proof.bench.observers", endpoint, robot, str(count)]
    # In a session of its own, Control+C leaves it to whoever measures.
    process = await create_subprocess_exec(*command, stdin=PIPE, stdout=PIPE, start_new_session=True)
    try:
        assert process.stdout is not None
        await process.stdout.readline()  # all clients are reading
        yield said
        out, _ = await process.communicate(b"")
        said += json.loads(out)
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


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
