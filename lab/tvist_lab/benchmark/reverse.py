"""A program that is steered like a driver's: it opens a socket to a client, which answers every sample of the robot."""

import asyncio
import json
import sys
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from typing import Any

from tvist_lab.served import free_port, served
from tvist_server.ur_ports import UrPorts

ADDRESS = "127.0.0.1"
MINUTE = 60.0
TOGETHER = 0.1
"""Largest difference between the times of two time-outs that may have the same cause: the machine stood still [s]."""


async def reverse(seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure the robot's program and, in the same run, two bare processes that exchange the same messages.

    Args:
        seconds: Duration of the run [s].
        tell: Called with what begins, and every minute.

    Returns:
        For both, the messages that were read, the time-outs, and the longest time without a message [ms]; the time-outs
        of the program without one of the bare processes at about the same time; the robot's ticks and missed ticks.
    """
    rtde, primary = free_port(), free_port()
    ports = dict.fromkeys(UrPorts().open(), "off") | {"rtde": str(rtde), "primary": str(primary)}
    options = ["--ur", "--ur-address", ADDRESS]
    for interface, port in ports.items():
        options += ["--ur-port", f"{interface}={port}"]
    async with served(options) as server:
        tell("a robot whose program is steered over a socket, and beside it two bare processes")
        robot = server.robot
        async with _client(ADDRESS, str(rtde), str(primary)) as client, _client("echo") as echo:
            before = await robot.state()
            for process in (client, echo):
                _stdin(process).write(b"\n")
            await _wait(seconds, tell)
            said = [json.loads((await process.communicate(b""))[0]) for process in (client, echo)]
            after = await robot.state()
            state = (await robot.io()).program_state
            if state != "PLAYING":
                raise RuntimeError(f"the robot's program is {state}: it should be PLAYING until the end")
    return _figures(*said) | {
        "seconds": seconds,
        "ticks": after.tick - before.tick,
        "missed": after.missed_ticks - before.missed_ticks,
    }


def _figures(client: dict[str, Any], echo: dict[str, Any]) -> dict[str, Any]:
    return {
        "messages": client["messages"],
        "timeouts": len(client["timeouts"]),
        "timeouts_alone": alone(client["timeouts"], echo["timeouts"]),
        "longest_gap_ms": 1e3 * client["longest_gap_s"],
        "echo_messages": echo["messages"],
        "echo_timeouts": len(echo["timeouts"]),
        "echo_longest_gap_ms": 1e3 * echo["longest_gap_s"],
    }


def alone(times: Sequence[float], others: Sequence[float], together: float = TOGETHER) -> int:
    """Return how many of the times have none of the others within `together` seconds."""
    return sum(all(abs(time - other) > together for other in others) for time in times)


@asynccontextmanager
async def _client(*arguments: str) -> AsyncIterator[asyncio.subprocess.Process]:
    """Run a client, see `reverse_client`; wait until messages go to and fro."""
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tvist_lab.benchmark.reverse_client", *arguments, stdin=pipe, stdout=pipe
    )
    assert process.stdout is not None
    try:
        if await process.stdout.readline() != b"ready\n":
            raise RuntimeError("the client has ended before the program read its messages")
        yield process
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


def _stdin(process: asyncio.subprocess.Process) -> asyncio.StreamWriter:
    assert process.stdin is not None
    return process.stdin


async def _wait(seconds: float, tell: Callable[[str], None]) -> None:
    loop = asyncio.get_running_loop()
    end, minutes = loop.time() + seconds, 0
    while (left := end - loop.time()) > 0.0:
        await asyncio.sleep(min(MINUTE, left))
        if left > MINUTE:
            minutes += 1
            tell(f"{minutes:g} of {seconds / MINUTE:g} minutes")
