"""What clients of UR's interfaces cost a served robot."""

import asyncio
import json
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from tvist_lab.benchmark.lateness import over_all
from tvist_lab.benchmark.process import cpu_seconds
from tvist_lab.served import Served, served
from tvist_plant.plant import PERIOD
from tvist_protocol.stream import Telemetry

CLIENTS = 10
"""Of RTDE, at 500 Hz, each with a recipe of its own."""
ADDRESS = "127.0.0.1"


async def ur_doors(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Watch a robot without clients at its doors, and with ten that read every tick.

    Args:
        seconds: How long, each time.
        tell: Told of what is measured next.
    """
    port = _free_port()
    shut = ("dashboard", "primary", "secondary", "realtime")
    doors = [*shut, *(f"{name}_read_only" for name in shut[1:])]
    options = ["--ur", "--ur-port", f"rtde={port}"]
    for door in doors:
        options += ["--ur-port", f"{door}=off"]
    async with served(options) as server:
        await server.robot.state()
        tell(f"a robot whose doors are open, without clients, for {seconds:g} s")
        alone, missed_alone, _ = await _watched(server, seconds)
        tell(f"{CLIENTS} RTDE clients for {seconds:g} s")
        async with _clients(port) as said:
            busy, missed, late = await _watched(server, seconds)
    ticks = seconds / PERIOD
    return {
        "clients": CLIENTS,
        "seconds": seconds,
        "us_per_client_and_tick": 1e6 * (busy - alone) * PERIOD / CLIENTS,
        "missed": missed,
        "missed_without_clients": missed_alone,
        "missed_percent": 100.0 * missed / ticks,
        "late_p50_us": late["late_p50_us"],
        "late_p99_us": late["late_p99_us"],
        "samples_received": sum(one["received"] for one in said),
        "samples_lost": sum(one["lost"] for one in said),
    }


async def _watched(server: Served, seconds: float) -> tuple[float, int, dict[str, float]]:
    """Share of a core that it takes; ticks it misses; lateness of its ticks."""
    robot = server.robot
    heard: list[Telemetry] = []
    before = (await robot.state()).missed_ticks
    forget = robot.on_telemetry(heard.append)
    used, began = cpu_seconds(server.pid), time.monotonic()
    await robot.advance(round(seconds / PERIOD))
    share = (cpu_seconds(server.pid) - used) / (time.monotonic() - began)
    missed = (await robot.state()).missed_ticks - before
    forget()
    return share, missed, over_all(heard)


@asynccontextmanager
async def _clients(port: int) -> AsyncIterator[list[dict[str, int]]]:
    """Clients in a process; what they say at their end stands in the list."""
    command = [sys.executable, "-m", "tvist_lab.benchmark.rtde_clients", ADDRESS, str(port), str(CLIENTS)]
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(*command, stdin=pipe, stdout=pipe)
    said: list[dict[str, int]] = []
    try:
        assert process.stdout is not None
        await process.stdout.readline()  # they all read
        yield said
        out, _ = await process.communicate(b"")
        said += json.loads(out)
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind((ADDRESS, 0))
        return int(probe.getsockname()[1])
