"""Work for the tests of runners, which other processes import."""

import os
import signal


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


def die(number):
    if number == 5:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number
