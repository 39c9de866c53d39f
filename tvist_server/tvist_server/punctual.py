"""Requests to the system that make ticks punctual; if one is refused, this is logged and the robot runs without it."""

import contextlib
import logging
import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

log = logging.getLogger(__name__)

PRIORITY = 50  # real-time priority of the tick thread: the middle of the range 1 to 99
RECORDER = "recorder"  # name of the threads that take the messages of every tick


def processors() -> int:
    """Return the number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def waited_us() -> float:
    """Return how long the calling thread, ready to run, has waited for a processor [µs]; 0 if that is unknown."""
    with contextlib.suppress(OSError):
        return int(Path("/proc/thread-self/schedstat").read_text().split()[1]) / 1e3
    return 0.0


def take_priority() -> bool:
    """Give the calling thread real-time priority (SCHED_FIFO); return whether that succeeded.

    Recorders get a priority lower by 1: if another program displaced a recorder that holds the interpreter's
    lock, the calling thread would wait for that program. Slow work such as planning keeps normal priority.
    """
    if sys.platform != "linux":
        log.warning("real-time priority is only for Linux, so the control loop runs at normal priority")
        return False
    try:
        # Threads that these start, such as to write a file, inherit nothing.
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(PRIORITY))
        for thread in threading.enumerate():
            if thread.name == RECORDER and thread.native_id is not None:
                with contextlib.suppress(ProcessLookupError):  # the thread has just ended
                    os.sched_setscheduler(thread.native_id, policy, os.sched_param(PRIORITY - 1))
    except OSError as error:
        log.warning(
            "real-time priority is not permitted (%s), so the control loop runs at normal priority: "
            "it needs CAP_SYS_NICE, or a limit (ulimit -r) of %d",
            error.strerror,
            PRIORITY,
        )
        return False
    return True


def background(name: str) -> ThreadPoolExecutor:
    """Start and return a thread for slow work. One started by the tick thread would inherit its priority."""
    thread = ThreadPoolExecutor(1, name)
    thread.submit(int)
    return thread
