"""What runs tasks, whatever it is: the interface, and the order of results."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


class TaskError(Exception):
    """A task gave no result for a reason that is not an exception of the work itself; the message gives it."""


@dataclass(frozen=True)
class Failed:
    """Why a task gave no result."""

    error: Exception
    """What the work raised, or a `TaskError`."""


Outcome = tuple[int, Result | Failed]
"""Index of a task, and its result or failure."""


class Runner(Protocol):
    """Runs the same work on many tasks."""

    def run(self, work: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[Outcome[Result]]:
        """Yield an outcome for each task, in any order, each as soon as it is available.

        A task that fails, or cannot be pickled, gives a failure, and the others continue. No result depends on the
        order, on the number of processes, or on other tasks.

        Args:
            work: A module-level function; each task contains all it needs, and no state is kept between tasks.
            tasks: Tasks; they and their results are pickled. Each is taken from the sequence when its turn comes.

        Raises:
            OSError: The tasks cannot be run at all, such as without a scheduler; the message is a sentence.
        """


def in_order(runner: Runner, work: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[Result]:
    """Yield the results in the order of the tasks, each as soon as it and all before it are available.

    Args:
        runner: What runs the tasks.
        work: See `Runner.run`.
        tasks: See `Runner.run`.

    Raises:
        Exception: What the first task that failed has raised.
    """
    early: dict[int, Result | Failed] = {}
    following = 0
    for index, outcome in runner.run(work, tasks):
        early[index] = outcome
        while following in early:
            one = early.pop(following)
            if isinstance(one, Failed):
                raise one.error
            following += 1
            yield one
