"""Logs of a made-up UR5e and of a sensor at its tool with a clock of its own: nothing here uses the project.

Kinematics are Denavit and Hartenberg's with the vendor's numbers, by numpy; the sensor's readings are differences of
poses, not products of Jacobians. Each device has its clock, rate, units, names and faults, and writes its own CSV.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

G = 9.80665
# Universal Robots, "DH Parameters for calculations of kinematics and dynamics", UR5e: d, a [m], alpha [rad]
DH = (
    (0.1625, 0.0, np.pi / 2), (0.0, -0.425, 0.0), (0.0, -0.3922, 0.0),
    (0.1333, 0.0, np.pi / 2), (0.0997, 0.0, -np.pi / 2), (0.0996, 0.0, 0.0),
)  # fmt: skip


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
    """What happens, and what each device writes about it."""

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
        at, time, way = self.home, 1.5, None
        self.knots = []
        for number in range(self.motions):
            step = np.zeros(6)
            if self.same:
                way = random.uniform(-1, 1, 6) if way is None else way
                step[list(self.moving)] = self.stroke * (-1) ** number * way[list(self.moving)]
                length, rest = self.stroke / self.speed, 2.0
            else:
                goal = self.home + self.stroke * random.uniform(-0.7, 0.7, 6)
                step[list(self.moving)] = (goal - at)[list(self.moving)]
                length = np.abs(step).max() / (self.speed * random.uniform(0.6, 1.5)) + 0.15
                rest = random.uniform(0.8, 2.0)
            self.knots.append((time, length, at, step))
            at, time = at + step, time + length + rest
        self.end = time - rest + 1.0
        self.mounting = rotation(random)
        self.arm = self.lever * rotation(random)[0]

    def q(self, t):
        """True joint angles."""
        q = np.tile(self.home, (len(t), 1))
        for start, length, _, step in self.knots:
            s = np.clip((t - start) / length, 0.0, 1.0)[:, None]
            q = q + (10 * s**3 - 15 * s**4 + 6 * s**5) * step
        return q

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
            since = t - start - length
            f_d = 8.0 + 6.0 * ((number * 0.618) % 1.0)
            wave = np.exp(-2 * np.pi * 0.05 * f_d * np.clip(since, 0, None)) * np.sin(2 * np.pi * f_d * since)
            axis = np.array([np.cos(number), np.sin(number), 0.3])
            rung = np.outer(np.where(since > 0, self.ringing * np.abs(step).max() * wave, 0.0), axis)
            force = force + rung
            omega = omega + rung / (2 * np.pi * f_d) / 0.5
        return omega @ self.mounting, force @ self.mounting

    def shown(self, t):
        """What the sensor's clock shows at times of the robot's."""
        return self.offset + (1.0 + self.drift) * t

    def robot_rows(self):
        """Times and joint angles as the robot logs them."""
        measured = np.arange(0.0, self.end, 1.0 / self.robot_rate)
        q = self.q(measured)
        q = np.round((q + self.encoder * self.random.standard_normal(q.shape)) / 1e-6) * 1e-6
        t = np.arange(len(measured) * self.held) / (self.robot_rate * self.held)
        return self._faulty(t + self.robot_start, np.repeat(q, self.held, axis=0))

    def sensor_rows(self):
        """Times on the sensor's clock, angular velocities and specific forces."""
        random = self.random
        t = np.arange(-self.spare, self.end + self.spare, 1.0 / self.sensor_rate)
        omega, force = self.felt(t)
        omega = (
            omega
            + self.bias[0] * random.standard_normal(3)
            + self.noise[0] * random.standard_normal(omega.shape)
        )
        force = (
            force
            + self.bias[1] * random.standard_normal(3)
            + self.noise[1] * random.standard_normal(force.shape)
        )
        return self._faulty(self.shown(t + self.robot_start), np.hstack([force, omega]))

    def _faulty(self, t, values):
        kept = self.random.random(len(t)) >= self.dropped
        t, values = t[kept], values[kept]
        self.rows = t, values  # those that were written last, without repetitions
        times = 1 + (self.random.random(len(t)) < self.repeated)
        return np.repeat(t, times), np.repeat(values, times, axis=0)

    def robot(self, path: Path, header="timestamp,actual_q_{}", **how) -> Path:
        """Write the robot's log."""
        t, q = self.robot_rows()
        return write(path, header, t, [q], **how)

    def sensor(
        self, path: Path, header="timestamp,actual_tool_accelerometer_{},actual_tool_gyroscope_{}", **how
    ) -> Path:
        """Write the sensor's log; without a gyroscope where the header names none."""
        t, values = self.sensor_rows()
        vectors = [values[:, :3], values[:, 3:]]
        if header is not None:
            vectors = vectors[: header.count(",")]
        return write(path, header, t, vectors, **how)


def write(path, header, t, vectors, units=(1.0, 1.0, 1.0), separator=",", comma=False, first=0, digits=10):
    """Write CSV, numbers divided by the size of their unit; `{}` in the header is for entries counted from `first`."""
    lines = []
    if header is not None:
        time, *names = header.split(",")
        cells = [time]
        for name, vector in zip(names, vectors, strict=True):
            marks = "xyz" if first == "x" else range(first, first + vector.shape[1])
            cells += [name.replace("{}", str(mark)) for mark in marks]
        lines.append(separator.join(cells))
    table = np.column_stack([t / units[0], *(v / unit for v, unit in zip(vectors, units[1:], strict=False))])
    for row in table:
        line = separator.join([repr(float(row[0])), *(f"{value:.{digits}g}" for value in row[1:])])
        lines.append(line.replace(".", ",") if comma else line)
    path.write_text("\n".join(lines) + "\n")
    return path
