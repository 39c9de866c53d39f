"""Feed-forward of the arm's elasticity: drives lead, so that the flange of an elastic arm stays on its target."""

import numpy as np

from tvist_controller._compiled import compiled_for_ticks
from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.elastic_lead import Integers, lead_of
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
ROTOR, FRICTION, MOST, LEAST, DRIVES = range(5)
"""Rows of the parameters of the drives, see `lead_of` and `motor_command`; their number."""


@compiled_for_ticks
def keep(q: Floats, qd: Floats, qdd: Floats, torque: Floats, late: Floats) -> None:
    """Keep a target and its torque for the next tick, arguments as in `command_motors`."""
    for j in range(q.shape[0]):
        late[0, j], late[1, j], late[2, j], late[3, j] = q[j], qd[j], qdd[j], torque[j]


@compiled_for_ticks
def command_motors(
    q: Floats,
    qd: Floats,
    qdd: Floats,
    torque: Floats,
    late: Floats,
    chain: Floats,
    joints: Integers,
    flexes: Integers,
    springs: Floats,
    bent: Floats,
    before: Floats,
    motion: Floats,
    scratch: Floats,
    jacobian: Floats,
    loads: Floats,
    leads: Floats,
    drives: Floats,
    law: Floats,
    width: float,
    linear: bool,
    with_torques: bool,
    smooth: bool,
    ticks: int,
    period: float,
    motors: Floats,
) -> bool:
    """Compute the lead for a target, then what the motors get for the target of the tick before.

    Args:
        q: See `lead_of`, as for the next three.
        qd: Velocity.
        qdd: Acceleration.
        torque: Torque of the rigid arm.
        late: Target of the tick before and the torque that it needs, replaced by the present ones, shape (4, n).
        chain: See `lead_of`, as for the next two.
        joints: Indices of the joints.
        flexes: Indices of the bending.
        springs: Stiffness of each spring [N m/rad], and its damping time divided by the tick [-], shape (2, N).
        bent: See `lead_of`, as for the next five.
        before: Deflections of the tick before.
        motion: Scratch.
        scratch: Scratch.
        jacobian: Scratch.
        loads: Loads of the springs.
        leads: What is wanted and what is led, see `follow`, shape (2, 3, n) [rad].
        drives: Parameters of the drives, in the order of `ROTOR` and so on, shape (4, n).
        law: See `motor_command`, as for the next two.
        width: Width of the friction.
        linear: Whether friction is linear.
        with_torques: Whether torques count with the lead.
        smooth: Whether the reference is, see `lead_of`.
        ticks: Number of targets before this one.
        period: Tick [s].
        motors: Result, see `motor_command`.

    Returns:
        Whether the lead was limited.
    """
    n = q.shape[0]
    needed = np.empty(n)
    lead_of(
        chain, q, qd, qdd, joints, flexes, springs[0], springs[1], bent, before, ticks == 0, smooth, period,
        motion, scratch, jacobian, loads, leads[0], torque, drives[ROTOR], with_torques, needed,
    )  # fmt: skip
    if ticks == 0:
        keep(q, qd, qdd, needed, late)
    limited = motor_command(
        late[0], late[1], late[2], late[3], leads[0], leads[1], ticks, drives[MOST], drives[LEAST],
        drives[ROTOR], drives[FRICTION], width, linear, with_torques, period, law, motors,
    )  # fmt: skip
    keep(q, qd, qdd, needed, late)
    return limited


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
        self._period = period
        self._springs, n = model.loads(), description.joints
        friction = np.array(drives.coulomb_friction)
        self._law = np.zeros((0, 0)) if law is None else law
        largest = friction
        if law is not None:
            largest = law[0] * np.maximum(law[1], 1.0) + law[4] * np.array(description.limits.velocity)
        linear, width = drives.linear_friction, drives.friction_width
        self._drives = np.zeros((DRIVES, n))
        self._drives[ROTOR] = drives.rotor_inertia
        self._drives[FRICTION] = friction / width if linear else drives.friction_feedforward * friction
        self._drives[MOST], self._drives[LEAST] = TORQUE_SHARE * limits - largest, LEAST_ROOM * limits
        self._leads = np.zeros((2, 3, n))
        springs, damping = self._springs, model.damping_time / period
        self._parts = (
            np.zeros((4, n)), springs.chain, model.joints, model.flexes, np.array([model.stiffness, damping]),
            np.zeros((3, len(model.flexes))), np.zeros(model.size), springs.motion, springs.scratch,
            springs.jacobian, np.zeros((2, model.size)), self._leads, self._drives, self._law, width, linear, torques,
        )  # fmt: skip
        """Arguments of `command_motors` after the target and its torque."""
        self._ticks = 0
        self._sag: Floats | None = None
        """Sag of the target before."""
        self.motors: Floats = np.zeros((3, n))
        """Velocity [rad/s], acceleration [rad/s^2] and torque [N m] of the last command, shape (3, n)."""
        self.limited = False
        """Whether the lead's acceleration was limited at the last tick."""

    def reset(self) -> None:
        """Restart with the lead of the next targets."""
        self._ticks, self.limited = 0, False

    @property
    def settled(self) -> bool:
        """Whether the motors do not lead, and have not led for some ticks."""
        return self._ticks == 0 or float(np.abs(self._leads[1]).max()) < SETTLED

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
        self._springs.carry(carried)
        motors = np.empty((4, len(torque)))
        self.limited = command_motors(
            target.q, target.qd, target.qdd, torque, *self._parts, smooth, self._ticks, self._period, motors
        )
        its_sag, self._sag = sag if self._ticks == 0 else self._sag, sag
        self.motors, self._ticks = motors[1:], self._ticks + 1
        if sag is not None and its_sag is not None:
            motors[0] += its_sag
            motors[1] += (sag - its_sag) / self._period
        return DriveCommand(motors[0], motors[1], motors[3])
