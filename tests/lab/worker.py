"""A hidden robot that makes everyday motions, and can change meanwhile."""

import numpy as np
from tests.lab.changing_arm import ChangingArm

from tvist_controller.api.line import Setup, body, load_calibration, paper_payload
from tvist_controller.api.robot import Controller
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.replies import Accepted

SPEEDS = ((0.6, 1.0, 50.0), (1.05, 1.4, 100.0), (1.5, 2.0, 100.0), (1.5, 3.0, 200.0))
"""Velocity, acceleration and jerk of the motions [rad/s, rad/s², rad/s³]."""
REST = (150, 400)
"""Shortest and longest rest between two motions, in ticks."""
PAYLOADS = (0.5, 3.0)
"""Smallest and largest declared payload [kg]."""


class Worker:
    """A hidden robot that moves all day, without a shaper.

    Args:
        robot: Name of the robot file.
        seed: Seed of robot, payload and motions.
    """

    def __init__(self, robot, seed):
        description, self.random = load(robot), np.random.default_rng([seed, 73])
        payload = paper_payload(description, float(self.random.uniform(*PAYLOADS)))
        self.arm = ChangingArm(description, body(payload), seed)
        setup = Setup(
            description=description, q=description.poses["Q1"], payload=payload,
            calibration=load_calibration(f"{robot}_modal"), shaper="none", clock="free", seed=seed,
        )  # fmt: skip
        self.controller = Controller(setup, self.arm)
        reply = self.controller.receive(TakeControl(client="worker"))
        assert isinstance(reply, Accepted), "nobody else has control"
        self._token = str(reply.token)
        self.states = []
        """What it has published."""

    def move(self):
        """Make a random motion, and rest."""
        while not isinstance(self.controller.receive(self._drawn()), Accepted):
            pass
        self._tick()
        while not self.controller.cycle.mode.at_rest:
            self._tick()
        for _ in range(int(self.random.integers(*REST))):
            self._tick()

    def _drawn(self):
        here = np.array(self.controller.latest.reference_q)
        away = self.random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0]) - here
        q = tuple((here + self.random.uniform(0.3, 1.0) * away).tolist())
        velocity, acceleration, jerk = SPEEDS[self.random.integers(len(SPEEDS))]
        return MoveJ(token=self._token, q=q, velocity=velocity, acceleration=acceleration, jerk=jerk)

    def _tick(self):
        self.states.append(self.controller.tick()[0])
