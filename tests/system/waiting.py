"""Waiting for what no event tells."""

import time

from tests.conformance.served import PATIENCE


def eventually(true):
    """Ask until the answer is true, which is what this returns."""
    deadline = time.monotonic() + PATIENCE
    while not (found := true()):
        assert time.monotonic() < deadline, "it never was so"
        time.sleep(0.005)
    return found
