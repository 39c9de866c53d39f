"""Cost of served robots: with a client, with clients of RTDE, among other robots, and behind a bridge."""

import asyncio
import time
from typing import Any

from benchmarks.figure import Figure, Tell, figure
from benchmarks.helpers import ROBOT, asked, helper
from tvist_lab.bench.moving import line_tick
from tvist_lab.bench.served_robots import cpu_seconds, punctuality, robots_at_500_hz
from tvist_lab.served import free_endpoint, free_port, served
from tvist_plant.plant import PERIOD
from tvist_protocol.modes import RobotMode
from tvist_server.moving.program import ALONE
from tvist_server.ur_ports import UrPorts

IN_PROCESS = "the line in process"
SHORTEST = 2.0  # shortest time of a measurement [s]; telemetry comes once per second
OF_READER, OF_RTDE = 7, 5  # number of rounds of measurements
READER = {
    "one_robot": "a served robot that one client reads",
    "paced_line": "the line alone, once every 2 ms",
    "bare_put": "a bare put() of a state to one client, once every 2 ms",
}
"""Measurements in each round of the part `reader`."""
CLIENTS = 10  # number of RTDE clients at 500 Hz
KINDS = (
    ("rtde_us_per_client_and_tick", CLIENTS, "ten with different recipes"),
    ("rtde_us_per_client_of_one_recipe", 1, "ten with the same recipe"),
)
"""Figures: key, number of recipes, and description of the clients."""
ADDRESS, BRIDGED = "127.0.0.1", "127.42.7.1"
"""Addresses of the robot that RTDE clients read, and of the robot behind a bridge."""
OF_MANY = 0.4  # time for each number of robots, as a share of the time for one robot [-]
SEVERAL, SLOWER = 8, 0.25
"""Number of robots in a process, and their speed relative to real time, at which none is late."""


def in_process() -> float:
    """Return the processor time of a tick of the line [µs]: the minimum, since other load only adds to it."""
    run = line_tick("zv")
    run()
    return min(run() for _ in range(5))


async def reader(seconds: float, tell: Tell) -> dict[str, Figure]:
    """Measure a robot whose client reads each state; in another process, bare line and bare state puts."""
    part, endpoint = max(SHORTEST, seconds / OF_READER), free_endpoint()
    found: dict[str, list[float]] = {name: [] for name in READER}
    lines: list[float] = []
    async with served([]) as server, helper("bare_tick", endpoint) as bare:
        await server.robot.state()  # subscribes its client
        for number in range(OF_READER):
            tell(f"round {number + 1} of {OF_READER}: a robot that one client reads, its line, and bare puts")
            lines.append(in_process())
            found["one_robot"].append(1e6 * PERIOD * (await punctuality(server, part))[1])
            for name in ("paced_line", "bare_put"):
                async with helper("observers", endpoint, ROBOT, "1"):
                    found[name].append(await asked(bare, f"{name} {part:g}"))
    return {
        f"{name}_us_per_tick": figure(READER[name], "µs per tick", taken, IN_PROCESS, lines)
        for name, taken in found.items()
    }


async def rtde(seconds: float, tell: Tell) -> dict[str, Figure]:
    """Measure a robot without and with ten clients that read every tick, in turn with a process that only sends."""
    port, bare_port = str(free_port()), str(free_port())
    options = ["--profile", "real", "--ur-address", ADDRESS]
    for interface in UrPorts().open():
        options += ["--ur-port", f"{interface}={port if interface == 'rtde' else 'off'}"]
    part, found = max(SHORTEST, seconds / OF_RTDE), dict[str, Figure]()
    async with served(options) as server, helper("bare_send", ADDRESS, bare_port) as sender:
        await server.robot.state()
        for key, recipes, what in KINDS:
            shared = str(CLIENTS), str(recipes)
            ours, theirs = [], []
            for number in range(OF_RTDE):
                tell(f"round {number + 1} of {OF_RTDE}: a robot and a bare sender, without and with {what}")
                _, alone = await punctuality(server, part)
                async with helper("rtde_clients", ADDRESS, port, *shared):
                    _, share = await punctuality(server, part)
                ours.append(share - alone)
                alone = await _share(sender.pid, part)
                async with helper("rtde_clients", ADDRESS, bare_port, *shared, "bare"):
                    theirs.append(await _share(sender.pid, part) - alone)
            scale = 1e6 * PERIOD / CLIENTS
            found[key] = figure(
                f"an RTDE client, of {what}", "µs per tick", [scale * share for share in ours],
                "a bare send() of as many bytes", [scale * share for share in theirs],
            )  # fmt: skip
    return found


async def _share(pid: int, seconds: float) -> float:
    used, began = cpu_seconds(pid), time.monotonic()
    await asyncio.sleep(seconds)
    return (cpu_seconds(pid) - used) / (time.monotonic() - began)


async def robots(seconds: float, tell: Tell) -> dict[str, Any]:
    """Measure the cost of each of several robots in a process, and how many robots one core computes."""
    tell("the line of one robot")
    line = in_process()
    one = await _us_per_robot_and_tick(OF_MANY * seconds, tell)
    most = await robots_at_500_hz(max(2.0, OF_MANY * seconds), tell)
    computed = "robots whose line a core computes"
    return {
        "robot_us_per_tick": figure("a served robot of several", "µs per tick", [one], IN_PROCESS, [line]),
        "robots_at_500_hz": figure(
            "robots at 500 Hz on one core", "", [most], computed, [1e6 * PERIOD / line]
        ),
    }


async def _us_per_robot_and_tick(seconds: float, tell: Tell) -> float:
    """Return the processor time per tick of each of `SEVERAL` robots of a process, all read by a client [µs]."""
    tell(f"{SEVERAL} robots at speed {SLOWER:g} for {seconds:g} s")
    options = ["--robots", f"ur5e*{SEVERAL}", "--speed", str(SLOWER)]
    async with (
        served(options, "ur5e-1", several=True) as server,
        helper("observers", server.endpoint, "*", "1"),
    ):
        await asyncio.sleep(SHORTEST)
        used, before = cpu_seconds(server.pid), (await server.robot.state()).tick
        await asyncio.sleep(seconds)
        used, ticks = cpu_seconds(server.pid) - used, (await server.robot.state()).tick - before
    return 1e6 * used / max(1, SEVERAL * ticks)


async def bridge(seconds: float, tell: Tell) -> dict[str, Any]:
    """Measure a bridge that holds a robot, and in how many periods the robot's program had no set-point."""
    line = in_process()
    tell(f"a bridge to a robot for {seconds:g} s")
    arm = ["--ur", "--ur-address", BRIDGED, "--profile", "real", "--shaper", "none"]
    bridged = ["--plant", f"ur://{BRIDGED}", "--enable-motion"]
    async with (
        served(arm, "arm") as far,
        served(bridged, "bridge") as near,
        near.robot.control("bench") as control,
    ):
        state = await near.robot.state()
        if state.robot_mode != RobotMode.RUNNING:
            await control.power_on()
        await control.move_j(state.target_q, velocity=0.4)  # within its cap
        before = (await far.robot.io()).output_int_register[ALONE]
        tick, share = await punctuality(near, max(SHORTEST, seconds))
        alone = (await far.robot.io()).output_int_register[ALONE] - before
    cost = 1e6 * PERIOD * share
    return {
        "bridge_us_per_tick": figure(
            "a bridge that holds a robot", "µs per tick", [cost], IN_PROCESS, [line]
        ),
        "bridge": {"alone_percent": 100.0 * alone * PERIOD / tick["seconds"], **tick},
    }
