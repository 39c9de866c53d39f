"""Answers to Zenoh queries, sent by a separate thread."""

import contextlib
import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue

import zenoh

from tvist_protocol.codec import encode
from tvist_protocol.replies import Reply

log = logging.getLogger(__name__)

ENCODING = zenoh.Encoding("application/msgpack")

CLOSE_WAIT = 0.2  # longest time to send the last answers at close [s]


class Answers:
    """Sends replies to queries from its own thread, because a client that does not read blocks it.

    It blocks until its link is closed, after 1 s in real time and 5 s in lockstep: by default, replies use BLOCK.
    """

    def __init__(self) -> None:
        self._queue: SimpleQueue[tuple[zenoh.Query, str, Reply | Callable[[], bytes]] | None] = SimpleQueue()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="zenoh-answers", daemon=True)
        self._thread.start()

    def to(self, query: zenoh.Query, key: str) -> Callable[[Reply | Callable[[], bytes]], None]:
        """Return a function that answers a query with a reply, or with a function that returns an encoded one."""
        return lambda reply: self._queue.put((query, key, reply))

    def close(self) -> None:
        """Send the queued answers, for at most `CLOSE_WAIT`."""
        self._queue.put(None)
        self._thread.join(CLOSE_WAIT)
        self._closed = True

    def _run(self) -> None:
        while not self._closed and (answer := self._queue.get()) is not None:
            try:
                _send(*answer)
            except Exception:
                log.exception("a query is not answered")


def _send(query: zenoh.Query, key: str, reply: Reply | Callable[[], bytes]) -> None:
    # Leaving this block ends the query; if the client has left, the answer is not needed.
    with contextlib.suppress(zenoh.ZError), query:
        query.reply(key, reply() if callable(reply) else encode(reply), encoding=ENCODING)
