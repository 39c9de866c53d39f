"""Whether the arm is still the one of the motions before: payload, gears, and what rings after stops."""

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from tvist_controller.line.sample import Sample
from tvist_controller.safety.change_detector import SHOWN, Change, ChangeDetector
from tvist_controller.safety.ring_listener import RingListener
from tvist_plant.description import Payload, RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_protocol.replies import Code

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
FEW = 8
"""Number of payloads whose past is remembered."""


class FitMonitor:
    """Measures after each stop whether the arm has changed, and says so once; see `ChangeDetector`.

    Three quantities are followed from motion to motion, each against its own past, so that neither a torque constant
    that is wrong nor springs that are not those of the robot file make a difference:

    - the mass that the drives feel beyond the declared one, see `PayloadMonitor`;
    - the logarithm of the angle by which each gear gives way under a torque at rest, between its motor and its link,
      as far as the encoders are on the link side;
    - the logarithm of the factor by which modes differ from those of the calibration, see `RingListener`.

    A tick fills rows of arrays. What is measured is computed in the ticks after the stop: some 0.1 ms in each,
    and 0.6 ms in those that compute the modes of a pose, one a stop, and twenty in each of the first stops.

    Args:
        description: The robot.
        calibration: Calibration of its modes; None without one.
        declared: Declared payload.
    """

    def __init__(
        self, description: RobotDescription, calibration: Calibration | None, declared: Payload
    ) -> None:
        n = description.joints
        self._names = description.robot.joints
        self._friction = np.array(description.drives.coulomb_friction)
        self._stiffness = np.array(description.drives.gear_stiffness)
        self._listener = RingListener(description, calibration, declared)
        self._gears = [ChangeDetector(*GEAR) for _ in range(n)]
        self._of_payload: dict[Payload, tuple[ChangeDetector, ChangeDetector]] = {}
        self._accelerometer = np.empty((LISTENED, 3))
        self._torque, self._twist = np.empty((2, LISTENED, n))
        self.declare(declared)

    def declare(self, payload: Payload) -> None:
        """Take another payload into account; what was measured with it before counts again."""
        fresh = ChangeDetector(*MASS), ChangeDetector(*MODES)
        self._mass, self._modes = self._of_payload.pop(payload, fresh)
        self._of_payload[payload] = self._mass, self._modes
        if len(self._of_payload) > FEW:
            del self._of_payload[next(iter(self._of_payload))]
        self._listener.declare(payload)
        self.reset()

    def reset(self) -> None:
        """Forget the present motion, since it does not count as one."""
        self._rows = LISTENED
        self._work: Iterator[None] | None = None
        self._said: list[tuple[Code, str]] = []

    def update(self, sample: Sample, mass: tuple[float, float]) -> list[tuple[Code, str]]:
        """Take one tick in which the drives hold the arm.

        Args:
            sample: Its signals.
            mass: What the drives have felt in the present motion beyond the declared mass, and its bound [kg].

        Returns:
            What has changed, as codes and sentences of warnings; mostly nothing.
        """
        rows = self._rows
        if not sample.mode.at_rest:
            self._rows = 0
            if SHORTEST <= rows < LISTENED:
                self._work = self._study(rows, sample, mass)
        elif rows < LISTENED:
            measured = sample.measured
            self._accelerometer[rows], self._torque[rows] = measured.accelerometer, measured.moment
            self._twist[rows] = sample.command.q - measured.q
            self._rows = rows + 1
            if self._rows == LISTENED:
                self._work = self._study(LISTENED, sample, mass)
        if self._work is not None and next(self._work, self) is self:
            self._work = None
            said, self._said = self._said, []
            return said
        return []

    def _study(self, rows: int, sample: Sample, mass: tuple[float, float]) -> Iterator[None]:
        """Measure after a stop, and compare, in pieces for one tick each."""
        alpha, q = self._accelerometer[:rows].copy(), sample.measured.q
        last = slice(rows - SETTLED, rows)
        torque, twist = self._torque[last].mean(axis=0), self._twist[last].mean(axis=0)
        detectors, said = (self._mass, self._modes), self._said
        excess, bound = mass
        if bound < 2.0 * HEAVY:
            said += _told("payload_mismatch", detectors[0].take(excess, 0.5 * bound), _of_mass)
        yield
        for joint, detector in enumerate(self._gears):
            if twist[joint] * torque[joint] <= 0.0:
                continue
            error = float(np.hypot(FRICTION * self._friction[joint] / torque[joint], OFF / twist[joint]))
            if error < VAGUE:
                softer = float(np.log(twist[joint] * self._stiffness[joint] / torque[joint]))
                said += _told(
                    "model_mismatch",
                    detector.take(softer, error),
                    partial(_of_gear, joint=self._names[joint]),
                )
                yield
        heard = yield from self._listener.study(alpha, q)
        for u, error in heard:
            said += _told("model_mismatch", detectors[1].take(u, error), _of_modes)
            yield


def _told(code: Code, change: Change | None, why: Callable[[Change], str]) -> list[tuple[Code, str]]:
    return [] if change is None else [(code, why(change))]


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
