"""Shares of the boxes by samples: a timer of the processor's time interrupts the untouched program.

Python looks for signals between two instructions, so the time of a call into compiled code counts for the function that
made it.
"""

import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import CodeType, FrameType, FunctionType

from tvist_lab.benchmark.box_timer import NOWHERE, BoxTimer, found
from tvist_lab.benchmark.moving import MovingRobot

EVERY = 0.001
"""Processor time between two samples [s]; systems with a coarser timer take fewer."""


def sampled_shares(robot: MovingRobot, timer: BoxTimer, samples: int) -> Sequence[float | None]:
    """Return the share of each box itself, without its parts; None for boxes that are no Python functions.

    Args:
        robot: Robot whose motion is repeated until there are enough samples.
        timer: Has the boxes; it is not attached.
        samples: Number of samples.
    """
    codes = {
        code: number
        for number, box in enumerate(timer.boxes)
        for place in found(box)
        if (code := _code(vars(place.owner)[place.name])) is not None
    }
    seen = [0] * len(timer.boxes)
    while sum(seen) < samples:
        robot.begin()
        with _sampling(codes, timer.within, seen):
            robot.go()
    reachable = set(codes.values())
    return [count / sum(seen) if number in reachable else None for number, count in enumerate(seen)]


def _code(function: object) -> CodeType | None:
    return function.__code__ if isinstance(function, FunctionType) else None


@contextmanager
def _sampling(codes: dict[CodeType, int], within: Sequence[int], seen: list[int]) -> Iterator[None]:
    def sample(_: int, frame: FrameType | None) -> None:
        stack: list[int] = []
        while frame is not None:
            number = codes.get(frame.f_code)
            if number is not None:
                stack.append(number)
            frame = frame.f_back
        present = NOWHERE
        for number in reversed(stack):  # from the outermost function on
            if within[number] == present:
                present = number
        if present != NOWHERE:
            seen[present] += 1

    before = signal.signal(signal.SIGPROF, sample)
    signal.setitimer(signal.ITIMER_PROF, EVERY, EVERY)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
