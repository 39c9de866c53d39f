"""Processes of this machine for work of seconds: quick to start."""

import multiprocessing
import multiprocessing.resource_tracker
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from tvist_lab.runners.interface import Failed, Outcome, Result, Task
from tvist_lab.runners.parcels import attempt, do, pack, unpack
from tvist_server.ending import end_with_parent, signals_held
from tvist_server.punctual import processors

AHEAD = 4
"""Number of chunks handed out for each process, so that none waits for the next one."""


OF_TERMINAL = {signal.SIGINT, signal.SIGHUP, signal.SIGQUIT}
"""Signals that reach all processes of a terminal, from its keys or at its end; the first process ends the others."""


def begin() -> None:
    """Let this process end when the one that hands out the work does, and not before."""
    for number in OF_TERMINAL:
        signal.signal(number, signal.SIG_IGN)
    end_with_parent()


def start_tracker() -> None:
    """Start the process by which multiprocessing cleans up, so that a closed terminal does not end it.

    By itself it ignores Control+C alone; it inherits what this thread has blocked.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, OF_TERMINAL)
    try:
        multiprocessing.resource_tracker.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@dataclass(frozen=True)
class Processes:
    """Runs tasks on all cores of this machine, in processes that end with the run.

    A process that dies ends the run: use `tvist_lab.runners.cluster.Cluster` for work that has to survive it.
    """

    few: int = 8
    """Largest number of tasks that are done in this process, since starting others takes seconds."""
    chunk: int = 4
    """Number of tasks that a process takes at a time."""

    def run(self, work: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[Outcome[Result]]:
        """Yield an outcome for each task; see `Runner.run`.

        Raises:
            ChildProcessError: A process died, such as for want of memory.
        """
        processes = min(processors(), len(tasks))
        if processes <= 1 or len(tasks) <= self.few:
            for index, task in enumerate(tasks):
                yield index, attempt(work, task)
            return
        start_tracker()
        others = set(multiprocessing.active_children())
        pool = ProcessPoolExecutor(processes, multiprocessing.get_context("spawn"), begin)
        done = False
        try:
            yield from self._through(pool, work, tasks, AHEAD * processes)
            done = True
        except BrokenProcessPool:
            raise ChildProcessError("a process died while it did a task; perhaps memory ran out") from None
        finally:
            if not done:  # what the processes still do is of no use
                for process in set(multiprocessing.active_children()) - others:
                    process.terminate()
            # Without waiting, the pool's thread may meet the end of this process half way.
            pool.shutdown(cancel_futures=True)

    def _through(
        self,
        pool: ProcessPoolExecutor,
        work: Callable[[Task], Result],
        tasks: Sequence[Task],
        most: int,
    ) -> Iterator[Outcome[Result]]:
        """Hand out chunks, at most so many at a time, and yield what comes back."""
        out: dict[Future[list[bytes]], list[int]] = {}
        for first in range(0, len(tasks), self.chunk):
            indices, packed = [], []
            for index in range(first, min(first + self.chunk, len(tasks))):
                one = pack(tasks[index])
                if isinstance(one, Failed):
                    yield index, one
                else:
                    indices.append(index)
                    packed.append(one)
            with signals_held():  # this may start a process, which would not get all that it needs to begin
                out[pool.submit(do, work, packed)] = indices
            if len(out) >= most:
                yield from _arrived(out)
        while out:
            yield from _arrived(out)


def _arrived(out: dict[Future[list[bytes]], list[int]]) -> Iterator[Outcome[Result]]:
    """Wait for a chunk, and yield the outcomes of all that have arrived."""
    for future in wait(out, return_when=FIRST_COMPLETED).done:
        yield from zip(out.pop(future), map(unpack, future.result()), strict=True)
