"""Run work on every core, with results that do not depend on the number of cores."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

FEW = 8
"""Largest number of tasks that are done in this process, since starting others takes seconds."""


def spread(
    work: Callable[[Task], Result], tasks: Sequence[Task], *, few: int = FEW, chunk: int = 4
) -> Iterator[Result]:
    """Yield the results in the order of the tasks, each as soon as it is available.

    Args:
        work: A module-level function; each task contains all it needs, and no state is kept between tasks.
        tasks: Tasks; they and their results are pickled.
        few: Largest number of tasks for which no process is started.
        chunk: Number of tasks that a process takes at a time.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if cores == 1 or len(tasks) <= few:
        yield from map(work, tasks)
        return
    # Control+C reaches all processes of a terminal; this one ends the others, which ignore it.
    ignored = (signal.SIGINT, signal.SIG_IGN)
    with multiprocessing.get_context("spawn").Pool(min(cores, len(tasks)), signal.signal, ignored) as pool:
        yield from pool.imap(work, tasks, chunk)
