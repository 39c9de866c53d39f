"""Feed-forward of the arm's elasticity: motors lead so that an elastic arm's flange stays on target."""

import numpy as np
import pinocchio as pin

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.elastic_lead import (
    FRICTION,
    FRICTION_WIDTH,
    LAW,
    LEAST,
    LINEAR,
    MOST,
    PERIOD,
    ROTOR,
    STICTION,
    WITH_LAW,
    WITH_TORQUES,
    command_motors,
    memory_for,
    parts,
)
from tvist_plant.chain import BODY, chain_of
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.model import FLANGE, flexible_model, rigid_model

TORQUE_SHARE = 0.95
"""Fraction of a drive's torque limit that target and lead may use together [-]."""
LEAST_ROOM = 0.05  # fraction of a drive's torque limit that the lead may always use [-]
SETTLED = 1e-8  # lead below which the motors count as settled [rad]


class ElasticFeedForward:
    """Drive commands for an elastic arm.

    With the lead w of `elastic_lead` the drives get q* + w, q̇* + ẇ, and τ* + B (q̈* + ẅ) + friction(q̇* + ẇ), where τ*
    includes the acceleration of the bending links. Central differences give ẇ and ẅ, so commands are one tick late
    (`delay`). ẅ contains the reference's fourth derivative. Where the reference is not smooth, as at the start of a
    stop, ẅ is limited to the torque left by the target, and w and ẇ stay continuous. Springs and gains of the
    description are not used.
    """

    def __init__(
        self,
        description: RobotDescription,
        stiffness: Floats,  # of each gear and bending joint, in the model's order, shape (N,) [N m/rad]
        damping_time: Floats,  # damping divided by stiffness, shape (N,) [s]
        period: float,  # tick [s]
        *,
        torques: bool = True,  # whether the lead affects torques, not only positions and velocities
        law: Floats
        | None = None,  # known friction, first rows of `LAWS`; None for a share of the Coulomb friction
    ) -> None:
        flexible, rigid = flexible_model(description, Payload()), rigid_model(description, Payload())
        self.delay = period  # delay of commands behind their targets [s]
        self._memory = memory = memory_for(flexible.model.nv, description.joints, len(flexible.flexes))
        self.lead = lead = parts(memory)  # the arm's memory as the kernels use it
        drives = description.drives
        memory[PERIOD], memory[FRICTION_WIDTH], memory[LINEAR] = (
            period,
            drives.friction_width,
            drives.linear_friction,
        )
        memory[WITH_TORQUES], memory[WITH_LAW] = torques, law is not None
        lead.joints[:], lead.flexes[:] = flexible.joints, flexible.flexes
        lead.chain[:] = chain_of(flexible.model, flexible.flange)
        lead.springs[:] = stiffness, damping_time / period
        limits, friction = np.array(description.limits.torque), np.array(drives.coulomb_friction)
        lead.drives[ROTOR] = drives.rotor_inertia
        lead.drives[FRICTION] = (
            friction / drives.friction_width
            if drives.linear_friction
            else drives.friction_feedforward * friction
        )
        if law is not None:
            lead.drives[LAW : LAW + len(law)] = law
            friction = law[0] * np.maximum(law[1], 1.0) + law[4] * np.array(description.limits.velocity)
        lead.drives[MOST], lead.drives[LEAST] = TORQUE_SHARE * limits - friction, LEAST_ROOM * limits
        own = rigid.frames[rigid.getFrameId(FLANGE)]
        self._placement = flexible.model.frames[flexible.flange].placement * own.placement.inverse()
        self._bare, self._carried = lead.chain[-2, BODY:].copy(), np.zeros(0)
        self._ticks = 0
        self._sag: Floats | None = None
        self.motors: Floats = np.zeros((3, description.joints))
        """Velocity [rad/s], acceleration [rad/s^2] and torque [N m] of the last command, shape (3, n)."""
        self.limited = False  # whether the lead's acceleration was limited at the last tick

    def reset(self, stiction: Floats | float = 0.0) -> None:
        """Restart from the next target's lead and the motors' given stiction [N m]."""
        self._ticks, self.limited = 0, False
        self.lead.drives[STICTION] = stiction

    @property
    def settled(self) -> bool:
        """Whether the motors' lead over the joints has been zero for some ticks."""
        return self._ticks == 0 or float(np.abs(self.lead.leads[1]).max()) < SETTLED

    def command(
        self,
        target: Floats,  # shaped reference, its derivatives, and τ* of the rigid arm, shape (4, n)
        carried: Floats,  # inertial parameters of the payload, see `InverseDynamics.payload_parameters`
        sag: Floats | None = None,  # further lead by the twist of the gears under gravity, shape (n,) [rad]
        *,
        smooth: bool = True,  # so that the reference's sixth derivative says how bending links accelerate
    ) -> DriveCommand:
        """Take a target and return the command for the previous tick's target."""
        if carried is not self._carried:
            self._carried = carried
            self.lead.chain[-2, BODY:] = self._bare + _moved(carried, self._placement)
        motors = np.empty_like(target)
        self.limited = command_motors(self._memory, target, self._ticks, smooth, motors)
        its_sag, self._sag = sag if self._ticks == 0 else self._sag, sag
        self.motors, self._ticks = motors[1:], self._ticks + 1
        if sag is not None and its_sag is not None:
            motors[0] += its_sag
            motors[1] += (sag - its_sag) / self.delay
        return DriveCommand(motors[0], motors[1], motors[3])


def _moved(parameters: Floats, placement: pin.SE3) -> Floats:
    """Transform inertial parameters (10,) by a placement; unlike `pin.Inertia`, with any mass."""
    mass, p = parameters[0], placement.translation
    h = placement.rotation @ parameters[1:4]
    xx, xy, yy, xz, yz, zz = parameters[4:]
    turned = placement.rotation @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ placement.rotation.T
    shift = 2.0 * (p @ h) * np.eye(3) - np.outer(p, h) - np.outer(h, p)
    inertia = turned + shift + mass * (p @ p * np.eye(3) - np.outer(p, p))
    return np.concatenate([[mass], h + mass * p, inertia[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]])
