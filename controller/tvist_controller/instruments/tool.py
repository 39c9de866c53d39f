"""Values of tool and payload: poses, forces, momentum."""

from math import sqrt

import numpy as np

from tvist_controller.instruments.force_sensor import at_tool, without_weight
from tvist_controller.instruments.joint_lists import ACTUAL_Q, ACTUAL_QD, SHAPED, UNSHAPED
from tvist_controller.instruments.reading import Reading
from tvist_controller.instruments.rigid_body import add, carried, cross
from tvist_controller.instruments.variables import Double, Vector3D, Vector6D, computed_once
from tvist_controller.instruments.wrench import since_zeroed
from tvist_plant.model import Floats
from tvist_plant.plant import GRAVITY


class ToolValues(Reading):
    """Motion and forces in Cartesian space, in the base frame unless stated otherwise."""

    @property
    def tcp_offset(self) -> Vector6D:
        """Io: tool centre point in the flange frame [m, rad]."""
        return self.io.tcp_offset

    @property
    def actual_TCP_pose(self) -> Vector6D:
        """State: kinematics of the measured angles with the TCP offset [m, rad]."""
        return self.state.actual_TCP_pose

    @property
    def actual_TCP_speed(self) -> Vector6D:
        """State: kinematics of measured angles and velocities with the TCP offset [m/s, rad/s]."""
        return self.state.actual_TCP_speed

    @property
    def actual_tool_accelerometer(self) -> Vector3D:
        """State: specific force in the flange frame; at rest it points up with 9.81 [m/s²]."""
        return self.state.actual_tool_accelerometer

    @property
    def target_TCP_pose(self) -> Vector6D:
        """Computed: kinematics of the target angles with the TCP offset [m, rad]."""
        pose: list[float] = self._target[:6].tolist()
        return pose

    @property
    def target_TCP_speed(self) -> Vector6D:
        """Computed: kinematics of target angles and velocities with the TCP offset [m/s, rad/s]."""
        speed: list[float] = self._target[6:12].tolist()
        return speed

    @property
    def target_TCP_acceleration(self) -> Vector6D:
        """Computed: kinematics of target angles, velocities and accelerations with the TCP offset [m/s², rad/s²]."""
        acceleration: list[float] = self._target[12:].tolist()
        return acceleration

    @property
    def target_tool(self) -> bytes:
        """Those three one behind the other, as doubles in the machine's order."""
        return self._target.tobytes()

    @computed_once
    def actual_TCP_acceleration(self) -> Vector6D:
        """Computed: the accelerometer's value without gravity, in the base frame and at the TCP [m/s², rad/s²].

        The angular acceleration is that of the shaped reference, since no sensor measures it.
        """
        linear: list[float] = (self._rotation @ np.array(self.state.actual_tool_accelerometer)).tolist()
        linear[2] -= GRAVITY
        alpha: list[float] = self._shaped[15:].tolist()
        offset = self.io.tcp_offset
        if any(offset[:3]):
            arm: list[float] = (self._rotation @ np.array(offset[:3])).tolist()
            linear = add(linear, carried(self.state.actual_TCP_speed[3:], alpha, arm))
        return linear + alpha

    @computed_once
    def actual_TCP_force(self) -> Vector6D:
        """Computed: force at the TCP by the sensor in the flange, without the declared payload's weight [N, N m].

        Without a sensor, it is the force that explains the measured torques, through the Jacobian. The torque that the
        shaped motion needs (rigid arm with the declared payload, rotors, friction) is subtracted first. Near a
        singularity part of the force cannot be measured and is left out. It is zero while the arm is braked.

        In either case, the force that a program has taken as zero is subtracted last.
        """
        raw, zero = self.state.flange_wrench, self.io.tcp_force_zero
        if raw is None:
            return self.wrench_calc_from_currents
        felt = without_weight(np.array(raw), self._rotation, self.io.payload)
        felt = felt if zero is None else felt - zero
        sensed: list[float] = at_tool(felt, self._rotation, self.io.tcp_offset).tolist()
        return sensed

    @computed_once
    def tcp_force_scalar(self) -> Double:
        """Computed: length of the TCP force's linear part [N]."""
        x, y, z, *_ = self.actual_TCP_force
        return sqrt(x * x + y * y + z * z)

    @computed_once
    def wrench_calc_from_currents(self) -> Vector6D:
        """Computed: force at the TCP that explains the measured torques; see `actual_TCP_force` [N, N m]."""
        force: list[float] = self._force.tolist()
        return force if self.state.flange_wrench is not None else since_zeroed(force, self.io.tcp_force_zero)

    @computed_once
    def ft_raw_wrench(self) -> Vector6D:
        """Computed: wrench that the sensor between flange and payload measures, in the flange frame [N, N m].

        Without a sensor, it is the weight and inertial force of the declared payload, from the accelerometer and
        without the effect of rotation, plus the TCP force.
        """
        if self.state.flange_wrench is not None:
            return self.state.flange_wrench
        payload, force = self.io.payload, self._force
        carries = [-payload.mass * felt for felt in self.state.actual_tool_accelerometer]
        pushes: list[float] = (force[:3] @ self._rotation).tolist()
        turns: list[float] = (force[3:] @ self._rotation).tolist()
        torque = add(turns, add(cross(payload.com, carries), cross(self.io.tcp_offset, pushes)))
        return add(carries, pushes) + torque

    @computed_once
    def collision_detection_ratio(self) -> Double:
        """Computed: largest share of a joint's torque limit by which measured torque differs from expected [-]."""
        felt: list[float] = self._felt.tolist()
        return max(abs(torque) / rating.torque for torque, rating in zip(felt, self._ratings, strict=True))

    @computed_once
    def actual_momentum(self) -> Double:
        """Computed: length of the linear momentum of links and declared payload, as measured [kg m/s]."""
        return self._rigid.momentum(self._motion[ACTUAL_Q], self._motion[ACTUAL_QD], self.io.payload)

    @property
    def elbow_position(self) -> Vector3D:
        """Computed: measured position where upper arm and forearm meet on the elbow's axis [m].

        For an arm with fewer than three joints, it is the flange.
        """
        return self._elbow[0]

    @property
    def elbow_velocity(self) -> Vector3D:
        """Computed: velocity of the elbow's position [m/s]."""
        return self._elbow[1]

    @property
    def payload(self) -> Double:
        """Io: declared mass [kg]."""
        return self.io.payload.mass

    @property
    def payload_cog(self) -> Vector3D:
        """Io: declared centre of mass in the flange frame [m]."""
        return list(self.io.payload.com)

    @property
    def payload_inertia(self) -> Vector6D:
        """Io: declared inertia about the centre of mass: xx yy zz xy xz yz [kg m²]."""
        xx, xy, xz, yy, yz, zz = self.io.payload.inertia
        return [xx, yy, zz, xy, xz, yz]

    @property
    def target_gravity(self) -> Vector3D:
        """Constant: 0 0 9.81, the acceleration that is equivalent to gravity, for a robot on the floor [m/s²]."""
        return [0.0, 0.0, GRAVITY]

    @property
    def target_base_acceleration(self) -> Vector6D:
        """Constant: zero; the base stands [m/s², rad/s²]."""
        return [0.0] * 6

    @computed_once
    def target_base_wrench(self) -> Vector6D:
        """Computed: force and torque at the base of the arm with the declared payload, for the target motion [N, N m].

        The weight of the base itself is not included.
        """
        return self._rigid.base_wrench(self._motion[UNSHAPED], self.io.payload)

    @computed_once
    def _target(self) -> Floats:
        return self._rigid.tool(self._motion[UNSHAPED], self.io.tcp_offset)

    @computed_once
    def _shaped(self) -> Floats:
        if self.state.unshaped_q is None:
            return self._target
        return self._rigid.tool(self._motion[SHAPED], self.io.tcp_offset)

    @computed_once
    def _elbow(self) -> tuple[list[float], list[float]]:
        return self._rigid.elbow(self._motion[ACTUAL_Q], self._motion[ACTUAL_QD])

    @computed_once
    def _rotation(self) -> Floats:
        return self._rigid.flange_rotation(self._motion[ACTUAL_Q])

    @computed_once
    def _estimate(self) -> Floats:
        if not self.driven:
            return np.zeros(6 + len(self._ratings))
        return self._wrench.estimate(self._motion, self.io.tcp_offset)

    @property
    def _force(self) -> Floats:
        return self._estimate[:6]

    @property
    def _felt(self) -> Floats:
        """External torque on the joints: expected minus measured, shape (n,) [N m]."""
        return self._estimate[6:]
