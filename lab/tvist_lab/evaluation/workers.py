"""Run work on every core, with results that do not depend on the number of cores."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")

FEW = 8
"""So many tasks are done in this process: to start others takes seconds."""


def spread(
    work: Callable[[Task], Result], tasks: Sequence[Task], *, few: int = FEW, chunk: int = 4
) -> Iterator[Result]:
    """Results in the order of the tasks, each as soon as it is there.

    Args:
        work: A function of a module; each task has all that it needs, and nothing is kept between them.
        tasks: They and their results travel between processes.
        few: Up to this many tasks no process is started.
        chunk: Tasks that a process takes at a time.
    """
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if cores == 1 or len(tasks) <= few:
        yield from map(work, tasks)
        return
    # Control+C reaches every process of a terminal: this one ends the others, which say nothing.
    ignored = (signal.SIGINT, signal.SIG_IGN)
    with multiprocessing.get_context("spawn").Pool(min(cores, len(tasks)), signal.signal, ignored) as pool:
        yield from pool.imap(work, tasks, chunk)
