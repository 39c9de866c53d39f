"""What is asked of the system so that ticks are on time; what it refuses is logged, and the robot runs without it."""

import contextlib
import ctypes
import logging
import os
import sys
import threading
from pathlib import Path

log = logging.getLogger(__name__)

PRIORITY = 50
"""Real-time priority of the tick thread: the middle of the range 1 to 99."""
EVERY_TICK = ("tvist-publisher", "recorder")
"""Names of the threads that take the messages of every tick."""
CURRENT, FUTURE, ON_FAULT = 1, 2, 4
"""Flags of mlockall: pages in use, those to come, and each only from its first use on: unused stacks take nothing."""
CAP_IPC_LOCK = 14


def processors() -> int:
    """Return the number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def waited_us() -> float:
    """Return how long the calling thread, ready to run, has waited for a processor [µs]; 0 if that is not counted."""
    with contextlib.suppress(OSError):
        return int(Path("/proc/thread-self/schedstat").read_text().split()[1]) / 1e3
    return 0.0


def take_priority() -> bool:
    """Give the calling thread real-time priority (SCHED_FIFO); return whether it has it now.

    Those of `EVERY_TICK` come next. If another program took the processor from one that holds the interpreter's lock,
    the calling thread would wait for that program. What may take long, such as planning, stays behind other programs.
    """
    if sys.platform != "linux":
        log.warning("real-time priority is only for Linux, so the control loop runs at normal priority")
        return False
    try:
        # A thread that one of these starts, such as to write a file, inherits nothing.
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(PRIORITY))
        for thread in threading.enumerate():
            if thread.name in EVERY_TICK and thread.native_id is not None:
                with contextlib.suppress(ProcessLookupError):  # it has just ended
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


def lock_memory() -> bool:
    """Keep this process's memory from being swapped out; return whether it is locked now."""
    if sys.platform != "linux":
        log.warning("memory can be locked only on Linux, so the system may swap it out")
        return False
    import resource

    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    if limit != resource.RLIM_INFINITY and not _may_lock_all():
        # It might succeed now, and a later allocation would fail then.
        log.warning(
            "memory is not locked, so the system may swap it out: the limit (ulimit -l) is %d kB, and must be "
            "unlimited unless the process has CAP_IPC_LOCK",
            limit // 1024,
        )
        return False
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(CURRENT | FUTURE | ON_FAULT) != 0:
        why = os.strerror(ctypes.get_errno())
        log.warning("memory cannot be locked (%s), so the system may swap it out", why)
        return False
    return True


def bind(processor: int) -> bool:
    """Bind the calling thread to a processor; return whether it is bound now."""
    if sys.platform != "linux":
        log.warning("a thread can be bound to a processor only on Linux, so the control loop runs on any")
        return False
    try:
        os.sched_setaffinity(0, {processor})
    except OSError as error:
        here = ", ".join(map(str, sorted(os.sched_getaffinity(0))))
        log.warning(
            "the control loop cannot be bound to processor %d (%s), so it runs on any of %s",
            processor,
            error.strerror,
            here,
        )
        return False
    return True


def leave_processor(processor: int) -> bool:
    """Keep all threads of this process, and those that they start, off a processor; return whether they are now.

    To be called before the tick thread starts. Where there is no other processor they stay on it.
    """
    if sys.platform != "linux":
        return False
    here = os.sched_getaffinity(0)
    others = here - {processor}
    if processor not in here:  # the tick thread will say that it cannot be bound
        return False
    if not others:
        log.warning(
            "processor %d is the only one, so the control loop shares it with all other threads", processor
        )
        return False
    for thread in Path("/proc/self/task").iterdir():
        try:
            os.sched_setaffinity(int(thread.name), others)
        except ProcessLookupError:  # it has ended meanwhile
            continue
        except OSError as error:
            log.warning("other threads cannot be kept off processor %d (%s)", processor, error.strerror)
            return False
    return True


def _may_lock_all() -> bool:
    """Return whether this process has CAP_IPC_LOCK."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("CapEff:"):
            return bool(int(line.split()[1], 16) >> CAP_IPC_LOCK & 1)
    return False
