"""Load that clients of UR's interfaces, and programs beside them, put on a served robot."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from tvist_lab.benchmark.in_turn import in_turn
from tvist_lab.benchmark.one_robot import punctuality
from tvist_lab.benchmark.programs import idle_loop
from tvist_lab.benchmark.readers import readers
from tvist_lab.served import Served, free_port, served
from tvist_plant.plant import PERIOD
from tvist_server.ur_ports import UrPorts

CLIENTS = 10
"""Number of RTDE clients at 500 Hz, each with a different recipe."""
PAIRS = 5
"""Number of pairs of runs, without and with a program."""
ADDRESS = "127.0.0.1"


async def ur_interfaces(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a robot without clients at its UR interfaces, and with ten clients that read every tick.

    Args:
        seconds: Duration of each measurement [s].
        tell: Called with a description of each measurement before it starts.
    """
    port = str(free_port())
    async with served(_options(port)) as server:
        await server.robot.state()
        tell(f"a robot whose interfaces are open, without clients, for {seconds:g} s")
        alone, idle = await punctuality(server, seconds)
        tell(f"{CLIENTS} RTDE clients for {seconds:g} s")
        async with readers("rtde_clients", ADDRESS, port, str(CLIENTS)) as said:
            tick, busy = await punctuality(server, seconds)
    return {
        "clients": CLIENTS,
        "seconds": seconds,
        "us_per_client_and_tick": 1e6 * (busy - idle) * PERIOD / CLIENTS,
        "missed": tick["missed"],
        "missed_without_clients": alone["missed"],
        "missed_percent": 100.0 * tick["missed"] * PERIOD / seconds,
        "late_p50_us": tick["late_p50_us"],
        "late_p99_us": tick["late_p99_us"],
        "samples_received": sum(one["received"] for one in said),
        "samples_lost": sum(one["lost"] for one in said),
    }


async def with_a_program(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a robot with one RTDE client in pairs of runs, without and with a program's idle loop; see `in_turn`.

    Args:
        seconds: Duration of each run [s].
        tell: Called with a description of each measurement before it starts.
    """
    port = str(free_port())
    async with served(_options(port)) as server, readers("rtde_clients", ADDRESS, port, "1"):
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
    options = ["--ur-address", ADDRESS]
    for interface in UrPorts().open():
        options += ["--ur-port", f"{interface}={port if interface == 'rtde' else 'off'}"]
    return options
