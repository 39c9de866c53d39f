"""Load that clients of UR's interfaces put on a served robot."""

from collections.abc import Callable
from typing import Any

from tvist_lab.benchmark.one_robot import punctuality
from tvist_lab.benchmark.readers import readers
from tvist_lab.served import free_port, served
from tvist_plant.plant import PERIOD
from tvist_server.ur_ports import UrPorts

CLIENTS = 10
"""Number of RTDE clients at 500 Hz, each with a different recipe."""
ADDRESS = "127.0.0.1"


async def ur_interfaces(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a robot without clients at its UR interfaces, and with ten clients that read every tick.

    Args:
        seconds: Duration of each measurement [s].
        tell: Called with a description of each measurement before it starts.
    """
    port = str(free_port())
    options = ["--profile", "real", "--ur-address", ADDRESS]
    for interface in UrPorts().open():
        options += ["--ur-port", f"{interface}={port if interface == 'rtde' else 'off'}"]
    async with served(options) as server:
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
