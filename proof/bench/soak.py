"""Long-term stability: a robot in real time for minutes, under a load like that of a laboratory.

The processes are as in reality: the robot with its recorder is one; a client that streams set-points and sends one
command per second is this process; five observers, each with its own connection, share a third one.
"""

import asyncio
import math
import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from statistics import median
from typing import Any

from mcap.reader import make_reader

from proof.bench.readers import readers
from tvist_client.arm import Arm
from tvist_client.errors import StreamStoppedError
from tvist_client.servo import Servo
from tvist_lab.bench.one_robot import cpu_seconds, missed_share, over_all, rss_mb
from tvist_lab.served import Served, served
from tvist_plant.plant import PERIOD
from tvist_protocol.recorded import END_METADATA, TICK_NS
from tvist_protocol.stream import Telemetry

OBSERVERS = 5
SWING = 0.2
"""Amplitude of the streamed sine [rad]."""
CYCLE = 4.0
"""Period of the sine [s]."""
WARM = 60.0
"""Time at which memory is measured for comparison [s]; in a short soak, a quarter of its duration."""


async def soak(minutes: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Serve a robot and monitor it.

    Args:
        minutes: Duration of the run [min].
        tell: Called every minute with the present counts.

    Returns:
        Counts of missed, late and lost messages, and the resources used.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "soak.mcap"
        async with (
            served(["--record", str(path)]) as server,
            _observed(server) as observed,
        ):
            watch = _Watch(server, 60.0 * minutes, tell)
            result = await watch.run()
        return result | _observers(observed) | _recording(path)


class _Watch:
    def __init__(self, server: Served, seconds: float, tell: Callable[[str], None]) -> None:
        self._server, self._seconds, self._tell = server, seconds, tell
        self._heard: list[Telemetry] = []
        self._memory: list[float] = []
        """Memory at every second [MB]."""

    async def run(self) -> dict[str, Any]:
        robot, pid = self._server.robot, self._server.pid
        await robot.state()
        forget = robot.on_telemetry(self._on_telemetry)
        async with robot.control("soak") as arm:
            before = await robot.state()
            used, began = cpu_seconds(pid), time.monotonic()
            commands = asyncio.create_task(self._commands(arm))
            sent, stopped = await self._stream(arm, began)
            after = await robot.state()
            share = (cpu_seconds(pid) - used) / (time.monotonic() - began)
            commands.cancel()
        forget()
        ticks, missed = after.tick - before.tick, after.missed_ticks - before.missed_ticks
        last = self._heard[-1]
        warm = round(min(WARM, self._seconds / 4))
        first, at_end = median(self._memory[warm : warm + 10]), median(self._memory[-10:])
        return {
            "minutes": self._seconds / 60.0,
            "ticks": ticks,
            "missed": missed,
            "missed_percent": 100.0 * missed_share(self._heard),
            **over_all(self._heard),
            "rss_mb_warm": first,
            "rss_mb": at_end,
            "memory_growth_percent": 100.0 * (at_end / first - 1.0),
            "cpu_share": share,
            "setpoints_sent": sent,
            "streams_stopped": stopped,
            "setpoints_received": last.setpoints_received,
            "setpoints_lost": last.setpoints_lost,
            "setpoints_late": last.setpoints_late,
            "setpoints_limited": last.setpoints_limited,
            "commands": last.commands,
            "dropped_states": last.dropped_states,
        }

    def _on_telemetry(self, telemetry: Telemetry) -> None:
        self._heard.append(telemetry)
        self._memory.append(rss_mb(self._server.pid))
        if len(self._heard) % 60 == 0:
            late = over_all(self._heard[-60:])
            self._tell(
                f"minute {len(self._heard) // 60}: {telemetry.missed_ticks} ticks missed in all, late p99 "
                f"{late['late_p99_us']:.0f} µs, largest {late['late_max_us']:.0f} µs, {self._memory[-1]:.1f} MB"
            )

    async def _stream(self, arm: Arm, began: float) -> tuple[int, int]:
        """Stream a sine at 500 Hz; return the number of set-points, and how often the robot itself ended the stream."""
        sent = stopped = 0
        while time.monotonic() < began + self._seconds:
            middle = list((await arm.robot.rest()).target_q)
            try:
                async with arm.servo(period=PERIOD) as servo:
                    await self._swing(servo, middle, began + self._seconds)
            except StreamStoppedError:
                stopped += 1
            sent += servo.sequence
        return sent, stopped

    @staticmethod
    async def _swing(servo: Servo, middle: list[float], until: float) -> None:
        began = time.monotonic()
        while (now := time.monotonic()) < until:
            # The square of the sine starts with zero velocity and returns to the middle.
            swing = SWING * math.sin(math.pi * servo.sequence * PERIOD / CYCLE) ** 2
            servo.set([angle + swing for angle in middle])
            await asyncio.sleep(max(0.0, began + servo.sequence * PERIOD - now))

    @staticmethod
    async def _commands(arm: Arm) -> None:
        while True:
            await asyncio.sleep(1.0)
            await arm.keep_alive()


def _observed(server: Served) -> AbstractAsyncContextManager[list[dict[str, int]]]:
    """Run observers in a process; the list contains their final counts."""
    return readers("observers", server.endpoint, "ur5e", str(OBSERVERS))


def _observers(observed: list[dict[str, int]]) -> dict[str, int]:
    return {
        "observers": len(observed),
        "states_observed": sum(one["received"] for one in observed),
        "states_lost_by_observers": sum(one["lost"] for one in observed),
    }


def _recording(path: Path) -> dict[str, int]:
    """Return what the recording lacks: gaps between its states, and messages that the recorder counted as dropped."""
    recorded = gaps = 0
    last: int | None = None
    with path.open("rb") as stream:
        reader = make_reader(stream)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            if not channel.topic.endswith("/state"):
                continue
            tick = message.log_time // TICK_NS
            gaps += 0 if last is None else tick - last - 1
            last, recorded = tick, recorded + 1
        dropped = sum(
            sum(map(int, metadata.metadata.values()))
            for metadata in reader.iter_metadata()
            if metadata.name == END_METADATA
        )
    return {"states_recorded": recorded, "samples_lost": gaps + dropped}
