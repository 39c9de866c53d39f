"""Waiting for conditions without an event."""

import time

from tests.conformance.served import PATIENCE


def eventually(true):
    """Repeat a question until its answer is true; return the answer."""
    deadline = time.monotonic() + PATIENCE
    while not (found := true()):
        assert time.monotonic() < deadline, "the condition was never met"
        time.sleep(0.005)
    return found
