"""Cost of filters in a tick of the whole line: each divided by that of `auto`."""

import gc
import time
from collections.abc import Callable

import numpy as np

from tvist_controller.api import LoopbackHost
from tvist_lab.benchmark.in_turn import mean_and_interval
from tvist_lab.in_process import free_setup
from tvist_lab.paper.published import pose
from tvist_protocol.codec import encode
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.simulation import SimulationReset, SimulationStep

COMPARED = ("zv", "elastic", "elastic-auto")
TICKS = 500
"""Number of ticks of a run, all of them in motion."""
PAIRS = 30
"""Number of rounds, in each of which every filter has one run."""


def shapers(tell: Callable[[str], None]) -> dict[str, float]:
    """Return the time per tick with `auto` [µs], and for each other filter its ratio and half of its 95 % interval.

    Args:
        tell: Called with a description of the measurement before it starts.
    """
    tell("filters")
    robots = {name: _Moving(name) for name in ("auto", *COMPARED)}
    names = list(robots)
    taken: dict[str, list[float]] = {name: [] for name in names}
    for number in range(-1, PAIRS):  # the first round loads what is compiled
        for name in names if number % 2 else reversed(names):
            seconds = robots[name].run()
            if number >= 0:
                taken[name].append(seconds)
    base = np.array(taken["auto"])
    found = {"auto_us_per_tick": 1e6 * float(base.min()) / TICKS}
    for name in COMPARED:
        ratio, half = mean_and_interval(np.array(taken[name]) / base)
        key = name.replace("-", "_")
        found |= {f"{key}_ratio": ratio, f"{key}_interval": half}
    return found


class _Moving:
    """A robot in process with a filter."""

    def __init__(self, shaper: str) -> None:
        self._host = LoopbackHost(free_setup(truth=False, shaper=shaper))
        self._host.subscribe("state", len)
        self._host.request("bench", encode(TakeControl(client="bench")))
        lease = self._host.controller.session.lease
        self._token = lease.token if lease else ""

    def run(self) -> float:
        """Return the time that the ticks of a motion take [s]."""
        token = self._token
        self._host.request("bench", encode(SimulationReset(token=token, q=pose("Q1"))))
        self._host.request("bench", encode(MoveJ(token=token, q=pose("Q3"))))
        step = encode(SimulationStep(token=token, ticks=TICKS))
        gc.collect()
        began = time.thread_time()
        self._host.request("bench", step)
        return time.thread_time() - began
