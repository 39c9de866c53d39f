"""Missed ticks of a served robot beside those of a bare thread that sleeps to the same deadlines, in turn."""

import asyncio
import json
import os
import signal
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager, nullcontext

import numpy as np
from scipy import stats

from proof.bench.readers import helper, readers
from tvist_lab.bench.one_robot import missed_share
from tvist_lab.served import Served, served
from tvist_plant.plant import PERIOD
from tvist_protocol.stream import Telemetry

SEGMENT = 4.0
"""Duration of a segment [s]: shorter than Zenoh's lease, so that a robot which is halted meanwhile loses no client."""
SETTLE_TICKS = 200
"""Ticks after a halt that are not counted, as the robot makes up for some of the time."""
CLIENTS = 10
PUNCTUAL = ("--realtime-priority", "--lock-memory")
"""What a robot can ask of the system; if it is refused, it runs without."""
STUDIES: tuple[tuple[str, int, Sequence[str]], ...] = (
    ("alone", 0, ()),
    ("ten_clients", CLIENTS, ()),
    ("ten_clients_priority_asked_for", CLIENTS, PUNCTUAL),
)
"""Name, number of clients besides the one that measures, and options of `tvist serve`."""


async def on_time(minutes: float, tell: Callable[[str], None]) -> dict[str, dict[str, float]]:
    """Measure a served robot alone, then with ten clients that read every state, then so with `PUNCTUAL`.

    Segments of a robot and of the bare thread alternate, and each pair begins with the other. The robot's process is
    halted while the bare thread runs.

    Args:
        minutes: Duration of each of the three measurements [min].
        tell: Called with a description of each measurement before it starts.

    Returns:
        For each, in percent of the ticks due: missed ones of the bare thread and of the robot, the mean difference over
        pairs, and the upper end of its 95 % interval (Student).
    """
    pairs = max(2, round(60.0 * minutes / (2.0 * SEGMENT)))
    result = {}
    for name, clients, options in STUDIES:
        tell(f"{pairs} pairs of {SEGMENT:g} s, {clients} clients beside the one that measures")
        async with served(options) as server, _bare_thread() as bare:
            loaded = readers("observers", server.endpoint, "ur5e", str(clients)) if clients else nullcontext()
            async with loaded:
                result[name] = await _in_turn(server, bare, pairs)
    return result


async def _in_turn(
    server: Served, bare: Callable[[], "asyncio.Future[float]"], pairs: int
) -> dict[str, float]:
    robots, threads = [], []
    for pair in range(pairs):
        for robot in (True, False) if pair % 2 == 0 else (False, True):
            if robot:
                robots.append(await _robot_missed(server))
                continue
            os.kill(server.pid, signal.SIGSTOP)
            try:
                threads.append(await bare())
            finally:
                os.kill(server.pid, signal.SIGCONT)
            await server.robot.advance(SETTLE_TICKS)  # its next halt begins a lease of its own
    missed, of_thread = np.array(robots), np.array(threads)
    differences = missed - of_thread
    difference = float(differences.mean())
    half = float(stats.t.ppf(0.975, pairs - 1) * differences.std(ddof=1) / np.sqrt(pairs))
    return {
        "pairs": pairs,
        "bare_percent": float(of_thread.mean()),
        "robot_percent": float(missed.mean()),
        "difference_points": difference,
        "upper_end_points": difference + half,
    }


async def _robot_missed(server: Served) -> float:
    """Percentage of the ticks due in a segment that the robot missed."""
    await server.robot.advance(SETTLE_TICKS)
    heard: list[Telemetry] = []
    forget = server.robot.on_telemetry(heard.append)
    await server.robot.advance(round(SEGMENT / PERIOD))
    while len(heard) < 2:  # it comes once a second
        await server.robot.advance(SETTLE_TICKS)
    forget()
    return 100.0 * missed_share(heard)


@asynccontextmanager
async def _bare_thread() -> AsyncIterator[Callable[[], "asyncio.Future[float]"]]:
    async with helper("bare_thread", str(SEGMENT)) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        told, answers = process.stdin, process.stdout

        async def measure() -> float:
            told.write(b"\n")
            counted = json.loads(await answers.readline())
            return float(100.0 * counted["missed"] / counted["ticks"])

        yield lambda: asyncio.ensure_future(measure())
