"""Run the same work on many tasks with any executor: processes of this machine, or a cluster."""

import multiprocessing
import multiprocessing.resource_tracker
import pickle
import signal
import traceback
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, TypeVar

from tvist_plant.user_file import named
from tvist_server.punctual import processors
from tvist_server.shutdown import end_with_parent

Task = TypeVar("Task")
Result = TypeVar("Result")

AHEAD = 1024
"""Largest number of tasks handed out at a time: more than a cluster has processes, but few enough for the memory."""
OF_GROUP = {signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM}
"""Signals that a terminal or supervisor sends to a whole process group; only the first process acts on them."""


class TaskError(Exception):
    """A task gave no result for a reason other than an exception of the work itself."""


@dataclass(frozen=True)
class Failed:
    """The outcome of a task that gave no result."""

    error: Exception  # exception of the work, or a `TaskError`


def outcomes(
    executor: Executor, work: Callable[[Task], Result], tasks: Iterable[Task]
) -> Iterator[tuple[int, Result | Failed]]:
    """Yield the index of each task with its result or failure, as soon as available, in any order.

    `work` is a module-level function without state; tasks and results are pickled. A task that fails or
    cannot be pickled gives a failure, and the others continue. Results do not depend on order, number of
    processes or other tasks. Raises ChildProcessError if a process of a pool died, for example for lack of
    memory; ConnectionError if the executor dropped a task, as a cluster without its scheduler does.
    """
    out: dict[Future[bytes], int] = {}
    arrived: SimpleQueue[Future[bytes]] = SimpleQueue()

    def next_outcome() -> tuple[int, Result | Failed]:
        future = arrived.get()
        return out.pop(future), _outcome(future)

    try:
        for index, task in enumerate(tasks):
            try:
                packed = pickle.dumps(task)
            except Exception as error:  # noqa: BLE001  what a task contains may raise anything
                yield index, Failed(TaskError(f"it cannot be pickled: {named(error)}"))
                continue
            with _group_signals_blocked():  # also in a process that starts here, until it ignores signals
                future = executor.submit(_attempt, work, packed)
            out[future] = index
            future.add_done_callback(arrived.put)
            if len(out) == AHEAD:
                yield next_outcome()
        while out:
            yield next_outcome()
    except BrokenExecutor:
        raise ChildProcessError(
            "a worker process ended during a task; perhaps memory ran out: give fewer --processes"
        ) from None
    except CancelledError:
        raise ConnectionError("the executor has dropped its tasks; perhaps its scheduler has gone") from None


class InlineExecutor(Executor):
    """Runs each task at once in this process, since starting others takes seconds."""

    def submit(self, work: Callable[..., Result], /, *args: Any, **kwargs: Any) -> "Future[Result]":
        """Run a task."""
        future: Future[Result] = Future()
        future.set_result(work(*args, **kwargs))
        return future


@contextmanager
def processes(number: int | None = None) -> Iterator[Executor]:
    """Start `number` processes on this machine, by default one per core; they always end with the block."""
    with _group_signals_blocked():  # the process by which multiprocessing cleans up must outlive this one
        multiprocessing.resource_tracker.ensure_running()
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(number or processors(), multiprocessing.get_context("spawn"), _begin)
    try:
        yield pool
    except BaseException:  # the results of running tasks are no longer needed
        for process in set(multiprocessing.active_children()) - others:
            process.kill()
        raise
    finally:
        # Wait, since otherwise this process might end while the pool's thread still runs.
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    """Let this process ignore signals to its group, and end only when the process that started it ends."""
    for number in OF_GROUP:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, OF_GROUP)
    end_with_parent()


@contextmanager
def _group_signals_blocked() -> Iterator[None]:
    """Delay signals while the block runs; processes started by the block delay them, too."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, OF_GROUP)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _attempt(work: Callable[[Any], Any], packed: bytes) -> bytes:
    """Unpickle a task in a worker, run it, and pickle the outcome."""
    try:
        outcome = work(pickle.loads(packed))  # noqa: S301  it comes from the process that started this one
    except Exception as error:  # noqa: BLE001  any failure is this task's alone
        outcome = Failed(_portable(error))
    try:
        return pickle.dumps(outcome)
    except Exception as error:  # noqa: BLE001  likewise
        return pickle.dumps(Failed(TaskError(f"its result cannot be pickled: {named(error)}")))


def _portable(error: Exception) -> Exception:
    """Return an error that survives pickling, with its traceback as a note."""
    lines = "".join(traceback.format_exception(error))
    try:
        pickle.loads(pickle.dumps(error))  # noqa: S301  these bytes are our own
    except Exception:  # noqa: BLE001  a constructor may raise anything
        error = TaskError(named(error))
    error.add_note(f"In the process that did the task:\n{lines}")
    return error


def _outcome(future: Future[bytes]) -> Any:
    """Return the result or failure of a finished task.

    Raises BrokenExecutor if the executor no longer works, CancelledError if it dropped the task.
    """
    try:
        return pickle.loads(future.result())  # noqa: S301  it comes from a process that does the user's own work
    except (BrokenExecutor, CancelledError):
        raise
    except Exception as error:  # noqa: BLE001  a worker that cannot do the work at all
        return Failed(error)
