"""What a robot tells ROS 2: its state on topics, its clock, its description."""

import math
import time
from typing import Any

from tvist_protocol import State, TrajectoryPoint
from tvist_protocol.info import Info
from tvist_ros2.messages import TYPES, ros, seconds
from tvist_ros2.names import Qos
from tvist_ros2.node import Node
from tvist_ros2.trajectory import points_of
from tvist_ros2.urdf import BASE, FLANGE, joint_names, urdf

RATE = 500.0  # states per second of a robot [Hz]
LATCHED = Qos(depth=1, latched=True)
_UNKNOWN = (-1.0, *8 * (0.0,))
"""Covariance that says that a value is not measured."""


class Outputs:
    """The topics of a robot's states, of which every `500 / rate`-th is published."""

    def __init__(self, node: Node, info: Info, rate: float) -> None:
        self.joints = joint_names(info)
        self._every = max(1, round(RATE / rate))
        self.latest: State | None = None
        """The last state, published or not; None before the first."""
        self._clock = None  # if a client steps the time, nodes with `use_sim_time` follow it
        if info.clock != "realtime":
            self._clock = node.publisher("/clock", TYPES["rosgraph_msgs/msg/Clock"], Qos(1, reliable=False))
        self._joint_states = node.publisher("joint_states", TYPES["sensor_msgs/msg/JointState"])
        self._pose = node.publisher("tcp_pose_broadcaster/pose", TYPES["geometry_msgs/msg/PoseStamped"])
        self._imu = node.publisher("imu_sensor_broadcaster/imu", TYPES["sensor_msgs/msg/Imu"])
        self._wrench = node.publisher(
            "force_torque_sensor_broadcaster/wrench", TYPES["geometry_msgs/msg/WrenchStamped"]
        )
        if (description := urdf(info)) is not None:
            describe = node.publisher("robot_description", TYPES["std_msgs/msg/String"], LATCHED)
            describe(ros.String(description))

    def now(self) -> Any:
        """Return ROS time: that of the wall clock in real time, otherwise that of the latest state."""
        if self._clock is None:
            return _stamp(time.time_ns())  # noqa: TID251  ROS time
        return _stamp(0 if self.latest is None else round(1e9 * self.latest.timestamp))

    @property
    def tick(self) -> int:
        """Tick of the latest state; 0 before the first."""
        return 0 if self.latest is None else self.latest.tick

    def points_of(self, trajectory: Any) -> list[TrajectoryPoint]:
        """Return the points of a JointTrajectory that starts now; see `trajectory.points_of`."""
        q = [] if self.latest is None else self.latest.target_q
        return points_of(trajectory, self.joints, seconds(self.now()), q)

    def take(self, state: State) -> None:
        """Take the state of a tick, and publish it if it is the first, or if it is its turn."""
        first, self.latest = self.latest is None, state
        if first or state.tick % self._every == 0:
            self.publish()
        elif self._clock is not None:
            self._clock(ros.Clock(self.now()))

    def publish(self) -> None:
        """Publish the latest state, if there is one."""
        state = self.latest
        if state is None:
            return
        now = self.now()
        if self._clock is not None:
            self._clock(ros.Clock(now))
        at_base, at_flange = ros.Header(now, BASE), ros.Header(now, FLANGE)
        self._joint_states(
            ros.JointState(at_base, self.joints, state.actual_q, state.actual_qd, state.actual_moment)
        )
        pose = ros.Pose(ros.Point(*state.actual_TCP_pose[:3]), _quaternion(state.actual_TCP_pose[3:]))
        self._pose(ros.PoseStamped(at_base, pose))
        felt = ros.Vector3(*state.actual_tool_accelerometer)
        self._imu(ros.Imu(at_flange, ros.Quaternion(w=1.0), _UNKNOWN, ros.Vector3(), _UNKNOWN, felt))
        if state.flange_wrench is not None:
            force, torque = ros.Vector3(*state.flange_wrench[:3]), ros.Vector3(*state.flange_wrench[3:])
            self._wrench(ros.WrenchStamped(at_flange, ros.Wrench(force, torque)))


def _stamp(nanoseconds: int) -> Any:
    return ros.Time(*divmod(nanoseconds, 1_000_000_000))


def _quaternion(rotation: list[float]) -> Any:
    """Return a rotation vector [rad] as a quaternion."""
    angle = math.hypot(*rotation)
    factor = math.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    return ros.Quaternion(*(factor * part for part in rotation), math.cos(0.5 * angle))
