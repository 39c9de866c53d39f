"""Commands to the drives: set-points with their feed-forward."""

import numpy as np

from tvist_controller.control.differentiator import Floats, Target
from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand


class JointControllers:
    """Feed-forward for the drives; their feedback control runs in the drives themselves.

    - Torque: τ_ff = τ* + B q̈* + friction; the rotors' inertia and a share of Coulomb friction are added to the
      torque of the rigid arm.
    - Wind-up: a gear that transmits τ - g twists by (τ - g)/K_g. The motor leads by a share c_w of that, so that the
      link is closer to its reference.
    - Sag: the twist by gravity itself, g/K_g, is left, as on the paper's robot, or the motor leads by all of it, so
      that the link rests on its reference. g(q*) has neither feedback nor a delay, and is as smooth as q*.

    Args:
        description: The robot.
        period: Tick [s].
        compensate_sag: Whether the motors lead by the twist of the gears under gravity.
    """

    def __init__(self, description: RobotDescription, period: float, *, compensate_sag: bool = False) -> None:
        drives = description.drives
        self._period = period
        self._rotor = np.array(drives.rotor_inertia)
        self._compliance = np.array(drives.windup_feedforward) / np.array(drives.gear_stiffness)
        self._yielding = 1.0 / np.array(drives.gear_stiffness) if compensate_sag else None
        friction = np.array(drives.coulomb_friction)
        self._linear = drives.linear_friction
        self._viscous = friction / drives.friction_width
        self._coulomb = drives.friction_feedforward * friction
        self._width = drives.friction_feedforward_width
        self._windup = np.zeros(description.joints)

    def reset(self, gravity: Floats) -> None:
        """Restart at rest.

        Args:
            gravity: Torque that balances gravity there, shape (n,) [N m].
        """
        self._windup = np.zeros_like(gravity) if self._yielding is None else self._yielding * gravity

    def sag(self, gravity: Floats) -> Floats | None:
        """Lead by which the motors compensate the twist under gravity, shape (n,) [rad]; None if they do not."""
        return None if self._yielding is None else self._yielding * gravity

    def command(self, target: Target, torque: Floats, gravity: Floats) -> DriveCommand:
        """Drive command for a target.

        Args:
            target: Shaped reference and its derivatives.
            torque: τ* of the rigid arm, shape (n,) [N m].
            gravity: The part of the torque that balances gravity, shape (n,) [N m].
        """
        windup = self._compliance * (torque - gravity)
        if self._yielding is not None:
            windup += self._yielding * gravity
        windup_speed = (windup - self._windup) / self._period
        self._windup = windup
        friction = (
            self._viscous * target.qd if self._linear else self._coulomb * np.tanh(target.qd / self._width)
        )
        return DriveCommand(
            q=target.q + windup,
            qd=target.qd + windup_speed,
            torque=torque + self._rotor * target.qdd + friction,
        )
