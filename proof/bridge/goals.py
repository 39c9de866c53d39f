"""Where the programs go that are written for a robot, and how those that stream get there."""

import math
import random
from collections.abc import Iterator

HOME = [-1.6, -1.6, -1.7, -1.4, 1.6, 0.0]
"""Where they begin, with room below [rad]."""
TURNS = ((0.4, 0.9), (0.1, 0.3), (0.2, 0.45))
"""Least and largest turn of the three large joints [rad]."""
SPEED, ACCELERATION = 1.5, 2.0
"""Of motions of joints [rad/s, rad/s²]."""
WAIT_S = 1.2
"""Time at rest after each motion, in which the tool rings [s]."""


def goals(seed: int) -> Iterator[list[float]]:
    """Draw postures around `HOME`, and `HOME` between them."""
    draw = random.Random(seed)  # noqa: S311  motions, no secrets
    for number in range(3):
        turns = [draw.choice((-1, 1)) * draw.uniform(*turn) for turn in TURNS]
        away = [angle + turn for angle, turn in zip(HOME, turns, strict=False)]
        yield list(HOME) if number % 2 else [*away, *HOME[3:]]


def trapezoid(start: list[float], goal: list[float], period: float) -> Iterator[list[float]]:
    """Sample a motion that speeds up, goes on and slows down evenly, without `start` and `goal` themselves."""
    way = max(abs(b - a) for a, b in zip(start, goal, strict=True))
    up = min(SPEED / ACCELERATION, math.sqrt(way / ACCELERATION))
    whole = up + way / (ACCELERATION * up)
    length = up * (whole - up)
    for number in range(1, math.ceil(whole / period)):
        t = number * period
        begun, left = (0.5 * min(one, up) ** 2 + up * max(one - up, 0.0) for one in (t, whole - t))
        share = begun / length if t < whole / 2 else 1.0 - left / length
        yield [a + share * (b - a) for a, b in zip(start, goal, strict=True)]
