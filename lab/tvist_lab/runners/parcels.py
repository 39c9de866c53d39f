"""Tasks and outcomes as bytes, so that one that cannot be pickled fails alone, whoever carries it."""

import pickle
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from tvist_lab.runners.interface import Failed, Result, Task, TaskError
from tvist_plant.user_file import named

UNPICKLABLE = (pickle.PicklingError, TypeError, AttributeError, ValueError, RecursionError)
"""What `pickle.dumps` raises for what it cannot pickle."""


def pack(task: object) -> bytes | Failed:
    """Pickle a task."""
    try:
        return pickle.dumps(task)
    except UNPICKLABLE as error:
        return Failed(TaskError(f"it cannot be pickled: {named(error)}"))


def attempt(work: Callable[[Task], Result], task: Task) -> Result | Failed:
    """Do a task in this process."""
    try:
        return work(task)
    except Exception as error:  # noqa: BLE001  any failure is this task's alone
        return Failed(error)


def do(work: Callable[[Any], Any], packed: Sequence[bytes]) -> list[bytes]:
    """Do tasks in a process for work: unpickle each, do it, and pickle its outcome."""
    return [_do(work, one) for one in packed]


def unpack(packed: bytes) -> Any:
    """Return a result or a failure."""
    return pickle.loads(packed)  # noqa: S301  it comes from a process that does the user's own work


def _do(work: Callable[[Any], Any], packed: bytes) -> bytes:
    try:
        outcome = work(unpack(packed))
    except Exception as error:  # noqa: BLE001  likewise
        outcome = Failed(_portable(error))
    try:
        return pickle.dumps(outcome)
    except UNPICKLABLE as error:
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
