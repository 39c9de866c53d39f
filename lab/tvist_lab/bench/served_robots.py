"""Measure served robots: punctuality, response times and load of one robot, and how many one core can run."""

import asyncio
import os
import random
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import zenoh
from zenoh.handlers import Callback

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_client.transports.session import close_session, open_session
from tvist_lab.served import RunningServer, ServedError, served
from tvist_plant.plant import PERIOD
from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.stream import State, Telemetry

SWING = 0.05  # amplitude of the streamed sine [rad]
COMMANDS = 200  # number of commands whose response time is measured
NUMBERS = (1, 2, 4, 8, 12, 16, 20, 24, 28, 32, 40, 48, 64)  # numbers of robots to try, in order
FAILURES = 2  # consecutive failures after which no larger numbers are tried
TRIES = 2  # number of tries, of which the better counts, since other load only adds lateness
MISSED = 0.001  # share of ticks that each robot may miss [-]
SETTLE = 2  # number of telemetry messages ignored at first, to exclude the start


async def one_robot(
    seconds: float, tell: Callable[[str], None], options: Sequence[str] = ()
) -> dict[str, Any]:
    """Measure a robot served by another process, with a recorder and a client that reads every state."""
    with tempfile.TemporaryDirectory() as folder:
        async with served(["--record", str(Path(folder) / "bench.mcap"), *options]) as server:
            await server.robot.state()
            start_s = server.took
            tell(f"a served robot for {seconds:g} s")
            tick, share = await punctuality(server, seconds)
            async with server.robot.control("bench") as arm:
                tell(f"set-points at 500 Hz for {seconds:g} s")
                setpoints = await _setpoints(server.robot, arm, seconds)
                tell("commands")
                commands = await _commands(arm)
            memory = rss_mb(server.pid)
            ending = time.monotonic()
        end_s = time.monotonic() - ending
    return {
        "tick": tick,
        "setpoint_to_state_ms": _percentiles(setpoints),
        "command_ms": _percentiles(commands),
        "cpu_share": share,
        "start_s": start_s,
        "end_s": end_s,
        "rss_mb": memory,
    }


async def punctuality(server: RunningServer, seconds: float) -> tuple[dict[str, float], float]:
    """Return the lateness of the ticks, and the share of a core that the server uses."""
    robot = server.robot
    states: list[State] = []
    heard: list[Telemetry] = []
    missed_before = (await robot.state()).missed_ticks
    forget = robot.on_state(states.append), robot.on_telemetry(heard.append)
    used, began = cpu_seconds(server.pid), time.monotonic()
    await robot.advance(round(seconds / PERIOD))
    share = (cpu_seconds(server.pid) - used) / (time.monotonic() - began)
    missed = (await robot.state()).missed_ticks - missed_before
    for function in forget:
        function()
    told = {"seconds": seconds, "missed": missed, "states_received": len(states)}
    return told | {"missed_percent": 100.0 * missed_share(heard)} | over_all(heard), share


async def _setpoints(robot: Robot, arm: Arm, seconds: float) -> list[float]:
    """Return the times from sending each set-point to the first state with this or a newer one [s]."""
    middle = np.array((await robot.state()).target_q)
    sent: list[float] = []
    took: list[float] = []

    def on_state(state: State) -> None:
        now = time.monotonic()
        if state.setpoint_sequence is not None:
            took.extend(now - put for put in sent[len(took) : state.setpoint_sequence + 1])

    forget = robot.on_state(on_state)
    async with arm.servo(period=PERIOD) as servo:
        # Slightly slower than the robot ticks, so that the set-points are sent at all moments within its period.
        pace = PERIOD * (1.0 + PERIOD / seconds)
        began = time.monotonic()
        for number in range(round(seconds / PERIOD)):
            q = middle + SWING * np.sin(np.pi * number * PERIOD) ** 2
            sent.append(time.monotonic())
            servo.set(q.tolist())
            await asyncio.sleep(began + (number + 1) * pace - time.monotonic())
        await robot.advance(10)
    forget()
    return took


async def _commands(arm: Arm) -> list[float]:
    """Return the round-trip times of commands, each sent at a random moment within a period [s]."""
    chance, took = random.Random(0), []  # noqa: S311  no secret
    for _ in range(COMMANDS):
        await asyncio.sleep(chance.uniform(0.0, 2.0 * PERIOD))
        began = time.monotonic()
        await arm.keep_alive()
        took.append(time.monotonic() - began)
    return took


def _percentiles(seconds: Iterable[float]) -> dict[str, float]:
    p50, p99 = np.percentile(1e3 * np.array(list(seconds)), (50, 99))
    return {"p50": float(p50), "p99": float(p99)}


def over_all(heard: Sequence[Telemetry]) -> dict[str, float]:
    """Return the lateness of all ticks covered by several telemetry messages [µs]."""
    # The maximum is exact; the 99th percentile is an upper bound that at most one tick in a hundred can have
    # exceeded, since each message gives the maximum, 99th percentile and median of one second.
    if not heard:
        nothing = float("nan")
        return {"late_p50_us": nothing, "late_p99_us": nothing, "late_max_us": nothing}
    p50, p99, largest = np.array([(one.late_p50_us, one.late_p99_us, one.late_max_us) for one in heard]).T
    return {
        "late_p50_us": float(np.median(p50)),
        "late_p99_us": _bound(p50, p99, largest),
        "late_max_us": float(largest.max()),
    }


def missed_share(heard: Sequence[Telemetry]) -> float:
    """Return the share of due ticks that were missed between the first and last message [-]; NaN for none."""
    if not heard or heard[0].due_ticks is None or heard[-1].due_ticks is None:
        return float("nan")
    due = heard[-1].due_ticks - heard[0].due_ticks
    return (heard[-1].missed_ticks - heard[0].missed_ticks) / due if due else float("nan")


def _bound(p50: np.ndarray[Any, Any], p99: np.ndarray[Any, Any], largest: np.ndarray[Any, Any]) -> float:
    limits = np.unique(np.concatenate([p50, p99, largest]))
    for limit in limits:
        later = np.select([limit >= largest, limit >= p99, limit >= p50], [0.0, 0.01, 0.5], 1.0)
        if later.mean() <= 0.01:
            return float(limit)
    return float(limits[-1])


def cpu_seconds(pid: int) -> float:
    """Return the processor time used by all threads of a process [s]."""
    used = psutil.Process(pid).cpu_times()
    return float(used.user + used.system)


def rss_mb(pid: int) -> float:
    """Return the resident memory of a process [MB]."""
    return float(psutil.Process(pid).memory_info().rss) / 1e6


async def robots_at_500_hz(seconds: float, tell: Callable[[str], None], options: Sequence[str] = ()) -> int:
    """Return the largest number of robots in one process on one core at which none misses more than `MISSED`.

    A client, on another core if there is one, reads every state. Each number is measured for `seconds`;
    `tell` receives a description before each measurement.
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
        heard[str(sample.key_expr)].append(decode(Telemetry, sample.payload.to_bytes()))
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
        return 1.0  # under too much load the server does not even answer in time
    return max(missed_share(told[SETTLE:]) for told in heard.values())


def _ignore(_: zenoh.Sample) -> None:
    pass
