"""A fleet of simulated publishers behind two routers: what a state costs, how late it is, how the fleet comes back."""

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import numpy as np
import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_lab.benchmark.process import cpu_seconds, rss_mb
from tvist_lab.served import free_endpoint
from tvist_protocol import keys

RATES = (2.0, 10.0, 20.0, 40.0)
"""States of each publisher per second, one after another."""
PATIENCE = 60.0
"""Longest wait for all tokens, or for a process [s]."""
DELIVERED = 0.99
"""Share of the states that must arrive for a rate to count as carried [-]."""


class FleetError(Exception):
    """The fleet did not come up; the message says what is missing."""


def fleet(count: int, seconds: float, tell: Callable[[str], None]) -> dict[str, Any]:
    """Measure a fleet: half of it is connected to one router, half to another, and a client of the second sees all.

    Args:
        count: Number of publishers.
        seconds: How long each rate is measured [s].
        tell: Called with a description of each measurement before it starts.

    Raises:
        FleetError: The processes did not come up.
    """
    near, far = free_endpoint(), free_endpoint()
    with ExitStack() as stack:
        first = stack.enter_context(_router(near))
        second = stack.enter_context(_router(far, "--connect", near))
        watcher = _Watcher(far)
        stack.callback(watcher.close)
        empty = rss_mb(first.pid)
        tell(f"{count} publishers connect to two routers")
        half, began = count // 2, time.monotonic()
        groups = [
            stack.enter_context(_publishers(near, 0, half)),
            stack.enter_context(_publishers(far, half, count - half)),
        ]
        found = watcher.all_there(count, began)
        result: dict[str, Any] = {
            "publishers": count,
            "found_s": found,
            "router_mb": empty,
            "router_kb_per_publisher": 1e3 * (rss_mb(first.pid) - empty) / half,
        }
        tell(f"nobody subscribes, {RATES[-1]:g} states a second of each")
        _rate(groups, RATES[-1])
        result["unwatched"] = _costs(first.pid, second.pid, seconds)
        watcher.subscribe()
        result["rates"] = rates = []
        for rate in RATES:
            tell(f"{count} publishers, {rate:g} states a second of each, all watched")
            _rate(groups, rate)
            time.sleep(1.0)
            rates.append(
                {"rate_hz": rate, **_measured(watcher, first.pid, second.pid, rate * count, seconds)}
            )
            if rates[-1]["delivered"] < DELIVERED:
                break
        _rate(groups, 0.0)
        carried = [each for each in rates if each["delivered"] >= DELIVERED]
        result["states_per_second"] = max((each["states_per_second"] for each in carried), default=None)
        tell("the first router is killed and started again")
        first.kill()
        first.wait()
        watcher.left(count - half)
        began = time.monotonic()
        stack.enter_context(_router(near))
        result["back_s"] = watcher.all_there(count, began)
        return result


class _Watcher:
    """A client that sees every token and, once it subscribes, every state."""

    def __init__(self, endpoint: str) -> None:
        self._session = open_session(endpoint)
        self._there: set[str] = set()
        self._changed = threading.Condition()
        self._late: dict[bool, list[int]] = {True: [], False: []}
        self._near = 0
        self.bytes = 0
        self._session.liveliness().declare_subscriber(
            keys.ANY_ALIVE, Callback(self._on_token, indirect=False), history=True
        )

    def all_there(self, count: int, since: float) -> float:
        """Wait for all tokens; how long that took [s]."""
        with self._changed:
            if not self._changed.wait_for(lambda: len(self._there) == count, PATIENCE):
                raise FleetError(
                    f"only {len(self._there)} of {count} publishers are there after {PATIENCE:g} s"
                )
        self._near = count // 2
        return time.monotonic() - since

    def left(self, count: int) -> None:
        """Wait until no more than this many tokens are left."""
        with self._changed:
            if not self._changed.wait_for(lambda: len(self._there) <= count, PATIENCE):
                raise FleetError("the tokens of a router that was killed stay")

    def subscribe(self) -> None:
        """See every state from now on."""
        self._session.declare_subscriber(f"{keys.PREFIX}/*/state", Callback(self._on_state, indirect=False))

    def take(self) -> tuple[list[int], list[int]]:
        """Latencies since the last call [ns]: over both routers, and over one."""
        taken, self._late = self._late, {True: [], False: []}
        return taken[True], taken[False]

    def close(self) -> None:
        """Disconnect."""
        close_session(self._session)

    def _on_token(self, sample: zenoh.Sample) -> None:
        with self._changed:
            change = self._there.add if sample.kind == zenoh.SampleKind.PUT else self._there.discard
            change(str(sample.key_expr))
            self._changed.notify_all()

    def _on_state(self, sample: zenoh.Sample) -> None:
        now = time.monotonic_ns()
        self.bytes = len(sample.payload)
        sent = int.from_bytes(sample.attachment.to_bytes(), "little") if sample.attachment else now
        number = int(str(sample.key_expr).split("/")[1].rpartition("-")[2])
        self._late[number < self._near].append(now - sent)


def _measured(watcher: _Watcher, first: int, second: int, expected: float, seconds: float) -> dict[str, Any]:
    watcher.take()
    began, before = time.monotonic(), (cpu_seconds(first), cpu_seconds(second))
    time.sleep(seconds)
    lasted = time.monotonic() - began
    both, one = watcher.take()
    used = (cpu_seconds(first) - before[0], cpu_seconds(second) - before[1])
    received = len(both) + len(one)
    return {
        "states_per_second": received / lasted,
        "delivered": min(1.0, received / (expected * lasted)),
        "bytes_per_state": watcher.bytes,
        "first_router_cpu": used[0] / lasted,
        "second_router_cpu": used[1] / lasted,
        "first_router_us_per_state": 1e6 * used[0] / max(1, len(both)),
        "second_router_us_per_state": 1e6 * used[1] / max(1, received),
        **_latency("one_router", one),
        **_latency("two_routers", both),
    }


def _latency(what: str, late: list[int]) -> dict[str, float | None]:
    if not late:
        return {f"{what}_p50_ms": None, f"{what}_p99_ms": None}
    p50, p99 = np.percentile(late, (50, 99))
    return {f"{what}_p50_ms": 1e-6 * float(p50), f"{what}_p99_ms": 1e-6 * float(p99)}


def _costs(first: int, second: int, seconds: float) -> dict[str, float]:
    before = cpu_seconds(first), cpu_seconds(second)
    time.sleep(seconds)
    return {
        "first_router_cpu": (cpu_seconds(first) - before[0]) / seconds,
        "second_router_cpu": (cpu_seconds(second) - before[1]) / seconds,
    }


def _rate(groups: list[subprocess.Popen[str]], rate: float) -> None:
    for group in groups:
        assert group.stdin is not None
        group.stdin.write(f"{rate}\n")
        group.stdin.flush()


@contextmanager
def _router(endpoint: str, *options: str) -> Iterator[subprocess.Popen[str]]:
    words = ["tvist_cli", "router", "--listen", endpoint, *options]
    with _process(words, "listens") as process:
        yield process


@contextmanager
def _publishers(endpoint: str, first: int, count: int) -> Iterator[subprocess.Popen[str]]:
    words = ["tvist_lab.benchmark.fleet_publishers", endpoint, str(first), str(count)]
    with _process(words, "ready") as process:
        yield process


@contextmanager
def _process(words: list[str], ready: str) -> Iterator[subprocess.Popen[str]]:
    """A Python module as a process, once it has said a word; what it says is read on one pipe."""
    process = subprocess.Popen(  # noqa: S603  our own modules
        [sys.executable, "-m", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    try:
        assert process.stdout is not None
        said = ""
        while ready not in said:
            line = process.stdout.readline()
            if not line:
                raise FleetError(f"{words[0]} ended: {said}")
            said += line
        yield process
    finally:
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()
