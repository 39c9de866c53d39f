"""Functions that read the robot's state of the last tick, and kinematics and dynamics."""

import math
from collections.abc import Sequence

import numpy as np

from tvist_controller.instruments.snapshot import READERS, Instruments
from tvist_controller.instruments.variables import ORDER
from tvist_controller.instruments.wrench import unshaped
from tvist_controller.kinematics.arm import InverseDynamics
from tvist_controller.line.differentiator import Floats
from tvist_controller.programs import arguments
from tvist_controller.programs.arguments import Joints, Target, Text, a_list, a_pose, integer, numbers
from tvist_controller.programs.functions.group import FunctionContext, FunctionGroup, reads
from tvist_controller.programs.functions.settings import ToolPose
from tvist_controller.refusal import RefusalError, check_joints
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import JointSegment
from tvist_urscript import Array, Fault, Pose, Value, costs
from tvist_urscript.values import whole

INTEGRATED = {
    "joint_temperatures", "tool_temperature", "actual_robot_energy_consumed",
    "actual_robot_braking_energy_dissipated",
}  # fmt: skip
"""RTDE variables that depend on all earlier ticks."""


def _positions(on: FunctionContext) -> Array:
    return a_list(on.access.latest().actual_q)


def _pose(on: FunctionContext, q: Sequence[float], tcp: Sequence[float] | None = None) -> Pose:
    return a_pose(on.kinematics.tool_pose(np.array(q), tcp))


def _speed(on: FunctionContext, q: Sequence[float], qd: Sequence[float]) -> Array:
    return a_list((on.kinematics.jacobian(np.array(q)) @ np.array(qd)).tolist())


def _target_pose(on: FunctionContext) -> Pose:
    return _pose(on, unshaped(on.access.latest())[0])


def _target_speed(on: FunctionContext) -> Array:
    q, qd, _ = unshaped(on.access.latest())
    return _speed(on, q, qd)


class StateFunctions(FunctionGroup):
    """Functions that read the state of one robot."""

    title = "State"

    def __init__(self, on: FunctionContext) -> None:
        super().__init__(on)
        self._instruments: Instruments | None = None  # computes RTDE variables; created when first needed

    get_steptime = reads("Return the control period [s].", lambda _: PERIOD)
    get_actual_joint_positions = reads("Return the measured joint positions [rad].", _positions)
    get_joint_positions = reads("Older name of `get_actual_joint_positions` [rad].", _positions)
    get_actual_joint_speeds = reads(
        "Return the measured joint velocities [rad/s].", lambda on: a_list(on.access.latest().actual_qd)
    )
    get_target_joint_positions = reads(
        "Return the target joint positions, before shaping [rad].",
        lambda on: a_list(unshaped(on.access.latest())[0]),
    )
    get_target_joint_speeds = reads(
        "Return the target joint velocities, before shaping [rad/s].",
        lambda on: a_list(unshaped(on.access.latest())[1]),
    )
    get_target_joint_accelerations = reads(
        "Return the target joint accelerations, before shaping [rad/s^2].",
        lambda on: a_list(unshaped(on.access.latest())[2]),
    )
    get_actual_tcp_pose = reads(
        "Return the pose of the tool at the measured joint positions.",
        lambda on: _pose(on, on.access.latest().actual_q),
        50,
    )
    get_actual_tcp_speed = reads(
        "Return the measured velocity of the tool [m/s, rad/s].",
        lambda on: _speed(on, on.access.latest().actual_q, on.access.latest().actual_qd),
    )
    get_target_tcp_pose = reads("Return the target pose of the tool, before shaping.", _target_pose, 50)
    get_target_tcp_speed = reads(
        "Return the target velocity of the tool, before shaping [m/s, rad/s].", _target_speed, 50
    )
    tool_pose = reads(
        "Return `get_target_tcp_pose`; exported PolyScope programs use it as the feature Tool.",
        _target_pose,
        50,
    )
    get_target_tcp_pose_along_path = reads(
        "Return `get_target_tcp_pose`, since path offsets are not simulated.", _target_pose, 50
    )
    get_target_tcp_speed_along_path = reads(
        "Return `get_target_tcp_speed`, since path offsets are not simulated.", _target_speed, 50
    )
    get_actual_tool_flange_pose = reads(
        "Return the pose of the flange at the measured joint positions.",
        lambda on: _pose(on, on.access.latest().actual_q, (0.0,) * 6),
        50,
    )

    @costs(50)
    def get_target_waypoint(self) -> Pose:
        """Return the pose at the end of the present move; without one, the present target."""
        segment = self._arm.waypoint
        if segment is None or not self._access.motion.motions.running:
            return _target_pose(self._parts)
        if isinstance(segment, JointSegment):
            return _pose(self._parts, segment.q)
        return a_pose(segment.pose)

    get_tcp_offset = reads(
        "Return the tool centre point in the flange frame.", lambda on: a_pose(on.access.motion.tcp)
    )
    get_target_payload = reads(
        "Return the mass of the declared payload [kg].", lambda on: on.access.declared().mass
    )
    get_target_payload_cog = reads(
        "Return the centre of mass of the declared payload [m].", lambda on: a_list(on.access.declared().com)
    )

    get_target_payload_inertia = reads(
        "Return the inertia of the declared payload, Ixx Iyy Izz Ixy Ixz Iyz [kg m^2].",
        lambda on: a_list([on.access.declared().inertia[place] for place in ORDER]),
    )
    get_joint_torques = reads(
        "Return the external torques on the joints, without those of the arm's own motion and weight [N m].",
        lambda on: a_list(on.access.forces.torques()),
        80,
    )
    get_tcp_force = reads(
        "Return the external force and torque at the tool in the base frame [N, N m].",
        lambda on: a_list(on.access.forces.wrench()),
        80,
    )
    force = reads(
        "Return the size of the external force at the tool [N].",
        lambda on: math.hypot(*on.access.forces.wrench()[:3]),
        80,
    )
    is_steady = reads(
        "Return whether the target has been at rest for 500 ms.", lambda on: on.access.motion.steady
    )
    get_tool_current = reads("Return 0, the current of the tool's supply [A].", lambda _: 0.0)
    get_tool_accelerometer_reading = reads(
        "Return the reading of the accelerometer in the flange, including gravity [m/s^2].",
        lambda on: a_list(on.access.latest().actual_tool_accelerometer),
    )

    @costs(300)
    def get_rtde_value(self, key: Text) -> Value:
        """Return an RTDE output variable of the last tick."""
        if key in INTEGRATED:
            raise Fault(f'get_rtde_value: only clients get "{key}", which is integrated over time')
        if self._instruments is None:
            self._instruments = Instruments(self._access.description)
        if key not in READERS:
            raise Fault(f'get_rtde_value: RTDE has no output "{key[:60]}"')
        value = getattr(self._instruments.snapshot(self._access.latest(), self._access.io()), key)
        if isinstance(value, list):
            return a_list([whole(one) if type(one) is int else float(one) for one in value])
        return whole(value) if type(value) is int else value

    @costs(4)
    def get_actual_joint_positions_history(self, steps: object = 0) -> Array:
        """Return the measured joint positions a number of ticks ago [rad]."""
        past = self._access.motion.past
        ago = integer("steps", steps, 0, max(len(past) - 1, 0))
        return a_list(past[-1 - ago].tolist() if past else self._access.latest().actual_q)


class PoseFunctions(FunctionGroup):
    """Kinematics and dynamics of one robot."""

    title = "Kinematics and dynamics"

    def __init__(self, on: FunctionContext) -> None:
        super().__init__(on)
        self._dynamics = InverseDynamics(on.access.description, on.access.motion.cycle.dynamics.payload)

    @costs(150)
    def get_inverse_kin(
        self,
        x: Target,
        qnear: Joints | None = None,
        maxPositionError: object = 1e-10,
        maxOrientationError: object = 1e-10,
        tcp: ToolPose | None = None,
    ) -> Array:
        """Return the joint positions for a tool pose that are nearest to `qnear`, or to the present ones.

        The solution is exact to rounding, so it always meets both errors.
        """
        return a_list(self._kinematics.posture(x, self._near(qnear), tcp))

    @costs(150)
    def get_inverse_kin_has_solution(
        self,
        x: Target,
        qnear: Joints | None = None,
        maxPositionError: object = 1e-10,
        maxOrientationError: object = 1e-10,
        tcp: ToolPose | None = None,
    ) -> bool:
        """Return whether `get_inverse_kin` has an answer."""
        return self._solution(x, self._near(qnear), tcp) is not None

    @costs(80)
    def get_forward_kin(self, q: Joints | None = None, tcp: ToolPose | None = None) -> Pose:
        """Return the pose of the tool at joint positions, or at the measured ones."""
        return a_pose(self._kinematics.tool_pose(self._posture(q), tcp))

    @costs(200)
    def is_within_safety_limits(self, pose: object, qNear: Joints | None = None) -> bool:
        """Return whether the arm can be at a pose or joint positions: within range and without collision."""
        if isinstance(pose, Pose):
            q = self._solution(arguments.pose("pose", pose), self._near(qNear))
        else:
            q = numbers("pose", pose, self._access.description.joints)
        if q is None:
            return False
        try:
            check_joints(q, self._access.description)
        except RefusalError:
            return False
        return self._access.motion.collisions.meeting(np.array(q)) is None

    @costs(110)
    def get_jacobian(self, q: Joints | None = None, tcp: ToolPose | None = None) -> Array:
        """Return the Jacobian of the tool in the base frame: rows of velocity, then angular velocity."""
        matrix = self._kinematics.jacobian(self._posture(q), tcp)
        return Array(tuple(a_list(row) for row in matrix.tolist()))

    @costs(280)
    def get_mass_matrix(self, q: Joints | None = None, include_rotors_inertia: object = True) -> Array:
        """Return the inertia matrix of the joints with the declared payload [kg m^2]."""
        self._dynamics.use_bodies(self._access.motion.cycle.dynamics.bodies)
        matrix = self._dynamics.inertia(self._posture(q))
        matrix = np.triu(matrix) + np.triu(matrix, 1).T
        if include_rotors_inertia:
            matrix = matrix + np.diag(self._access.description.drives.rotor_inertia)
        return Array(tuple(a_list(row) for row in matrix.tolist()))

    def _solution(
        self, goal: Sequence[float], near: Sequence[float], tcp: Sequence[float] | None = None
    ) -> tuple[float, ...] | None:
        try:
            return self._kinematics.posture(goal, near, tcp)
        except Fault:
            return None

    def _near(self, near: Sequence[float] | None) -> Sequence[float]:
        return self._access.latest().actual_q if near is None else near

    def _posture(self, q: Sequence[float] | None) -> Floats:
        return np.array(self._near(q), dtype=float)
