"""Logs of made-up robots, computed from formulas alone: nothing here uses the project.

A `SyntheticLog` is of a robot with a sensor: every joint goes along a polynomial of time, the servo follows late, and
after each stop the tool rings with damped sines of known frequency and damping. Its tool is rotated against the flange.

`TwoDevices` are a UR5e and a sensor at its tool with a clock of its own. Kinematics are Denavit and Hartenberg's with
the vendor's numbers; the sensor's readings are differences of poses, not products of Jacobians.
"""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

G = 9.80665
# Universal Robots, "DH Parameters for calculations of kinematics and dynamics", UR5e: d, a [m], alpha [rad]
DH = (
    (0.1625, 0.0, np.pi / 2), (0.0, -0.425, 0.0), (0.0, -0.3922, 0.0),
    (0.1333, 0.0, np.pi / 2), (0.0997, 0.0, -np.pi / 2), (0.0996, 0.0, 0.0),
)  # fmt: skip
UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
PLACES = {
    "timestamp": 0, "target_q": 1, "actual_q": 31, "actual_TCP_pose": 55, "actual_tool_accelerometer": 108,
}  # fmt: skip
"""Numbers of the first double of each signal in a packet of port 30003."""


def damped(since, f_d, zeta, phase=0.0):
    """A damped sine that begins at the time 0 [-]."""
    sigma = 2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta**2)
    wave = np.exp(-sigma * np.maximum(since, 0.0)) * np.cos(2.0 * np.pi * f_d * since + phase)
    return wave * (since >= 0.0)


def share(t, begin, length):
    """The share of a smooth motion that is done [-]."""
    s = np.clip((t - begin) / length, 0.0, 1.0)
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def table(columns, first=0):
    """Names and numbers, one column for each entry of a vector; braces in a name stand for the entry."""
    names, values = [], []
    for name, column in columns.items():
        flat = column.reshape(len(column), -1)
        pattern = name if "{}" in name else f"{name}_{{}}"
        marks = "xyz" if first == "x" else range(first, first + flat.shape[1])
        names += [name] if column.ndim == 1 else [pattern.format(mark) for mark in marks]
        values.append(flat)
    return names, np.hstack(values)


def text(columns, separator=",", write=repr, *, first=0, header=True):
    """The lines of a CSV; entries are counted from `first`."""
    names, values = table(columns, first)
    lines = [separator.join(map(write, row)) for row in values.tolist()]
    return [separator.join(names), *lines] if header else lines


def write_csv(path: Path, columns, *style, **how) -> Path:
    path.write_text("\n".join(text(columns, *style, **how)) + "\n")
    return path


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
        felt = np.zeros((count, 3))
        for number in range(self.motions):
            begin = first + number * (length + self.rest)
            sign = (-1.0) ** number
            target += sign * np.outer(share(t, begin, length), strokes)
            late += sign * np.outer(share(t, begin + self.lag, length), strokes)
            s = np.clip((t - begin - self.lag) / length, 0.0, 1.0)
            felt += np.outer(sign * (60 * s - 180 * s**2 + 120 * s**3) / length**2, [0.3, 0.2, -0.1])
            for f_d, zeta, amplitude in self.modes:
                axis = random.normal(size=3)
                since = t - begin - length - self.lag
                felt += np.outer(amplitude * damped(since, f_d, zeta, 0.4), axis / np.linalg.norm(axis))
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
            "actual_tool_accelerometer": G * up + felt + self.noise * random.standard_normal((count, 3)),
        }

    def without(self, *names: str) -> "SyntheticLog":
        for name in names:
            del self.columns[name]
        return self

    def csv(self, path: Path, *style) -> Path:
        return write_csv(path, self.columns, *style)

    def dump(self, path: Path, size: int = 1116, skip: int = 0, lost: int = 0) -> Path:
        """Write packets of port 30003; the first bytes and the last may be lost."""
        doubles = np.zeros((len(self.columns["timestamp"]), (size - 4) // 8), ">f8")
        for name, first in PLACES.items():
            flat = self.columns[name].reshape(len(doubles), -1)
            doubles[:, first : first + flat.shape[1]] = flat
        data = b"".join(struct.pack(">i", size) + row.tobytes() for row in doubles)
        path.write_bytes(data[skip : len(data) - lost])
        return path

    def rosbag(self, folder: Path, every: int = 1, order=(2, 1, 0, 3, 4, 5)) -> Path:
        """Write a rosbag2 folder: JointState in any order and at a lower rate, Imu at every row, and both targets."""
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS2_HUMBLE)
        types = store.types
        names = [f"{UR_JOINTS[joint]}_joint" for joint in order]
        with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            joints = writer.add_connection("/joint_states", "sensor_msgs/msg/JointState", typestore=store)
            imu = writer.add_connection("/imu", "sensor_msgs/msg/Imu", typestore=store)
            for row, time in enumerate(self.columns["timestamp"]):
                nanoseconds = round(time * 1e9)
                stamp = types["builtin_interfaces/msg/Time"](*divmod(nanoseconds, 10**9))
                header = types["std_msgs/msg/Header"](stamp, "base")
                if row % every == 0:
                    q = self.columns["actual_q"][row][list(order)]
                    message = types["sensor_msgs/msg/JointState"](header, names, q, np.zeros(0), np.zeros(0))
                    writer.write(joints, nanoseconds + 10**6, store.serialize_cdr(message, joints.msgtype))
                zero, nothing = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0), np.zeros(9)
                force = types["geometry_msgs/msg/Vector3"](*self.columns["actual_tool_accelerometer"][row])
                turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
                message = types["sensor_msgs/msg/Imu"](header, turn, nothing, zero, nothing, force, nothing)
                writer.write(imu, nanoseconds + 2 * 10**6, store.serialize_cdr(message, imu.msgtype))
        return folder


def flange(q):
    """Rotations, shape (T, 3, 3), and places, shape (T, 3), of the flange."""
    pose = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for angle, (d, a, alpha) in zip(q.T, DH, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        zero, one = np.zeros_like(c), np.ones_like(c)
        link = [
            [c, -s * ca, s * sa, a * c],
            [s, c * ca, -c * sa, a * s],
            [zero, sa * one, ca * one, d * one],
            [zero, zero, zero, one],
        ]
        pose = pose @ np.moveaxis(np.array(link), 2, 0)
    return pose[:, :3, :3], pose[:, :3, 3]


def rotation(random):
    """A rotation, each as likely as any other."""
    matrix, upper = np.linalg.qr(random.standard_normal((3, 3)))
    matrix = matrix * np.sign(np.diag(upper))
    return matrix * np.sign(np.linalg.det(matrix))


@dataclass
class TwoDevices:
    """What happens, and what each device writes about it, with its own clock, rate, units and faults."""

    seed: int
    offset: float = 0.0  # of the sensor's clock when the robot's is 0 [s]
    drift: float = 0.0  # by how much the sensor's clock runs fast
    motions: int = 7
    moving: tuple = (0, 1, 2, 3, 4, 5)
    stroke: float = 1.0  # rad
    speed: float = 1.0  # rad/s, mean of a motion
    robot_rate: float = 125.0
    sensor_rate: float = 266.0
    spare: float = 2.0  # rest that only the sensor has, before and after [s]
    noise: tuple = (0.02, 0.03)  # rad/s and m/s²
    bias: tuple = (0.02, 0.1)
    ringing: float = 0.5  # m/s² after each stop
    lever: float = 0.05  # m from the flange
    encoder: float = 1e-5
    dropped: float = 0.0
    repeated: float = 0.0
    held: int = 1  # rows in which the robot logs the same measurement
    same: bool = False  # each motion goes the same way to and fro, at the same pace
    robot_start: float = 0.0  # what the robot's clock shows at its first row
    knots: list = field(default_factory=list, init=False)

    def __post_init__(self):
        self.random = random = np.random.default_rng(self.seed)
        self.home = np.array([0.3, -1.6, 1.4, -1.2, -1.5, 0.2]) + random.uniform(-0.4, 0.4, 6)
        at, time, moving = self.home, 1.5, np.isin(np.arange(6), self.moving)
        way = self.stroke * random.uniform(-1, 1, 6) if self.same else None
        for number in range(self.motions):
            if self.same:
                step, length, rest = (-1) ** number * way * moving, self.stroke / self.speed, 2.0
            else:
                step = (self.home + self.stroke * random.uniform(-0.7, 0.7, 6) - at) * moving
                length = np.abs(step).max() / (self.speed * random.uniform(0.6, 1.5)) + 0.15
                rest = random.uniform(0.8, 2.0)
            self.knots.append((time, length, at, step))
            at, time = at + step, time + length + rest
        self.end = time - rest + 1.0
        self.mounting = rotation(random)
        self.arm = self.lever * rotation(random)[0]

    def q(self, t):
        """True joint angles."""
        steps = (np.outer(share(t, start, length), step) for start, length, _, step in self.knots)
        return self.home + sum(steps)

    def felt(self, t):
        """Angular velocity and specific force in the sensor's axes, without noise."""
        h = 1e-4
        before, now, after = (flange(self.q(t + d)) for d in (-h, 0.0, h))
        places = [place + turn @ self.arm for turn, place in (before, now, after)]
        spin = np.swapaxes(now[0], 1, 2) @ (after[0] - before[0]) / (2 * h)
        omega = 0.5 * np.column_stack(
            [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]]
        )
        pull = (places[0] - 2 * places[1] + places[2]) / h**2 + [0.0, 0.0, G]
        force = np.einsum("tji,tj->ti", now[0], pull)
        for number, (start, length, _, step) in enumerate(self.knots):
            f_d = 8.0 + 6.0 * ((number * 0.618) % 1.0)
            wave = self.ringing * np.abs(step).max() * damped(t - start - length, f_d, 0.05, -np.pi / 2)
            rung = np.outer(wave, [np.cos(number), np.sin(number), 0.3])
            force = force + rung
            omega = omega + rung / (2 * np.pi * f_d) / 0.5
        return omega @ self.mounting, force @ self.mounting

    def robot_rows(self):
        """Times and joint angles as the robot logs them."""
        measured = np.arange(0.0, self.end, 1.0 / self.robot_rate)
        q = self.q(measured)
        q = np.round((q + self.encoder * self.random.standard_normal(q.shape)) / 1e-6) * 1e-6
        t = np.arange(len(measured) * self.held) / (self.robot_rate * self.held)
        return self._faulty(t + self.robot_start, np.repeat(q, self.held, axis=0))

    def sensor_rows(self):
        """Times on the sensor's clock, specific forces and angular velocities, shape (T, 6)."""
        t = np.arange(-self.spare, self.end + self.spare, 1.0 / self.sensor_rate)
        noisy = []
        for true, bias, noise in zip(self.felt(t), self.bias, self.noise, strict=True):
            noisy.append(true + bias * self.random.standard_normal(3))
            noisy[-1] += noise * self.random.standard_normal(true.shape)
        omega, force = noisy
        shown = self.offset + (1.0 + self.drift) * (t + self.robot_start)
        return self._faulty(shown, np.hstack([force, omega]))

    def _faulty(self, t, values):
        kept = self.random.random(len(t)) >= self.dropped
        t, values = t[kept], values[kept]
        self.rows = t, values  # those that were written last, without repetitions
        times = 1 + (self.random.random(len(t)) < self.repeated)
        return np.repeat(t, times), np.repeat(values, times, axis=0)

    def robot(self, path: Path, names=("timestamp", "actual_q"), units=(1.0, 1.0), **how) -> Path:
        """Write the robot's log; numbers are divided by the sizes of their units."""
        found = zip(self.robot_rows(), units, strict=True)
        return write_csv(path, {name: v / unit for name, (v, unit) in zip(names, found, strict=True)}, **how)

    def sensor(self, path: Path, names=(), units=(1.0, 1.0, 1.0), **how) -> Path:
        """Write the sensor's log; without a gyroscope where only two names are given."""
        t, values = self.sensor_rows()
        names = names or ("timestamp", "actual_tool_accelerometer", "actual_tool_gyroscope")
        vectors = (t, values[:, :3], values[:, 3:])
        columns = {name: v / unit for name, v, unit in zip(names, vectors, units, strict=False)}
        return write_csv(path, columns, **how)
