"""Random sequences of guided commands, planned moves, stops and faults: what is promised holds in every tick."""

import numpy as np
import pytest
from tests.examples import share

from tvist_controller.collision import CollisionModel
from tvist_controller.setup import body, paper_payload
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.transitions import Activity

from .robots import UR5E, H, NoArm, Robot

HOME = np.array((1.57, -1.57, 1.57, -1.57, -1.57, 0.0))
SHAPERS = ("none", "zv", "zvd", "ei")
LIMITS = UR5E.limits
WAITS = (0, 1, 2, 5, 20, 60, 200)
VELOCITY, ACCELERATION = 1.003, 1.01
"""Largest shaped velocity and acceleration as shares of the joints' limits, as in `python -m proof search`."""


class Sequence:
    """One sequence.

    Args:
        seed: Its number.
    """

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)
        shaper = SHAPERS[seed % len(SHAPERS)]
        self.robot = Robot(shaper=shaper, q=tuple(HOME), plant=NoArm())
        self.clear = CollisionModel(UR5E, body(paper_payload(UR5E)))
        self.done = [f"seed {seed} {shaper}"]
        self.q = [HOME, HOME]
        self.running = set()
        self.ended = set()

    def near(self, most):
        q = self.robot.controller.cycle.position + self.random.uniform(-most, most, 6)
        return tuple(np.clip(q, -2 * np.pi, 2 * np.pi))

    def servo(self):
        random = self.random
        q = self.near(float(10 ** random.uniform(-3, 0.5)))
        lookahead, gain = float(random.choice([0.03, 0.1, 0.2])), float(random.choice([100, 300, 2000]))
        return m.ServoJ, {"q": q, "lookahead": lookahead, "gain": gain, "shaped": self.shaped()}

    def shaped(self):
        return bool(self.random.random() < 0.3)

    def speed_j(self):
        random = self.random
        qd = tuple(random.uniform(-1, 1, 6) * random.choice([0.01, 0.5, 1.0, 3.14]))
        if random.random() < 0.2:
            qd = (0.0,) * 6
        return m.SpeedJ, {
            "qd": qd,
            "acceleration": float(10 ** random.uniform(-1, 1.6)),
            "shaped": self.shaped(),
        }

    def speed_l(self):
        random = self.random
        xd = tuple(random.uniform(-1, 1, 6) * random.choice([0.0, 0.1, 0.5, 3.0]))
        return m.SpeedL, {
            "xd": xd,
            "acceleration": float(10 ** random.uniform(-1, 2)),
            "shaped": self.shaped(),
        }

    def command(self):
        random = self.random
        token = self.robot.token
        options = [
            *[self.servo] * 6,
            *[self.speed_j] * 6,
            *[self.speed_l] * 6,
            *[lambda: (c.MoveJ, {"q": self.near(1.0), "velocity": 1.5})] * 5,
            lambda: (m.StopJ, {"acceleration": float(10 ** random.uniform(-2, 2))}),
            lambda: (m.StopL, {"acceleration": float(10 ** random.uniform(-2, 2))}),
            lambda: (c.Stop, {"token": token}),
            lambda: (c.Stop, {"token": token, "deceleration": float(10 ** random.uniform(-1, 2))}),
            *[lambda: (c.SetSpeed, {"fraction": float(random.choice([0.0, 0.05, 0.3, 1.0, 1.0]))})] * 3,
            lambda: (c.Pause, {}),
            lambda: (c.Resume, {}),
            lambda: (c.ServoStart, {}),
            lambda: (c.ServoStop, {}),
            lambda: (c.SetShaper, {"name": str(random.choice(SHAPERS))}),
            lambda: (SimulationInject, {"fault": str(random.choice(["reduced", "normal", "normal"]))}),
            lambda: (SimulationInject, {"fault": "protective_stop"}),
            *[lambda: (c.UnlockProtectiveStop, {})] * 3,
            lambda: None,
        ]
        return options[random.integers(len(options))]()

    def run(self, count=40):
        for _ in range(count):
            chosen = self.command()
            if chosen is None:
                self.robot.controller.client_gone("a", "s")
                self.robot.send(c.ReleaseControl)
                self.robot.token = self.robot.controller.receive(c.TakeControl(client="a")).token
                self.done.append("lease lost")
            else:
                kind, fields = chosen
                reply = self.robot.send(kind, **fields)
                said = reply.code if isinstance(reply, Refused) else type(reply).__name__
                self.done.append(f"{self.robot.controller.tick_number} {kind.__name__} {fields}: {said}")
            self.tick(int(self.random.choice(WAITS)))
        self.robot.send(c.Stop)
        for _ in range(3000):
            if not self.robot.controller.motion.activity.moving:
                break
            self.tick(1)
        self.tick(2)
        assert self.robot.controller.motion.activity in {Activity.REST, Activity.PROTECTIVE_STOP}, self.done
        assert not self.running, self.done

    def tick(self, count):
        for _ in range(count):
            self.robot.events.clear()
            self.robot.tick()
            for event in self.robot.events:
                self.hear(event)
            q = self.robot.controller.cycle.position
            step, before = q - self.q[-1], self.q[-1] - self.q[-2]
            why = self.done[-4:], self.done[0], self.robot.controller.tick_number
            assert np.isfinite(q).all(), why
            assert (np.abs(q) <= np.array(LIMITS.position) + 1e-12).all(), why
            assert np.abs(step).max() / H <= VELOCITY * LIMITS.velocity[0], why
            assert np.abs(step - before).max() / H**2 <= ACCELERATION * LIMITS.acceleration[0], why
            if self.robot.controller.tick_number % 10 == 0:
                assert self.clear.meeting(q) is None, why
            self.q = [self.q[-1], q]

    def hear(self, event):
        if event.kind == "motion_started":
            assert event.id not in self.running | self.ended
            self.running.add(event.id)
        elif event.kind in {"motion_done", "motion_stopped"}:
            self.running.remove(event.id)
            self.ended.add(event.id)
        assert len(self.running) <= 1


@pytest.mark.parametrize("seed", range(20))
def test_whatever_is_sent_limits_range_and_numbers_are_kept(seed):
    Sequence(seed).run()


@pytest.mark.nightly
def test_the_same_holds_in_many_more_sequences():
    for seed in range(20, 20 + share(2000)):
        Sequence(seed).run()
