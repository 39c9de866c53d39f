"""A hidden robot with errors of its torque sensors, which makes random motions and becomes another in between."""

import numpy as np

from tvist_controller.api.line import Setup, body, load_calibration, paper_payload
from tvist_controller.api.robot import Controller
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import Payload, load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.hidden import hidden, hidden_payload
from tvist_plant.plant import Measurement
from tvist_plant.variants import stiffer
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.replies import Accepted

CONSTANTS = 0.05
"""Largest relative error of a joint's torque constant [-]."""
RIPPLE = (0.01, 24 * 101)
"""Amplitude of the torque's ripple over the joint's torque limit [-], and its waves per turn of the joint."""
SPEEDS = ((0.6, 1.0, 50.0), (1.05, 1.4, 100.0), (1.5, 2.0, 100.0), (1.5, 3.0, 200.0))
"""Velocity, acceleration and jerk of the motions [rad/s, rad/s², rad/s³]."""


class ChangingArm:
    def __init__(self, description, said, seed):
        self._description, self._seed, self.payload = hidden(description, seed), seed, said
        self._carried = hidden_payload(said, seed)
        random, n = np.random.default_rng([seed, 67]), description.joints
        self._gains = 1.0 + random.uniform(-CONSTANTS, CONSTANTS, n)
        self._phases = random.uniform(0.0, 2.0 * np.pi, n)
        self._ripple = RIPPLE[0] * np.array(description.limits.torque)
        self.become()

    def become(self, mass=0.0, springs=1.0):
        """Carry so much more from now on, with gears and links that are stiffer by this factor."""
        carried = self._carried
        heavier = Payload(mass=carried.mass + mass, com=carried.com, inertia=carried.inertia)
        self._arm = FlexibleArm(stiffer(self._description, springs), heavier)

    def reset(self, command, *, payload=None, seed=0):
        self.payload = self.payload if payload is None else payload
        return self._read(self._arm.reset(command, seed=seed))

    def step(self, command):
        self.last = command
        return self._read(self._arm.step(command))

    def _read(self, measured):
        ripple = self._ripple * np.sin(RIPPLE[1] * measured.q + self._phases)
        return Measurement(
            measured.q, measured.qd, self._gains * measured.moment + ripple, measured.accelerometer
        )


class Worker:
    """A robot with such an arm; `states` has the state after each tick."""

    def __init__(self, seed):
        description, self._random = load("ur5e"), np.random.default_rng([seed, 73])
        payload = paper_payload(description, float(self._random.uniform(0.5, 3.0)))
        self.arm = ChangingArm(description, body(payload), seed)
        setup = Setup(
            description=description, q=description.poses["Q1"], payload=payload,
            calibration=load_calibration("ur5e_modal"), shaper="none", clock="free", seed=seed,
        )  # fmt: skip
        self.controller = Controller(setup, self.arm)
        self._token = self.controller.receive(TakeControl(client="test")).token
        self.states = []

    def change(self, **becomes):
        self.arm.become(**becomes)
        self.arm.reset(self.arm.last, seed=len(self.states))

    def move(self):
        """Make a random motion, and rest."""
        while not isinstance(self.controller.receive(self._drawn()), Accepted):
            pass
        self._tick()
        while not self.controller.cycle.mode.at_rest:
            self._tick()
        for _ in range(int(self._random.integers(150, 400))):
            self._tick()

    def _drawn(self):
        here = np.array(self.controller.latest.reference_q)
        away = self._random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0]) - here
        q = here + self._random.uniform(0.3, 1.0) * away
        velocity, acceleration, jerk = SPEEDS[self._random.integers(len(SPEEDS))]
        return MoveJ(
            token=self._token,
            q=tuple(q.tolist()),
            velocity=velocity,
            acceleration=acceleration,
            jerk=jerk,
        )

    def _tick(self):
        self.controller.tick()
        self.states.append(self.controller.latest)
