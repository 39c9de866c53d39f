"""Work for the tests of runners, which other processes import."""

import os
import signal
from pathlib import Path


class OddError(Exception):
    """An exception that cannot be unpickled."""

    def __init__(self, first, second):
        super().__init__(f"{first} {second}")


def square_or_raise(number):
    if number % 10 == 7:
        raise KeyError(f"task {number}")
    if number % 10 == 8:
        raise OddError("odd", number)
    return (lambda: number) if number % 10 == 9 else number * number  # no function can be pickled


def die_once(task):
    """Kill the process that does it, the first time that it does task 5."""
    number, mark = task
    if number == 5 and not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def die(number):
    if number == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
