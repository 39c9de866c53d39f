"""Compare the missed ticks of a served robot with those of a bare thread that sleeps to the same deadlines, in turn."""

import os
import signal
import time
from asyncio.subprocess import Process
from collections.abc import Sequence
from contextlib import AsyncExitStack

import numpy as np

from benchmarks.figure import CONFIDENCE, Tell
from benchmarks.helpers import asked, helper
from tvist_lab.bench.served_robots import punctuality
from tvist_lab.served import RunningServer, served
from tvist_plant.plant import PERIOD

SEGMENT = 4.0
"""Longest segment [s]; a robot that is halted for a segment responds before Zenoh's lease of 10 s expires."""
SETTLE_TICKS = 200  # ticks after a halt that do not count, since the robot makes up for some of the time
STUDIES = {"alone": 0, "ten_clients": 10}


async def lateness(seconds: float, tell: Tell) -> dict[str, dict[str, dict[str, float]]]:
    """Measure a served robot alone and with ten clients; its process is halted while the bare thread runs."""
    found, segment = {}, min(SEGMENT, max(2.0, seconds))
    for name, clients in STUDIES.items():
        tell(f"ticks that a robot misses, {name}, beside a bare thread's")
        pairs = list[tuple[float, float]]()
        async with AsyncExitStack() as running:
            server = await running.enter_async_context(served([]))
            bare = await running.enter_async_context(helper("bare_thread"))
            if clients:
                readers = helper("observers", server.endpoint, "ur5e", str(clients))
                await running.enter_async_context(readers)
            ends = time.monotonic() + seconds
            while not pairs or time.monotonic() < ends:
                pairs.append((await _robot(server, segment), await _thread(server, bare, segment)))
        found[name] = compared(pairs, segment)
    return {"lateness": found}


async def _robot(server: RunningServer, segment: float) -> float:
    """Return the ticks that the robot misses in a segment [% of those due]."""
    await server.robot.advance(SETTLE_TICKS)
    tick, _ = await punctuality(server, segment)
    return 100.0 * tick["missed"] / max(tick["missed"], segment / PERIOD)


async def _thread(server: RunningServer, bare: Process, segment: float) -> float:
    """Return the ticks the bare thread misses in a segment [% of those due], while the robot is halted."""
    # Two halts in a row would outlast the lease, so the robot reads its messages between them.
    await server.robot.advance(SETTLE_TICKS)
    os.kill(server.pid, signal.SIGSTOP)
    try:
        return await asked(bare, f"{segment:g}")
    finally:
        os.kill(server.pid, signal.SIGCONT)


def compared(pairs: Sequence[tuple[float, float]], segment: float) -> dict[str, float]:
    """Return mean missed ticks of robot and thread over pairs [%], and the interval of their difference."""
    robot, bare = np.array(pairs).T
    low, high = mean_interval(robot - bare, least=100.0 * PERIOD / segment)
    return {
        "pairs": len(pairs),
        "bare_percent": float(bare.mean()),
        "robot_percent": float(robot.mean()),
        "difference_points": float((robot - bare).mean()),
        "lower_end_points": low,
        "upper_end_points": high,
    }


def mean_interval(values: Sequence[float], least: float) -> tuple[float, float]:
    """Return the 95 % interval, by resampling, of the mean of independent values most of which are zero.

    No resample contains events too rare to have occurred. So for each end the sample gets one further value,
    the farthest on that side, at least `least` from zero. For n zeros the end is then `least` times 3 / n
    (the rule of three).
    """
    sample, chance = np.array(values), np.random.default_rng(0)
    tail = (1.0 - CONFIDENCE) / 2.0

    def end(further: float, level: float) -> float:
        drawn = np.append(sample, further)
        means = drawn[chance.integers(0, len(drawn), (2000, len(drawn)))].mean(axis=1)
        return float(np.quantile(means, level))

    return end(min(sample.min(), -least), tail), end(max(sample.max(), least), 1.0 - tail)
