"""Detection of a wrong declared payload, from the torque that the drives' feedback adds to the feed-forward."""

import numpy as np
import pinocchio as pin

from tvist_controller.control.differentiator import Floats, Target
from tvist_controller.control.inverse_dynamics import SLEW
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, carries_weight, rigid_model
from tvist_plant.plant import PERIOD

EVERY = 10
"""Number of ticks that are averaged into one measurement."""
MEMORY = 2.0
"""Time in which the weight of a measurement decays to 1/e [s]; many periods of a vibration."""
ENOUGH = 1.0
"""Observation time required for a judgement [s]."""
TOLERATED = 0.5
"""Error of the declared mass that is tolerated [kg]."""
FRICTION = 0.4
"""Share of the Coulomb friction that may be unknown in each joint, with the worst sign [-]."""


class PayloadMonitor:
    """Compares the payload that the drives feel with the declared one, in motion and at rest.

    The torque that a drive's feedback adds to the feed-forward is what the model does not explain. A mass error μ
    adds y(q, q̇, q̈) μ, with y the torque for 1 kg at the declared payload's centre of mass. Over some time, the
    estimate is

        μ = Σ yᵀ W r / Σ yᵀ W y,   W = diag(1/F²),      |error of μ| <= Σ_j Σ |y_j| W_j φ F_j / Σ yᵀ W y

    where the bound covers any unknown friction of up to φF in each joint. Vibrations have zero mean and cancel out. A
    warning requires that μ exceed what friction and the tolerated error of the declaration explain together. In an
    upright posture, where gravity has no lever arm, there is therefore no warning.

    An arm with only vertical axes is not judged: it feels its payload only while it accelerates, and there a soft joint
    delays what its drive feels.

    A deviating frequency would show the error too, but only while the arm vibrates, and less clearly: 3 kg instead of
    5 kg change the frequency by a fifth and the shoulder's torque by half.

    Args:
        description: The robot.
        declared: Declared payload.
    """

    def __init__(self, description: RobotDescription, declared: Payload) -> None:
        self._judges = carries_weight(description)
        self._model = rigid_model(description, Payload())
        for number in range(self._model.njoints):  # only the kilogram has mass in this model
            self._model.inertias[number] = pin.Inertia.Zero()
        flange = self._model.frames[self._model.getFrameId(FLANGE)]
        self._last, self._placement = flange.parentJoint, flange.placement
        self._data = self._model.createData()
        self._friction = np.array(description.drives.coulomb_friction)
        # Without this floor, a joint without friction would dominate the estimate.
        self._friction = np.maximum(self._friction, 0.01 * np.array(description.limits.torque))
        self._weight = self._friction**-2
        self._fade = float(np.exp(-EVERY * PERIOD / MEMORY))
        self.declare(declared)

    def declare(self, payload: Payload) -> None:
        """Set another declared payload: discard past measurements, and wait until it is fully phased in."""
        self.payload = payload
        kilogram = pin.Inertia(1.0, np.array(payload.com), np.zeros((3, 3)))
        self._model.inertias[self._last] = self._placement.act(kilogram)
        self.reset()
        self._wait = SLEW

    def reset(self) -> None:
        """Discard past measurements, since the arm was placed elsewhere, its power was off, or something pushed it."""
        self._wait = 0
        self._torques: list[tuple[Floats, Floats]] = []
        self._time = self._yy = self._yr = self._bound = 0.0
        self._warned = False

    @property
    def excess(self) -> tuple[float, float]:
        """Estimated mass error of the declaration, and its bound from friction, which may be infinite [kg]."""
        if self._yy <= 0.0:
            return 0.0, np.inf
        return self._yr / self._yy, self._bound / self._yy

    def update(self, target: Target, expected: Floats, moment: Floats) -> str | None:
        """Take one tick in which the drives hold the arm.

        Args:
            target: Shaped reference at the tick.
            expected: Feed-forward torque for it, with rotors and friction, shape (n,) [N m].
            moment: Motor torques measured at the end of the tick, shape (n,) [N m].

        Returns:
            Once, a sentence saying that the declared payload cannot be right; otherwise None, until another is
            declared.
        """
        if self._wait > 0:
            self._wait -= 1
            return None
        self._torques.append((moment, expected))
        if len(self._torques) < EVERY:
            return None
        moments, feed_forward = np.sum(self._torques, axis=0) / EVERY
        feedback = moments - feed_forward
        self._torques.clear()
        per_kg = pin.rnea(self._model, self._data, target.q, target.qd, target.qdd)
        weighted = self._weight * per_kg
        fade = self._fade
        self._time = fade * self._time + EVERY * PERIOD
        self._yy = fade * self._yy + float(weighted @ per_kg)
        self._yr = fade * self._yr + float(weighted @ feedback)
        self._bound = fade * self._bound + FRICTION * float(np.abs(weighted) @ self._friction)
        return self._judge()

    def _judge(self) -> str | None:
        if not self._judges or self._warned or self._time < ENOUGH:
            return None
        mass, bound = self.excess
        if not abs(mass) > TOLERATED + bound:
            return None
        self._warned = True
        felt = max(self.payload.mass + mass, 0.0)
        return (
            f"{self.payload.mass:g} kg are declared, but the drives hold about {felt:.1f} kg (within {bound:.1f} kg): "
            "declare the actual payload, or find out what pushes the arm"
        )
