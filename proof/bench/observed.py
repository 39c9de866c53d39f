"""What clients cost that read every state of one robot over Zenoh, each over a connection of its own."""

import statistics
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil

from proof.bench.readers import readers
from tvist_lab.bench.one_robot import punctuality
from tvist_lab.served import served
from tvist_plant.plant import PERIOD

NUMBERS = (0, 10, 50)
"""Numbers of observers, besides the client that measures."""
ROUNDS = 3
"""Number of rounds of measurements, whose medians count."""
OF_ONE = 0.4
"""Time for each number, as a share of the time for one robot [-]."""
SHORTEST = 2.0
"""Shortest time of a measurement [s]: telemetry comes once a second."""


async def observed(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure the processor time of a robot without, with 10 and with 50 observers.

    Args:
        seconds: Duration of a measurement of one robot [s].
        tell: Called with a description of each measurement before it starts.
    """
    part = max(SHORTEST, OF_ONE * seconds / ROUNDS)
    shares: dict[int, list[float]] = {number: [] for number in NUMBERS}
    own: dict[int, list[float]] = {number: [] for number in NUMBERS}
    lost = received = 0
    missed = 0.0
    async with served([]) as server:
        await server.robot.state()
        for _ in range(ROUNDS):
            for number in NUMBERS:
                tell(f"a robot with {number} observers for {part:g} s")
                async with readers("observers", server.endpoint, "ur5e", str(number)) as said:
                    before = _python_seconds(server.pid)
                    tick, share = await punctuality(server, part)
                    own[number].append((_python_seconds(server.pid) - before) / part)
                shares[number].append(share)
                received += sum(one["received"] for one in said)
                lost += sum(one["lost"] for one in said)
                missed += tick["missed"]
    whole = {number: statistics.median(values) for number, values in shares.items()}
    python = {number: statistics.median(values) for number, values in own.items()}
    few, many = NUMBERS[1:]
    found = {
        **{f"cpu_share_{number}": whole[number] for number in NUMBERS},
        **{f"python_share_{number}": python[number] for number in NUMBERS},
        "us_per_observer_and_tick": 1e6 * PERIOD * (whole[many] - whole[few]) / (many - few),
        "missed": missed,
        "states_received": received,
        "states_lost": lost,
    }
    return {"observers": found}


def _python_seconds(pid: int) -> float:
    """Return the processor time of the threads that run Python [s]: these encode, and hand messages to Zenoh.

    They have the name of the process, and those of Zenoh have names of their own.
    """
    tasks = Path(f"/proc/{pid}/task")
    own = (tasks / str(pid) / "comm").read_text(encoding="utf-8")
    return sum(
        float(thread.user_time + thread.system_time)
        for thread in psutil.Process(pid).threads()
        if (tasks / str(thread.id) / "comm").read_text(encoding="utf-8") == own
    )
