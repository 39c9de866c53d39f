"""Waiting for conditions without an event."""

import time
from contextlib import suppress

from tests.conformance.served import PATIENCE

from tvist_lab.recordings.mcap_file import RecordingFileError, read


def eventually(true):
    """Repeat a question until its answer is true; return the answer."""
    deadline = time.monotonic() + PATIENCE
    while not (found := true()):
        assert time.monotonic() < deadline, "the condition was never met"
        time.sleep(0.005)
    return found


def recorded_ticks(path):
    """Return the ticks of the states in a recording that grows; none as long as it cannot be read."""
    with suppress(RecordingFileError):
        return [state.tick for state in read(path).states]
    return []
