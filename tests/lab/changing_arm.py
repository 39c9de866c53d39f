"""A hidden robot whose payload or springs change while it runs, and whose sensors are not those of its file."""

from dataclasses import dataclass

import numpy as np

from tvist_plant.description import Payload
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Measurement
from tvist_plant.variants import hidden, hidden_payload, stiffer

CONSTANTS = 0.05
"""Largest relative error of a joint's torque constant [-]."""
RIPPLE = (0.01, 24)
"""Amplitude of the torque's ripple over the joint's torque limit [-], and its waves per turn of the motor."""
GEAR = 101
"""Turns of a motor per turn of its joint."""
DRIFT = (0.2, 300.0)
"""Share by which friction drifts either way, and the time of a whole period of it [-, s]."""


@dataclass(frozen=True)
class Change:
    """What becomes of an arm without a word."""

    mass: float = 0.0
    """Mass that is added to what the arm carries [kg]."""
    springs: float = 1.0
    """Factor of the stiffness of all gears and links [-]."""


class ChangingArm:
    """A hidden robot with errors of its torque sensors, which can be changed while it rests; a simulated arm."""

    def __init__(self, description, said, seed):
        self._description, self._seed = hidden(description, seed), seed
        self._carried, self.payload = hidden_payload(said, seed), said
        random, limits = np.random.default_rng([seed, 67]), np.array(description.limits.torque)
        n = description.joints
        self._gains = 1.0 + random.uniform(-CONSTANTS, CONSTANTS, n)
        self._ripple = RIPPLE[0] * limits
        self._phases, self._friction_phase = random.uniform(0.0, 2.0 * np.pi, (2, n))
        self._friction = np.array(self._description.drives.coulomb_friction)
        self._width = self._description.drives.friction_width
        self._ticks = 0
        self._last: DriveCommand | None = None
        self._arm = self._made(Change())

    def _made(self, change):
        description = stiffer(self._description, change.springs)
        mass = self._carried.mass + change.mass
        carried = self._carried
        if change.mass:
            like = carried if carried.mass > 0.25 else self._description.payload
            xx, xy, xz, yy, yz, zz = (mass / like.mass * one for one in like.inertia)
            carried = Payload(mass=mass, com=like.com, inertia=(xx, xy, xz, yy, yz, zz))
        return FlexibleArm(description, carried)

    def change(self, change):
        """Make another arm of it, which rests where it rested."""
        assert self._last is not None, "it has been placed"
        self._arm = self._made(change)
        self._arm.reset(self._last, seed=self._seed + self._ticks)

    def reset(self, command, *, payload=None, seed=0):
        """Put the arm at rest."""
        if payload is not None:
            self.payload, self._carried = payload, hidden_payload(payload, self._seed)
            self._arm = self._made(Change())
        self._last = command
        return self._read(self._arm.reset(command, seed=seed))

    def step(self, command):
        """Move the arm by one period."""
        self._ticks += 1
        self._last = command
        return self._read(self._arm.step(command))

    def _read(self, measured):
        """Return what its sensors show: a drive with more friction also needs more torque."""
        share, period = DRIFT
        drift = share * np.sin(2.0 * np.pi * self._ticks * PERIOD / period + self._friction_phase)
        torque = measured.moment + drift * self._friction * np.tanh(measured.qd / self._width)
        ripple = self._ripple * np.sin(RIPPLE[1] * GEAR * measured.q + self._phases)
        return Measurement(measured.q, measured.qd, self._gains * torque + ripple, measured.accelerometer)
