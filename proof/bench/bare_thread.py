"""A thread that does nothing but sleep to the deadlines of a robot's ticks.

    python -m proof.bench.bare_thread SECONDS

Each line on stdin starts a segment of this many seconds; a line on stdout then gives the ticks that were due
and how many were missed. It ends when stdin does.
"""

import ctypes
import gc
import json
import sys
import time

from tvist_plant.plant import PERIOD
from tvist_server.schedule import Schedule

SET_TIMER_SLACK = 29
"""Option of prctl for the largest delay with which this thread may be woken [ns]; a served robot sets it, too."""


def segment(seconds: float) -> dict[str, int]:
    """Sleep to each deadline for this long; count as a served robot does."""
    schedule = Schedule(1, PERIOD, time.monotonic())
    ticks, due, missed = round(seconds / PERIOD), 0, 0
    while due < ticks:
        wait = schedule.due - time.monotonic()
        if wait > 0.0:
            time.sleep(wait)
        late = schedule.begin(time.monotonic())[2]
        due += max(1, late)
        missed += late
    return {"ticks": due, "missed": missed}


def main(seconds: float) -> None:
    """Measure a segment for each line that comes."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(SET_TIMER_SLACK, 1, 0, 0, 0)
    gc.freeze()
    for _ in sys.stdin:
        sys.stdout.write(json.dumps(segment(seconds)) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(float(sys.argv[1]))
