"""Whether the arm is still the one of the motions before: payload, gears, and what rings after stops."""

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pinocchio as pin

from tvist_lab.metrics.change_detector import SHOWN, Change, ChangeDetector
from tvist_lab.metrics.ring_listener import RingListener
from tvist_lab.recordings import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import carries_weight, rigid_model

LISTENED = 150
"""Ticks after a stop in which the tool is listened to."""
SHORTEST = 100
"""Fewest of them, if the next motion begins sooner."""
SETTLED = 50
"""Number of the last of these, in which the gears show how far they give way."""
FRICTION = 0.2
"""Standard deviation of the friction in a torque at rest, over the joint's Coulomb friction [-]."""
OFF = 1e-4
"""Standard deviation of the angle at rest, as of the gear's error and of integrators that still move [rad]."""
VAGUE = 0.25
"""Relative error from which on a gear's compliance is not known in a pose [-]."""
HEAVY = 0.7
"""Error of a motion's mass from which on it says nothing [kg]."""
MASS, GEAR, MODES = (1.0, 0.15, 0.7), (0.4, 0.05, 0.15), (0.1, 0.02, 0.03)
"""Arguments of the detectors: how well the mean is known before any measurement, expected scatter, least change that is
told; in kg, and for logarithms.
"""
UNKNOWN = 0.4
"""Share of the Coulomb friction that may be unknown in each joint, with the worst sign [-]."""


class FitMonitor:
    """Measures after each stop whether the arm has changed; see `ChangeDetector`.

    Three quantities are followed from motion to motion, each against its own past, so that neither a torque constant
    that is wrong nor springs that are not those of the robot file make a difference:

    - the mass that the drives feel beyond the declared one;
    - the logarithm of the angle by which each gear gives way under a torque at rest, between its motor and its link,
      as far as the encoders are on the link side;
    - the logarithm of the factor by which modes differ from those of the robot file, see `RingListener`.

    Args:
        description: The robot.
        payload: Payload that it was declared to carry.
    """

    def __init__(self, description: RobotDescription, payload: Payload) -> None:
        self._names = description.robot.joints
        self._friction = np.array(description.drives.coulomb_friction)
        # Without this floor, a joint without friction would dominate the estimate of the mass.
        self._unsure = np.maximum(self._friction, 0.01 * np.array(description.limits.torque))
        self._stiffness = np.array(description.drives.gear_stiffness)
        self._weighs = carries_weight(description)
        self._arm = rigid_model(description, Payload())
        self._loaded = rigid_model(description, Payload(mass=1.0, com=payload.com))
        self._listener = RingListener(description, payload)
        self._mass, self._modes = ChangeDetector(*MASS), ChangeDetector(*MODES)
        self._gears = [ChangeDetector(*GEAR) for _ in range(description.joints)]

    def stop(
        self, target: Floats, q: Floats, moment: Floats, expected: Floats, alpha: Floats
    ) -> Iterator[str]:
        """Measure after a stop, and compare.

        Args:
            target: Commanded angles at rest, shape (n,) [rad].
            q: Measured angles from the stop on, shape (T, n) [rad].
            moment: Measured motor torques, shape (T, n) [N m].
            expected: Torques of the feed-forward, shape (T, n) [N m].
            alpha: Readings of the accelerometer, shape (T, 3) [m/s²].

        Returns:
            What has changed, a clause each; mostly nothing.
        """
        if self._weighs:
            excess, bound = self._felt(target, (moment - expected).mean(axis=0))
            if bound < 2.0 * HEAVY:
                yield from _told(self._mass.take(excess, 0.5 * bound), _of_mass)
        torque, twist = moment[-SETTLED:].mean(axis=0), (target - q[-SETTLED:]).mean(axis=0)
        for joint, detector in enumerate(self._gears):
            if twist[joint] * torque[joint] <= 0.0:
                continue
            error = float(np.hypot(FRICTION * self._friction[joint] / torque[joint], OFF / twist[joint]))
            if error < VAGUE:
                softer = float(np.log(twist[joint] * self._stiffness[joint] / torque[joint]))
                yield from _told(detector.take(softer, error), partial(_of_gear, joint=self._names[joint]))
        for u, error in self._listener.study(alpha, q[-1]):
            yield from _told(self._modes.take(u, error), _of_modes)

    def _felt(self, q: Floats, feedback: Floats) -> tuple[float, float]:
        """Mass that explains what the drives' feedback adds at rest, and its bound from friction [kg]."""
        per_kg = _weight(self._loaded, q) - _weight(self._arm, q)
        weighted = per_kg / self._unsure**2
        square = float(weighted @ per_kg)
        if square <= 0.0:
            return 0.0, math.inf
        return float(weighted @ feedback) / square, UNKNOWN * float(np.abs(weighted) @ self._unsure) / square


def _weight(model: pin.Model, q: Floats) -> Floats:
    return np.asarray(pin.computeGeneralizedGravity(model, model.createData(), q))


def _told(change: Change | None, why: Callable[[Change], str]) -> Iterator[str]:
    if change is not None:
        yield why(change)


def _of_mass(change: Change) -> str:
    more = change.after - change.before
    return (
        f"the arm carries about {abs(more):.1f} kg {'more' if more > 0.0 else 'less'} than in the motions before "
        f"(within {SHOWN * change.error:.1f} kg), and nobody has declared it: declare the payload with set_payload, or "
        "find out what pushes the arm"
    )


def _of_gear(change: Change, joint: str) -> str:
    size, within = _percent(change.before - change.after, change.error)
    return (
        f"the gear of the {joint} is {size:.0f} % {'softer' if change.after > change.before else 'stiffer'} than in "
        f"the motions before (within {within:.0f} %), by the angle that it gives way at rest: look for a "
        "loose or worn joint, then measure the arm anew with tvist identify"
    )


def _of_modes(change: Change) -> str:
    size, within = _percent(change.after - change.before, change.error)
    return (
        f"what rings after stops is {size:.0f} % {'higher' if change.after > change.before else 'lower'} in frequency "
        f"than after the stops before (within {within:.0f} %): look whether mount, base, a joint or the tool "
        "is loose or another tool is on, then measure the arm anew with tvist identify"
    )


def _percent(logarithm: float, error: float) -> tuple[float, float]:
    """Size of a change whose logarithm has this standard error, and its distance from its interval's nearer end [%]."""
    nearer = math.copysign(abs(logarithm) - SHOWN * error, logarithm)
    return 100.0 * abs(math.expm1(logarithm)), 100.0 * abs(math.exp(logarithm) - math.exp(nearer))
