"""Answers to Zenoh queries, sent from a thread of their own."""

import contextlib
import threading
from collections.abc import Callable
from queue import SimpleQueue

import zenoh

from tvist_protocol.codec import encode
from tvist_protocol.replies import Reply

ENCODING = zenoh.Encoding("application/msgpack")

CLOSE_WAIT = 0.2
"""How long the last answers may take at close [s]."""


class Answers:
    """Sends replies to queries.

    A reply has the quality of service its client asked for, BLOCK unless it says otherwise: a client that
    sends queries and stops reading holds the thread that answers until its link is cut, after 1 s in real time
    and 5 s in lockstep. That thread is this one, so what the publisher puts 500 times a second is not late for
    the others.
    """

    def __init__(self) -> None:
        self._queue: SimpleQueue[tuple[zenoh.Query, str, Reply | bytes] | None] = SimpleQueue()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="zenoh-answers", daemon=True)
        self._thread.start()

    def to(self, query: zenoh.Query, key: str) -> Callable[[Reply | bytes], None]:
        """Make the function that answers a query on a key, encoded or not. Zenoh ends the query when it is called."""
        return lambda reply: self._queue.put((query, key, reply))

    def close(self) -> None:
        """Send what is waiting, as far as that is quick."""
        self._queue.put(None)
        self._thread.join(CLOSE_WAIT)
        self._closed = True

    def _run(self) -> None:
        while not self._closed and (answer := self._queue.get()) is not None:
            query, key, reply = answer
            data = reply if isinstance(reply, bytes) else encode(reply)
            # The client may have left, the session may be closed: then nobody waits.
            with contextlib.suppress(zenoh.ZError), query:
                query.reply(key, data, encoding=ENCODING)
