"""Feed-forward of the arm's elasticity: drives lead, so that the flange of an elastic arm stays on its target."""

import numpy as np

from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.elastic_lead import lead_of
from tvist_controller.line.elastic_model import ElasticModel
from tvist_controller.line.motor_command import motor_command
from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand

TORQUE_SHARE = 0.95
"""Share of a drive's torque limit that target and lead may need together [-]."""
LEAST_ROOM = 0.05
"""Share of a drive's torque limit that the lead may always need, however much the target needs [-]."""
SETTLED = 1e-8
"""A lead below this counts as none [rad]."""


class ElasticFeedForward:
    """Commands for drives that move an elastic arm.

    With the lead w of `elastic_lead` the drives get q* + w, q̇* + ẇ, and τ* + B (q̈* + ẅ) + friction(q̇* + ẇ), where τ*
    contains what the bending links' own acceleration adds. Central
    differences give ẇ and ẅ, so commands are a tick later than their target, as `delay` says. ẅ is a fourth derivative
    of the reference, so that must be smooth; where it is not, as at the beginning of a stop, ẅ is limited to the torque
    that the target leaves, and w and ẇ stay continuous.

    Args:
        description: The robot, of which masses, geometry, rotors, friction and torque limits are used.
        model: The arm's springs.
        period: Tick [s].
        torques: Whether torques count with the lead; otherwise only positions and velocities do.
        law: Identified friction, see `friction.LAWS`, shape (5, n). None for a share of the Coulomb
            friction in the description.
    """

    def __init__(
        self,
        description: RobotDescription,
        model: ElasticModel,
        period: float,
        *,
        torques: bool = True,
        law: Floats | None = None,
    ) -> None:
        drives, limits = description.drives, np.array(description.limits.torque)
        self.delay = period
        """Time by which commands are later than their targets [s]."""
        self._period, self._torques = period, torques
        self._model, self._springs = model, model.loads()
        self._damping = model.damping_time / period
        self._rotor = np.array(drives.rotor_inertia)
        friction = np.array(drives.coulomb_friction)
        self._law = np.zeros((0, 0)) if law is None else law
        largest = friction
        if law is not None:
            largest = law[0] * np.maximum(law[1], 1.0) + law[4] * np.array(description.limits.velocity)
        self._most, self._least = TORQUE_SHARE * limits - largest, LEAST_ROOM * limits
        self._linear, self._width = drives.linear_friction, drives.friction_width
        self._friction = friction / self._width if self._linear else drives.friction_feedforward * friction
        self._wanted, self._led = np.zeros((2, 3, description.joints))
        self._before, self._loads = np.zeros(model.size), np.zeros((2, model.size))
        self._bent = np.zeros((3, len(model.flexes)))
        self._ticks = 0
        self._late: tuple[Target, Floats, Floats | None] | None = None
        """Target of the tick before, its torque with that of the rotors, and its sag."""
        self.qdd: Floats = np.zeros(description.joints)
        """Acceleration q̈* + ẅ of the last command, shape (n,) [rad/s^2]."""
        self.limited = False
        """Whether the lead's acceleration was limited at the last tick."""

    def reset(self) -> None:
        """Restart with the lead of the next targets."""
        self._late, self._ticks, self.limited = None, 0, False

    @property
    def settled(self) -> bool:
        """Whether the motors do not lead, and have not led for some ticks."""
        return self._late is None or float(np.abs(self._led).max()) < SETTLED

    def rehearse(self) -> None:
        """Compute commands at rest, since the first ones load compiled code, which takes many ticks."""
        still = np.zeros((3, len(self._rotor)))
        for _ in range(len(self._led) + 2):
            self.command(Target(*still), still[0], np.zeros(10))
        self.reset()

    def command(
        self,
        target: Target,
        torque: Floats,
        carried: Floats,
        sag: Floats | None = None,
        *,
        smooth: bool = True,
    ) -> DriveCommand:
        """Take a target, and return the command for the target of the tick before.

        Args:
            target: Shaped reference and its derivatives.
            torque: τ* of the rigid arm, shape (n,) [N m].
            carried: Inertial parameters of the payload, see `InverseDynamics.payload_parameters`.
            sag: A further lead, by the twist of the gears under gravity, shape (n,) [rad].
            smooth: Whether the reference is, so that its sixth derivative says how bending links accelerate.
        """
        model, springs, first = self._model, self._springs, self._late is None
        springs.carry(carried)
        needed, command, qdd = np.empty(len(torque)), np.empty((3, len(torque))), np.empty(len(torque))
        lead_of(
            springs.chain, target.q, target.qd, target.qdd, model.joints, model.flexes, model.stiffness, self._damping,
            self._bent, self._before, first, smooth, self._period, springs.motion, springs.scratch, springs.jacobian,
            self._loads, self._wanted, torque, self._rotor, self._torques, needed,
        )  # fmt: skip
        late, its_torque, its_sag = self._late or (target, needed, sag)
        self._late = (target, needed, sag)
        self.limited = motor_command(
            late.q, late.qd, late.qdd, its_torque, self._wanted, self._led, self._ticks, self._most, self._least,
            self._rotor, self._friction, self._width, self._linear, self._torques, self._period, self._law,
            command, qdd,
        )  # fmt: skip
        self.qdd, self._ticks = qdd, self._ticks + 1
        q, qd, motor_torque = command
        if sag is not None and its_sag is not None:
            q += its_sag
            qd += (sag - its_sag) / self._period
        return DriveCommand(q=q, qd=qd, torque=motor_torque)
