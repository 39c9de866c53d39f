"""Load that clients of UR's interfaces, and programs beside them, put on a served robot."""

import asyncio
import statistics
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from tvist_lab.benchmark.in_turn import in_turn
from tvist_lab.benchmark.one_robot import punctuality
from tvist_lab.benchmark.process import cpu_seconds
from tvist_lab.benchmark.programs import idle_loop
from tvist_lab.benchmark.readers import readers
from tvist_lab.served import Served, free_port, served
from tvist_plant.plant import PERIOD
from tvist_server.ur_ports import UrPorts

CLIENTS = 10
"""Number of RTDE clients at 500 Hz, each with a different recipe."""
PAIRS = 5
"""Number of pairs of runs, without and with a program."""
ROUNDS = 5
"""Number of rounds of measurements, whose medians count."""
SHORTEST = 2.0
"""Shortest time of a measurement [s]: telemetry comes once a second."""
ADDRESS = "127.0.0.1"


async def ur_interfaces(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a robot without clients at its UR interfaces, and with ten clients that read every tick.

    The clients have ten recipes or all the same one. In between, ten of them read from a process that does nothing but
    send packages of the same sizes.

    Args:
        seconds: Duration of each measurement [s].
        tell: Called with a description of each measurement before it starts.
    """
    port, bare_port = str(free_port()), str(free_port())
    part = max(SHORTEST, seconds / ROUNDS)
    shares: dict[str, list[float]] = {what: [] for what in ("none", "recipes", "one", "single", "bare")}
    ticks: list[dict[str, Any]] = []
    said: list[dict[str, int]] = []
    missed_alone = 0.0
    async with served(_options(port)) as server, _sender(bare_port) as sender:
        await server.robot.state()
        for number in range(ROUNDS):
            tell(
                f"round {number + 1} of {ROUNDS}: a robot without and with {CLIENTS} RTDE clients, and a bare sender"
            )
            alone, share = await punctuality(server, part)
            shares["none"].append(share)
            missed_alone += alone["missed"]
            for what, clients, recipes in (
                ("recipes", CLIENTS, CLIENTS),
                ("one", CLIENTS, 1),
                ("single", 1, 1),
            ):
                async with readers("rtde_clients", ADDRESS, port, str(clients), str(recipes)) as counts:
                    tick, share = await punctuality(server, part)
                shares[what].append(share)
                said += counts
                if what == "recipes":
                    ticks.append(tick)
            without = await _share(sender, part)
            async with readers("rtde_clients", ADDRESS, bare_port, str(CLIENTS), str(CLIENTS)):
                shares["bare"].append(await _share(sender, part) - without)
    bare = statistics.median(shares["bare"]) / CLIENTS
    recipes_cost = _median_difference(shares["recipes"], shares["none"]) / CLIENTS
    one_cost = _median_difference(shares["one"], shares["none"]) / CLIENTS
    further_cost = _median_difference(shares["one"], shares["single"]) / (CLIENTS - 1)
    missed = sum(tick["missed"] for tick in ticks)
    return {
        "clients": CLIENTS,
        "seconds": part * ROUNDS,
        "us_per_client_and_tick": 1e6 * PERIOD * recipes_cost,
        "same_recipe_us_per_client_and_tick": 1e6 * PERIOD * one_cost,
        "further_client_us_per_tick": 1e6 * PERIOD * further_cost,
        "bare_us_per_client_and_tick": 1e6 * PERIOD * bare,
        "bare_ratio": recipes_cost / bare,
        "same_recipe_bare_ratio": one_cost / bare,
        "further_client_bare_ratio": further_cost / bare,
        "missed": missed,
        "missed_without_clients": missed_alone,
        "missed_percent": statistics.fmean(tick["missed_percent"] for tick in ticks),
        "late_p50_us": statistics.median(tick["late_p50_us"] for tick in ticks),
        "late_p99_us": statistics.median(tick["late_p99_us"] for tick in ticks),
        "samples_received": sum(one["received"] for one in said),
        "samples_lost": sum(one["lost"] for one in said),
    }


def _median_difference(more: list[float], less: list[float]) -> float:
    return statistics.median(one - other for one, other in zip(more, less, strict=True))


@asynccontextmanager
async def _sender(port: str) -> AsyncIterator[int]:
    """Run the process that only sends; yield its number."""
    command = [sys.executable, "-m", "tvist_lab.benchmark.bare_send", ADDRESS, port]
    process = await asyncio.create_subprocess_exec(*command, stdin=asyncio.subprocess.PIPE)
    try:
        yield process.pid
    finally:
        await process.communicate(b"")


async def _share(pid: int, seconds: float) -> float:
    """Share of a core that a process uses."""
    used, began = cpu_seconds(pid), time.monotonic()
    await asyncio.sleep(seconds)
    return (cpu_seconds(pid) - used) / (time.monotonic() - began)


async def with_a_program(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a robot with one RTDE client in pairs of runs, without and with a program's idle loop; see `in_turn`.

    Args:
        seconds: Duration of each run [s].
        tell: Called with a description of each measurement before it starts.
    """
    port = str(free_port())
    async with served(_options(port)) as server, readers("rtde_clients", ADDRESS, port, "1", "1"):
        figures = await in_turn(server, _idle_loop, PAIRS, seconds, "an idle loop", tell)
    return {
        "pairs": PAIRS,
        "seconds": seconds,
        **{
            f"{what}_{name}": value
            for what in ("late_p99_us", "missed")
            for name, value in figures[what].items()
        },
    }


@asynccontextmanager
async def _idle_loop(server: Served, _: int) -> AsyncIterator[None]:
    async with server.robot.control("bench") as arm:
        await arm.run_program(idle_loop())
        yield
        assert (await server.robot.io()).program_state == "PLAYING", "the program has ended"
        await arm.stop_program()


def _options(port: str) -> list[str]:
    """Options of a server that has no other of UR's interfaces than RTDE."""
    options = ["--profile", "real", "--ur-address", ADDRESS]
    for interface in UrPorts().open():
        options += ["--ur-port", f"{interface}={port if interface == 'rtde' else 'off'}"]
    return options
