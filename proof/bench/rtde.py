"""What clients of RTDE cost a served robot, beside a process that only sends."""

import asyncio
import time
from collections.abc import Callable

from proof.bench.figure import Figure, figure
from proof.bench.readers import helper, readers
from tvist_lab.bench.one_robot import cpu_seconds, punctuality
from tvist_lab.served import free_port, served
from tvist_plant.plant import PERIOD
from tvist_server.ur_ports import UrPorts

CLIENTS = 10
"""Number of RTDE clients at 500 Hz."""
KINDS = (
    ("rtde_us_per_client_and_tick", CLIENTS, "ten with different recipes"),
    ("rtde_us_per_client_of_one_recipe", 1, "ten with the same recipe"),
)
"""Figures: key, number of recipes, and who reads."""
ROUNDS = 5
"""Number of rounds of measurements."""
SHORTEST = 2.0
"""Shortest time of a measurement [s]: telemetry comes once a second."""
ADDRESS = "127.0.0.1"


async def rtde(seconds: float, tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure a robot without clients at its UR interfaces, and with ten clients that read every tick.

    In between, as many read from a process that does nothing but send packages of the same sizes.

    Args:
        seconds: Duration of each measurement [s].
        tell: Called with a description of each measurement before it starts.
    """
    port, bare_port = str(free_port()), str(free_port())
    part = max(SHORTEST, seconds / ROUNDS)
    found: dict[str, Figure] = {}
    async with served(_options(port)) as server, helper("bare_send", ADDRESS, bare_port) as sender:
        await server.robot.state()
        for key, recipes, what in KINDS:
            shared = str(CLIENTS), str(recipes)
            ours, theirs = [], []
            for number in range(ROUNDS):
                tell(f"round {number + 1} of {ROUNDS}: a robot and a bare sender, without and with {what}")
                _, alone = await punctuality(server, part)
                async with readers("rtde_clients", ADDRESS, port, *shared) as said:
                    _, share = await punctuality(server, part)
                assert all(one["received"] for one in said), "a client has received nothing"
                ours.append(share - alone)
                alone = await _share(sender.pid, part)
                async with readers("rtde_clients", ADDRESS, bare_port, *shared):
                    theirs.append(await _share(sender.pid, part) - alone)
            scale = 1e6 * PERIOD / CLIENTS
            found[key] = figure(
                f"an RTDE client, of {what}", "µs per tick", [scale * share for share in ours],
                "a bare send() of as many bytes", [scale * share for share in theirs],
            )  # fmt: skip
    return found


async def _share(pid: int, seconds: float) -> float:
    """Share of a core that a process uses."""
    used, began = cpu_seconds(pid), time.monotonic()
    await asyncio.sleep(seconds)
    return (cpu_seconds(pid) - used) / (time.monotonic() - began)


def _options(port: str) -> list[str]:
    """Options of a server that has no other of UR's interfaces than RTDE."""
    options = ["--profile", "real", "--ur-address", ADDRESS]
    for interface in UrPorts().open():
        options += ["--ur-port", f"{interface}={port if interface == 'rtde' else 'off'}"]
    return options
