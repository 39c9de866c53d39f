"""Twenty slow robots and three at full rate behind one router, in two network namespaces.

What happens to them is compared with what happens in the same run to a bare Zenoh token, in a process of its own.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from tests.conformance.served import PATIENCE, Served

from tvist_lab.recordings.mcap_file import read
from tvist_protocol.modes import SafetyMode

from .network_namespaces import WATCHERS, cabled, why_not
from .routed import Router

pytestmark = [pytest.mark.nightly, pytest.mark.realtime]

ENDPOINT = f"tcp/{WATCHERS}:7447"
SLOW, FAST = 20, 3
ROOT = Path(__file__).parents[2]
RUN_S = 240
QUIET_S = 8.0
"""Time in which gaps between states are measured [s]."""
FLOOD = 5000
"""Messages of 4 kB a second of the robot that floods: twelve times as many bytes as a robot's states."""
TWICE = 2.0


class Observer:
    """The lines of `fleet_observer.py`."""

    def __init__(self, around):
        self.lines = []
        self._news = threading.Condition()
        self.process = subprocess.Popen(
            [*around, sys.executable, "-m", "tests.system.fleet_observer", ENDPOINT, str(RUN_S)],
            stdout=subprocess.PIPE, text=True, cwd=ROOT,
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.process.stdout:
            with self._news:
                self.lines.append(json.loads(line))
                self._news.notify_all()

    def wait(self, told, patience=PATIENCE):
        """The first result of a function of all lines that is true."""
        with self._news:
            assert self._news.wait_for(lambda: told(self.lines), patience), self.lines[-5:]
            return told(self.lines)

    def changed(self, words, *, there, since):
        """When the last of all tokens whose keys contain one of some words came or went; None if one is missing."""

        def told(lines):
            return {
                line["key"]: line["at"]
                for line in lines
                if line.get("there") is there and line["at"] > since and words in line["key"]
            }

        return told

    def last(self, words, count, *, there, since):
        """When the last of `count` tokens came or went [s]."""
        changed = self.changed(words, there=there, since=since)
        return max(self.wait(lambda lines: len(at := changed(lines)) >= count and at).values())

    def gaps(self):
        """The next whole seconds' 99th percentiles of the gaps between states, by key; the median second of each."""
        since = time.monotonic() + 1.0
        seconds = self.wait(
            lambda lines: (
                len(found := [line["gaps"] for line in lines if "gaps" in line and line["at"] > since])
                >= QUIET_S
                and found
            )
        )
        keys = set().union(*seconds)
        return {
            key: sorted(second[key] for second in seconds if key in second)[len(seconds) // 2 - 1]
            for key in keys
        }

    def harmed(self):
        """Protective and safety stops."""
        return [line for line in self.lines if line.get("kind") in {"protective_stop", "safety_stop"}]


@pytest.fixture
def fleet():
    """The two ends, the router, who watches, and the robots: slow ones in two processes, fast ones in a third."""
    if (why := why_not()) is not None:
        pytest.skip(why)
    started = []

    def robots(around, namespace, count, *options):
        served = Served(
            "--robots", f"ur5e*{count}", "--namespace", namespace, *options, name=None, router=ENDPOINT, around=around
        )  # fmt: skip
        started.append(served)
        return served

    def bare(around, key, rate=0):
        process = subprocess.Popen(
            [*around, sys.executable, "-m", "tests.system.bare_token", ENDPOINT, key, str(rate)],
            stdout=subprocess.PIPE,
            cwd=ROOT,
        )
        started.append(process)
        assert process.stdout.readline() == b"under way\n"
        return process

    with cabled() as (near, far):
        router = Router("--insecure", endpoint=ENDPOINT, around=far)
        started.append(router)
        try:
            router.wait_until_ready()
            observer = Observer(far)
            started.append(observer.process)
            yield near, far, router, observer, robots, bare, started
        finally:
            for each in reversed(started):
                process = each.process if isinstance(each, Served) else each
                if process.poll() is None:
                    process.send_signal(signal.SIGCONT)
                    process.kill()
                process.wait(PATIENCE)
                if isinstance(each, Served):
                    each.kill()
                else:
                    process.stdout.close()


def test_robots_of_a_fleet_are_found_lost_and_back_like_bare_tokens(fleet, measured, tmp_path):
    near, far, router, observer, robots, bare, started = fleet
    began = time.monotonic()
    dying = robots(near, "dying", SLOW // 2, "--speed", "0.1")
    freezing = robots(near, "freezing", SLOW // 2, "--speed", "0.1")
    fast = robots(near, "fast", FAST, "--record", str(tmp_path / "fast.mcap"))
    for served in (dying, freezing, fast):
        served.wait_until_ready()
    tokens = [bare(near, "bare/dying"), bare(near, "bare/freezing")]
    observer.last("ur5e", SLOW + FAST, there=True, since=began)
    observer.last("bare", 2, there=True, since=began)

    # Somebody floods: the others' states keep their rhythm.
    alone = observer.gaps()
    flood = bare(near, "bare/tvist/flood", FLOOD)
    beside = observer.gaps()
    flood.kill()
    flood.wait()
    ratios = [beside[key] / alone[key] for key in alone if key.startswith("fast") and key in beside]
    assert len(ratios) == FAST
    assert max(ratios) < TWICE
    measured("p99 gap of states beside a flood over alone, each fast robot", ratios)
    measured("p99 gap of states alone, ms", [1e3 * alone[key] for key in sorted(alone) if "fast" in key])

    # Killed.
    before = time.monotonic()
    tokens[0].kill()
    bare_s = observer.last("bare/dying", 1, there=False, since=before) - before
    before = time.monotonic()
    dying.process.kill()
    robots_s = observer.last("dying/tvist", SLOW // 2, there=False, since=before) - before
    measured("killed: seconds until noticed, robots and bare token", (robots_s, bare_s))

    def signalled(number, *, there):
        """How long after a signal to a robot's process and a bare token's both were noticed [s]."""
        before = time.monotonic()
        for process in (tokens[1], freezing.process):
            os.kill(process.pid, number)
        bare_s = observer.last("bare/freezing", 1, there=there, since=before) - before
        return observer.last("freezing/tvist", SLOW // 2, there=there, since=before) - before, bare_s

    # Frozen, both at once: each is noticed after the lease that it announced.
    robots_s, bare_s = signalled(signal.SIGSTOP, there=False)
    measured("frozen: seconds until noticed, robots and bare token", (robots_s, bare_s))
    assert robots_s < TWICE * bare_s
    measured("thawed: seconds until back, robots and bare token", signalled(signal.SIGCONT, there=True))

    # The router dies while a robot moves, and another one takes its place.
    before = time.monotonic()
    words = (
        "move",
        "Q2",
        "--endpoint",
        ENDPOINT,
        "--namespace",
        "fast",
        "--name",
        "ur5e-1",
        "--duration",
        "4",
    )
    mover = subprocess.Popen(
        [*far, sys.executable, "-m", "tvist_cli", *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    started.append(mover)
    observer.wait(
        lambda lines: any(line.get("kind") == "motion_started" and line["at"] > before for line in lines)
    )
    observer.wait(lambda lines: lines[-1]["at"] > before + 1.0 and "states" in lines[-1])
    router.process.kill()
    router.wait()
    again = Router("--insecure", endpoint=ENDPOINT, around=far)
    started.append(again)
    again.wait_until_ready()
    before = time.monotonic()
    robots_s = observer.last("tvist/ur5e", SLOW // 2 + FAST, there=True, since=before) - before
    bare_s = observer.last("bare/freezing", 1, there=True, since=before) - before
    measured("router restarted: seconds until all are back, robots and bare token", (robots_s, bare_s))
    observer.wait(
        lambda lines: any(line["at"] > before + 2 and len(line.get("states", ())) >= 13 for line in lines)
    )
    assert observer.harmed() == []
    for served in (freezing, fast):
        assert "the connection to the router" in served.said
        assert served.end() == 0, served.said
        served.assert_quiet()
    moved = read(tmp_path / "fast-ur5e-1.mcap")
    kinds = [event.kind for event in moved.events if event.kind != "warning"]
    assert kinds == ["motion_started", "lease_lost", "motion_stopped"]
    limits = moved.info.limits
    for name, limit in (("qd", limits.velocity), ("moment", limits.torque)):
        used = np.max(np.abs([getattr(state, f"target_{name}") for state in moved.states]) / np.array(limit))
        measured(f"robot that moved while its router died: target_{name} over its limit", used)
        assert used <= 1.0
    assert {state.safety_mode for state in moved.states} == {SafetyMode.NORMAL}
