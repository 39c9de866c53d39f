"""Whether the arm carries what was declared, by what its drives have to add to the torque fed forward."""

import numpy as np
import pinocchio as pin

from tvist_controller.control.differentiator import Floats, Target
from tvist_controller.control.inverse_dynamics import SLEW
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, carries_weight, rigid_model
from tvist_plant.plant import PERIOD

EVERY = 10
"""Ticks that are averaged before they are looked at."""
MEMORY = 2.0
"""Time in which what was seen fades to 1/e [s]: many periods of a vibration."""
ENOUGH = 1.0
"""Time that has to be seen before a judgement [s]."""
TOLERATED = 0.5
"""Mass that a declaration may be wrong by [kg]."""
FRICTION = 0.4
"""Share of the Coulomb friction that may be unknown in each joint, with whatever sign is worst [-]."""


class PayloadMonitor:
    """Compares the payload that is felt with the one declared, in motion and at rest.

    What a drive's feedback adds to the torque fed forward is what the model does not know. A mass μ too much adds
    y(q, q̇, q̈) μ, with y the torque for 1 kg where the declared payload's centre is. So over some time

        μ = Σ yᵀ W r / Σ yᵀ W y,   W = diag(1/F²),      |error of μ| <= Σ_j Σ |y_j| W_j φ F_j / Σ yᵀ W y

    the latter whatever the friction that is not known, up to φF in each joint, does to it. Vibrations have no mean,
    so they do not count for long. A warning needs a μ that friction and an honest inaccuracy together do not explain:
    upright, where gravity has no lever, there is none.

    An arm whose axes are all vertical feels its payload only while it accelerates, and there a soft joint delays what
    its drive feels: it is not judged.

    A frequency that is off would show it, too, but only where the arm rings, and less: 3 kg of 5 change the
    frequency by a fifth and the shoulder's torque by half.

    Args:
        description: The robot.
        declared: What the controller believes that the arm carries.
    """

    def __init__(self, description: RobotDescription, declared: Payload) -> None:
        self._judges = carries_weight(description)
        self._model = rigid_model(description, Payload())
        for number in range(self._model.njoints):  # what is left weighs nothing but the kilogram
            self._model.inertias[number] = pin.Inertia.Zero()
        flange = self._model.frames[self._model.getFrameId(FLANGE)]
        self._last, self._placement = flange.parentJoint, flange.placement
        self._data = self._model.createData()
        self._friction = np.array(description.drives.coulomb_friction)
        # A joint without friction would count for everything.
        self._friction = np.maximum(self._friction, 0.01 * np.array(description.limits.torque))
        self._weight = self._friction**-2
        self._fade = float(np.exp(-EVERY * PERIOD / MEMORY))
        self.declare(declared)

    def declare(self, payload: Payload) -> None:
        """Something else is declared: forget what was seen, and wait until it is in force."""
        self.payload = payload
        kilogram = pin.Inertia(1.0, np.array(payload.com), np.zeros((3, 3)))
        self._model.inertias[self._last] = self._placement.act(kilogram)
        self.reset()
        self._wait = SLEW

    def reset(self) -> None:
        """Forget what was seen: the arm was put elsewhere, its power was off, or something pushed it."""
        self._wait = 0
        self._ticks, self._sum = 0, np.zeros(len(self._friction))
        self._time = self._yy = self._yr = self._bound = 0.0
        self._warned = False

    @property
    def excess(self) -> tuple[float, float]:
        """Mass felt beyond the declared one, and how much of that friction may be [kg]; the latter may be infinite."""
        if self._yy <= 0.0:
            return 0.0, np.inf
        return self._yr / self._yy, self._bound / self._yy

    def update(self, target: Target, expected: Floats, moment: Floats) -> str | None:
        """Look at one tick, while the drives hold the arm.

        Args:
            target: Shaped reference of the tick.
            expected: Torque fed forward for it, rotors and friction included, shape (n,) [N m].
            moment: Motor torques measured at the end of the tick, shape (n,) [N m].

        Returns:
            A sentence, once: the payload declared cannot be right. Then None until another one is declared.
        """
        if self._wait > 0:
            self._wait -= 1
            return None
        self._sum += moment
        self._sum -= expected
        self._ticks += 1
        if self._ticks < EVERY:
            return None
        feedback, self._sum = self._sum / EVERY, np.zeros_like(self._sum)
        self._ticks = 0
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
