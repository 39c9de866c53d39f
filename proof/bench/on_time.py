"""Missed ticks of a served robot beside those of a bare thread that sleeps to the same deadlines, in turn."""

import asyncio
import json
import os
import signal
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple

import numpy as np

from proof.bench.figure import CONFIDENCE
from proof.bench.readers import helper, readers
from tvist_lab.served import Served, served
from tvist_plant.plant import PERIOD

SEGMENT = 4.0
"""Duration of a segment [s]; with Zenoh's 2.5 s between signs of life it is shorter than its lease of 10 s, so that a
robot which is halted for one segment loses no client.
"""
SETTLE_TICKS = 200
"""Ticks after a halt that are not counted, as the robot makes up for some of the time."""
CLIENTS = 10
PUNCTUAL = ("--realtime-priority",)
"""What a robot can ask of the system; if it is refused, it runs without."""
STUDIES: Mapping[str, tuple[int, Sequence[str]]] = {
    "alone": (0, ()),
    "ten_clients": (CLIENTS, ()),
    "ten_clients_priority_asked_for": (CLIENTS, PUNCTUAL),
}
"""Number of clients besides the one that measures, and options of `tvist serve`."""
MOST_STOLEN = 1.0
"""Share of a segment's processor time that the host may give to others [%]; pairs with more do not count."""
RESAMPLES = 2000
TELL_EVERY = 60.0
"""Time between two reports of the progress [s]."""


class Pair(NamedTuple):
    """A segment of the robot and one of the bare thread."""

    robot: float
    """Ticks that the robot missed [% of those due]."""
    bare: float
    """Ticks that the bare thread missed [% of those due]."""
    stolen: float
    """Time that the host gave to others, in the segment that had more of it [% of the processors' time]."""


async def on_time(
    minutes: float, tell: Callable[[str], None], result: dict[str, dict[str, float]], only: Sequence[str]
) -> None:
    """Measure a served robot alone, then with ten clients that read every state, then so with `PUNCTUAL`.

    Segments of a robot and of the bare thread alternate, and each pair begins with the other. The robot's process is
    halted while the bare thread runs.

    Args:
        minutes: Duration of each measurement [min].
        tell: Called with a description of each measurement before it starts, and with its progress every minute.
        result: Gets what `compared` makes of each, also of one that is cancelled.
        only: Names of the measurements.
    """
    for name in only:
        clients, options = STUDIES[name]
        tell(f"{name}: {minutes:g} minutes, {clients} clients beside the one that measures")
        pairs: list[Pair] = []
        try:
            async with served(options) as server, _bare_thread() as bare:
                loaded = (
                    readers("observers", server.endpoint, "ur5e", str(clients)) if clients else nullcontext()
                )
                async with loaded:
                    await _in_turn(server, bare, 60.0 * minutes, pairs, tell)
        finally:
            if _counted(pairs):
                result[name] = compared(pairs)


def compared(pairs: Sequence[Pair]) -> dict[str, float]:
    """Return the means over pairs of whose time enough was ours, and the difference with its interval."""
    counted = _counted(pairs)
    robot, bare, _ = np.array(counted).T
    low, high = mean_interval(robot - bare, least=100.0 * PERIOD / SEGMENT)
    return {
        "pairs": len(counted),
        "dropped": len(pairs) - len(counted),
        "stolen_percent": float(np.mean([pair.stolen for pair in pairs])),
        "bare_percent": float(bare.mean()),
        "robot_percent": float(robot.mean()),
        "difference_points": float((robot - bare).mean()),
        "lower_end_points": low,
        "upper_end_points": high,
    }


def mean_interval(values: Sequence[float], least: float) -> tuple[float, float]:
    """Return the 95 % interval of the mean of independent values most of which are zero, by resampling.

    A sample knows nothing of what was too rare to happen in it: of a hundred zeros all resamples are zero. For each end
    the sample therefore has one further value, the farthest on that side, which is at least `least` from zero. Of n
    zeros the upper end is then `least` times 3 / n, as the rule of three says.

    Args:
        values: The values.
        least: Smallest distance from zero of a value that is not zero.
    """
    sample, chance = np.array(values), np.random.default_rng(0)
    tail = (1.0 - CONFIDENCE) / 2.0

    def end(further: float, level: float) -> float:
        drawn = np.append(sample, further)
        means = drawn[chance.integers(0, len(drawn), (RESAMPLES, len(drawn)))].mean(axis=1)
        return float(np.quantile(means, level))

    return end(min(sample.min(), -least), tail), end(max(sample.max(), least), 1.0 - tail)


def _counted(pairs: Sequence[Pair]) -> list[Pair]:
    return [pair for pair in pairs if pair.stolen <= MOST_STOLEN]


async def _in_turn(
    server: Served,
    bare: Callable[[], Awaitable[float]],
    seconds: float,
    pairs: list[Pair],
    tell: Callable[[str], None],
) -> None:
    """Add pairs for as long as there is time for a further one; one at least."""

    async def halted() -> float:
        # Two halts in a row would outlast the lease: between them the robot reads what has come.
        await server.robot.advance(SETTLE_TICKS)
        os.kill(server.pid, signal.SIGSTOP)
        try:
            return await bare()
        finally:
            os.kill(server.pid, signal.SIGCONT)

    began = told = time.monotonic()
    while not pairs or time.monotonic() - began < seconds:
        if time.monotonic() - told >= TELL_EVERY:
            told = time.monotonic()
            tell(f"minute {(told - began) / 60.0:.0f} of {seconds / 60.0:g}: {_so_far(pairs)}")
        if len(pairs) % 2 == 0:
            robot, thread = await _segment(_missed(server)), await _segment(halted())
        else:
            thread, robot = await _segment(halted()), await _segment(_missed(server))
        pairs.append(Pair(robot[0], thread[0], max(robot[1], thread[1])))


async def _segment(measured: Awaitable[float]) -> tuple[float, float]:
    """Return what is measured, and the share of the processors' time that was stolen meanwhile [%]."""
    stolen, total = _processors()
    value = await measured
    stolen_then, total_then = _processors()
    return value, 100.0 * (stolen_then - stolen) / max(1, total_then - total)


async def _missed(server: Served) -> float:
    """Return the ticks that the robot misses in a segment [% of those due]."""
    await server.robot.advance(SETTLE_TICKS)
    before = await server.robot.state()
    await asyncio.sleep(SEGMENT)
    after = await server.robot.state()
    missed = after.missed_ticks - before.missed_ticks
    # Of a halt of seconds most ticks are left out, which `missed` has and the number of the tick has not.
    return 100.0 * missed / max(after.tick - before.tick, missed)


@asynccontextmanager
async def _bare_thread() -> AsyncIterator[Callable[[], Awaitable[float]]]:
    async with helper("bare_thread", str(SEGMENT)) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        told, answers = process.stdin, process.stdout

        async def measure() -> float:
            told.write(b"\n")
            counted = json.loads(await answers.readline())
            return float(100.0 * counted["missed"] / counted["ticks"])

        yield measure


def _processors() -> tuple[int, int]:
    """Return the processors' stolen and whole time since the start of the system; zeros where it does not say."""
    try:
        first = Path("/proc/stat").read_text(encoding="ascii").splitlines()[0]
    except FileNotFoundError:
        return 0, 0
    times = [int(word) for word in first.split()[1:9]]
    return times[7], sum(times)


def _so_far(pairs: Sequence[Pair]) -> str:
    counted = _counted(pairs)
    robot, bare = sum(pair.robot for pair in counted), sum(pair.bare for pair in counted)
    return (
        f"{len(counted)} pairs, {len(pairs) - len(counted)} dropped; missed by the robot "
        f"{robot / max(1, len(counted)):.3g} %, by the thread {bare / max(1, len(counted)):.3g} %"
    )
