"""Logs of a made-up robot, computed from formulas alone: nothing here uses the project.

Every joint goes along a cubic of time, the servo follows late, and after each stop the tool rings with damped sines of
known frequency and damping. The tool's frame is rotated against the flange, as on a robot with a bent tool.
"""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

G = 9.80665


@dataclass
class SyntheticLog:
    """What happens, and what a log shows of it."""

    rate: float = 500.0
    modes: tuple[tuple[float, float, float], ...] = ((9.0, 0.12, 1.0),)  # Hz, zeta, m/s^2 at the arm's stop
    joints: int = 6
    lag: float = 0.0
    noise: float = 0.03
    encoder: float = 2e-6
    motions: int = 2
    first_time: float = 100.0
    rest: float = 1.6
    seed: int = 1
    columns: dict = field(default_factory=dict, init=False)
    stops: list = field(default_factory=list, init=False)
    starts: list = field(default_factory=list, init=False)

    def __post_init__(self):
        random = np.random.default_rng(self.seed)
        length, first = 0.8, 0.6
        count = round((first + self.motions * (length + self.rest)) * self.rate)
        t = np.arange(count) / self.rate
        target, late = np.zeros((count, self.joints)), np.zeros((count, self.joints))
        strokes = 0.3 + 0.1 * np.arange(self.joints)
        strokes[-1] = 0.0
        ring, rigid = np.zeros((count, 3)), np.zeros((count, 3))
        for number in range(self.motions):
            begin = first + number * (length + self.rest)
            sign = (-1.0) ** number
            for lag, joints in ((0.0, target), (self.lag, late)):
                s = np.clip((t - begin - lag) / length, 0.0, 1.0)
                joints[:] += sign * np.outer(10 * s**3 - 15 * s**4 + 6 * s**5, strokes)
            s = np.clip((t - begin - self.lag) / length, 0.0, 1.0)
            pull = (60 * s - 180 * s**2 + 120 * s**3) / length**2
            rigid += np.outer(sign * pull * ((s > 0) & (s < 1)), [0.3, 0.2, -0.1])
            since = t - begin - length - self.lag
            for f_d, zeta, amplitude in self.modes:
                axis = random.normal(size=3)
                axis /= np.linalg.norm(axis)
                sigma = 2 * np.pi * f_d * zeta / np.sqrt(1 - zeta**2)
                wave = np.exp(-sigma * np.clip(since, 0, None)) * np.cos(2 * np.pi * f_d * since + 0.4)
                ring += np.outer(np.where(since > 0, amplitude * wave, 0.0), axis)
            self.starts.append(self.first_time + begin)
            self.stops.append(self.first_time + begin + length)
        tilt = late[:, [0]] * 0.3
        up = np.hstack([np.sin(tilt), np.zeros_like(tilt), np.cos(tilt)])
        pose = np.hstack([0.4 * np.cos(late[:, :1]), 0.4 * np.sin(late[:, :1]), np.full((count, 1), 0.3)])
        turned = np.tile([0.0, np.pi / 2, 0.0], (count, 1))
        self.columns = {
            "timestamp": self.first_time + t,
            "target_q": target,
            "actual_q": late + self.encoder * random.standard_normal(late.shape),
            "actual_TCP_pose": np.hstack([pose, turned]),
            "actual_tool_accelerometer": G * up
            + rigid
            + ring
            + self.noise * random.standard_normal((count, 3)),
        }

    def without(self, *names: str) -> "SyntheticLog":
        """Leave columns out."""
        for name in names:
            del self.columns[name]
        return self

    def table(self) -> tuple[list[str], np.ndarray]:
        """Return names and numbers, one column for each entry of a vector."""
        names, values = [], []
        for name, column in self.columns.items():
            flat = column.reshape(len(column), -1)
            names += [name] if column.ndim == 1 else [f"{name}_{i}" for i in range(flat.shape[1])]
            values.append(flat)
        return names, np.hstack(values)

    def text(self, separator: str = ",", write=repr) -> list[str]:
        """Return the lines of a CSV, with full precision."""
        names, values = self.table()
        return [separator.join(names), *(separator.join(map(write, row)) for row in values.tolist())]

    def csv(self, path: Path, separator: str = ",", write=repr) -> Path:
        """Write them."""
        path.write_text("\n".join(self.text(separator, write)) + "\n")
        return path

    def dump(self, path: Path, size: int = 1116, skip: int = 0, lost: int = 0) -> Path:
        """Write packets of port 30003; the first bytes and the last may be lost."""
        places = {
            "timestamp": 0,
            "target_q": 1,
            "actual_q": 31,
            "actual_TCP_pose": 55,
            "actual_tool_accelerometer": 108,
        }
        packets = []
        for row in range(len(self.columns["timestamp"])):
            doubles = np.zeros((size - 4) // 8)
            for name, first in places.items():
                values = np.atleast_1d(self.columns[name][row])
                doubles[first : first + len(values)] = values
            packets.append(struct.pack(">i", size) + doubles.astype(">f8").tobytes())
        data = b"".join(packets)
        path.write_bytes(data[skip : len(data) - lost])
        return path

    def rosbag(self, folder: Path, every: int = 1, order=(2, 1, 0, 3, 4, 5)) -> Path:
        """Write a rosbag2 folder: JointState in any order and at a lower rate, Imu at every row, and both targets."""
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        types = store.types
        names = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
        writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        with writer:
            joints = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
            imu = writer.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
            for row, time in enumerate(self.columns["timestamp"]):
                nanoseconds = round(time * 1e9)
                stamp = types["builtin_interfaces/msg/Time"](*divmod(nanoseconds, 10**9))
                header = types["std_msgs/msg/Header"](stamp, "base")
                if row % every == 0:
                    message = types["sensor_msgs/msg/JointState"](
                        header,
                        [f"{names[joint]}_joint" for joint in order],
                        self.columns["actual_q"][row][list(order)],
                        np.zeros(0),
                        np.zeros(0),
                    )
                    writer.write(joints, nanoseconds + 10**6, store.serialize_cdr(message, joints.msgtype))
                zero, nothing = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), np.zeros(9)
                force = types["geometry_msgs/msg/Vector3"](*self.columns["actual_tool_accelerometer"][row])
                turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
                message = types["sensor_msgs/msg/Imu"](header, turn, nothing, zero, nothing, force, nothing)
                writer.write(imu, nanoseconds + 2 * 10**6, store.serialize_cdr(message, imu.msgtype))
        return folder
