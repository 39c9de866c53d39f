"""Number of robots that one process can run at 500 Hz on one core."""

import asyncio
import os
import sys
from collections import defaultdict
from collections.abc import Callable, Sequence

import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_lab.bench.one_robot import missed_share
from tvist_lab.served import ServedError, served
from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.stream import Telemetry

NUMBERS = (1, 2, 4, 8, 12, 16, 20, 24, 28, 32, 40, 48, 64)
"""Numbers of robots to try, in order."""
FAILURES = 2
"""Consecutive failing numbers after which no larger ones are tried; a single failure may be the machine's fault."""
TRIES = 2
"""Number of tries, of which the better counts, since other load on the machine only ever adds lateness."""
MISSED = 0.001
"""Share of its ticks that each robot may miss [-]."""
SETTLE = 2
"""Number of telemetry messages ignored at first, so that the start is not measured."""


async def robots_at_500_hz(seconds: float, tell: Callable[[str], None], options: Sequence[str] = ()) -> int:
    """Return the largest number of robots in one process on one core such that none misses more than `MISSED`.

    A client, on another core if there is one, reads every state of every robot.

    Args:
        seconds: How long each number is measured [s].
        tell: Called with a description of each measurement before it starts.
        options: Further options of `tvist serve`.
    """
    most, failed = 0, 0
    for number in NUMBERS:
        shares: list[float] = []
        while not shares or (len(shares) < TRIES and min(shares) > MISSED):
            tell(f"{number} robots on one core for {seconds:g} s")
            shares.append(await _worst_share(number, seconds, options))
        if min(shares) <= MISSED:
            most, failed = number, 0
        elif (failed := failed + 1) == FAILURES:
            break
    return most


async def _worst_share(number: int, seconds: float, options: Sequence[str]) -> float:
    """Return the largest share of missed ticks of any robot in a process bound to one core."""
    core = None
    if sys.platform == "linux":  # elsewhere nothing binds a process to a core
        core = max(os.sched_getaffinity(0))
    name = "ur5e" if number == 1 else "ur5e-1"
    heard: dict[str, list[Telemetry]] = defaultdict(list)
    loop, enough = asyncio.get_running_loop(), asyncio.Event()

    def on_telemetry(sample: zenoh.Sample) -> None:
        told = heard[str(sample.key_expr)]
        told.append(decode(Telemetry, sample.payload.to_bytes()))
        if len(heard) == number and all(len(one) > SETTLE + seconds for one in heard.values()):
            loop.call_soon_threadsafe(enough.set)

    try:
        options = ("--robots", f"ur5e*{number}", *options)
        async with served(options, name, several=True, core=core, patience=60.0) as server:
            session = await asyncio.to_thread(open_session, server.endpoint)
            session.declare_subscriber(f"{keys.PREFIX}/*/state", Callback(_ignore, indirect=False))
            session.declare_subscriber(f"{keys.PREFIX}/*/telemetry", Callback(on_telemetry, indirect=False))
            async with asyncio.timeout(10.0 + 3.0 * seconds):
                await enough.wait()
            await asyncio.to_thread(close_session, session)
    except (TimeoutError, ServedError):
        return 1.0  # under too much load it does not even answer in time
    return max(missed_share(told[SETTLE:]) for told in heard.values())


def _ignore(_: zenoh.Sample) -> None:
    pass
