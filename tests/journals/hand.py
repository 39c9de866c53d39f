"""A served robot that records, and somebody with control of it."""

import math
import time
from contextlib import contextmanager

from tests.conformance.served import Served
from tests.conformance.wire import Wire

TICK = 0.002
MOST = 1000
"""Ticks in one step."""


@contextmanager
def robot(path, *options, clock="lockstep"):
    """A served robot that records, and somebody with control of it."""
    with Served("--clock", clock, "--record", str(path), *options) as served, Wire(served.endpoint) as wire:
        wire.listen("event", "state")
        answer = wire.command("take_control", client="somebody", lease_s=30.0)
        yield Hand(wire, answer["token"], lockstep=clock == "lockstep")
        assert served.end() == 0


class Hand:
    """What somebody with control does."""

    def __init__(self, wire, token, *, lockstep):
        self.wire, self.token, self.lockstep = wire, token, lockstep

    def do(self, command, **fields):
        return self.wire.command(command, token=self.token, **fields)

    def must(self, command, **fields):
        """Do it, and not be refused."""
        answer = self.do(command, **fields)
        assert answer["type"] in {"accepted", "done"}, answer
        return answer

    def wait(self, ticks):
        """Let ticks pass."""
        if self.lockstep:
            for first in range(0, ticks, MOST):
                answer = self.do("simulation.step", ticks=min(ticks - first, MOST))
                assert answer["type"] == "done", answer
        else:
            time.sleep(ticks * TICK)

    def move(self, q, **limits):
        """Move, and wait for the end where it begins."""
        answer = self.do("move_j", q=q, **limits)
        if answer["type"] == "accepted" and not self.lockstep:
            self.wire.wait("event", lambda e: e.get("id") == answer["id"] and e["kind"] != "motion_started")
        elif answer["type"] == "accepted":
            self.wait(1500)
        return answer

    def stream(self, seconds, period=TICK, *, amplitude=0.1, hertz=0.7, joint=1, sequence=0):
        """Stream a sine from where the arm stands."""
        start = self.wire.next("state")["reference_q"] if not self.lockstep else None
        if start is None:
            self.wait(1)
            start = self.wire.received["state"][-1]["reference_q"]
        assert self.do("servo_start", period=period)["type"] == "done"
        for number in range(round(seconds / period)):
            t = (number + 1) * period
            q = list(start)
            q[joint] += amplitude * math.sin(2 * math.pi * hertz * t) * min(t, 1.0)
            self.wire.setpoint(token=self.token, sequence=sequence + number + 1, q=q)
            if self.lockstep and number % 25 == 24:
                self.wait(25 * round(period / TICK))
            elif not self.lockstep:
                time.sleep(period)

    def stream_in_steps(self, seconds, *, joint=0, amplitude=0.1, hertz=1.0):
        """Stream with the set-points inside steps."""
        self.wait(1)
        start = self.wire.received["state"][-1]["reference_q"]
        assert self.do("servo_start", period=TICK)["type"] == "done"
        count, number = round(seconds / TICK), 0
        while number < count:
            setpoints = []
            for _ in range(50):
                number += 1
                q = list(start)
                q[joint] += amplitude * math.sin(2 * math.pi * hertz * number * TICK)
                setpoints.append({"sequence": number, "q": q})
            answer = self.do("simulation.step", ticks=50, setpoints=setpoints)
            assert answer["type"] == "done", answer
