"""Short conversations with a robot's interfaces, each over a connection of its own."""

import socket
import time
from collections.abc import Callable
from typing import TypeVar

from tvist_server.watching.place import Place

PATIENCE = 2.0
"""Longest duration of a conversation [s]."""
MOST = 1 << 20
"""Most bytes that are taken as an answer."""
T = TypeVar("T")


class NoAnswerError(Exception):
    """An interface does not answer; the message says which, and why."""


def ask(place: Place, question: bytes, answer: Callable[[bytes], T | None]) -> T:
    """Send a question, and return what its answer says.

    Args:
        place: The interface.
        question: What to send, as soon as the connection is there.
        answer: Reads what has come so far; None if more has to come.

    Raises:
        NoAnswerError: There is no interface, or it does not answer in time.
    """
    heard, ends = b"", time.monotonic() + PATIENCE
    try:
        with socket.create_connection((place.host, place.port), PATIENCE) as connection:
            connection.sendall(question)
            while len(heard) < MOST and (left := ends - time.monotonic()) > 0.0:
                connection.settimeout(left)
                data = connection.recv(1 << 16)
                heard += data
                found = answer(heard)
                if found is not None:
                    return found
                if not data:
                    break
    except OSError as error:
        raise NoAnswerError(f"port {place.port} of {place.host}: {error.strerror or error}") from error
    raise NoAnswerError(f"port {place.port} of {place.host} gives no answer within {PATIENCE:g} s")
