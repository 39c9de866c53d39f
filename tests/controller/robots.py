"""Robots, control lines and controllers for tests."""

import msgspec
import numpy as np

from tvist_controller.controller import Controller
from tvist_controller.instruments.report import Sink
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.limits import StreamTorqueMargin
from tvist_controller.setup import Setup, body, paper_payload
from tvist_controller.trajectory import JointLine, MotionLimits, SetpointStream, quickest_motion
from tvist_plant.description import RobotDescription, load
from tvist_plant.plant import PERIOD, Measurement, Plant
from tvist_protocol import commands as c
from tvist_protocol.calibration import Calibration, calibration_of
from tvist_protocol.codec import encode
from tvist_protocol.replies import Done
from tvist_shaping.catalogue import SHAPERS, shaper
from tvist_shaping.estimators.polynomial import Polynomial
from tvist_shaping.filter import TvistFilter

UR5E = load("ur5e")
Q1, Q2, Q3 = (np.array(UR5E.poses[name]) for name in ("Q1", "Q2", "Q3"))
PAPER = MotionLimits(1.5, 2.0, 100.0)
H = PERIOD
ROUNDING = 1e-8
"""What rounding makes of a second difference: 4 ε·2π/h² = 1.4e-9 [rad/s^2]."""


def cut(joints: int) -> RobotDescription:
    """Return a UR5e reduced to its first joints, with the disc on the last one."""
    replace = msgspec.structs.replace
    names = UR5E.robot.joints[:joints]
    changes = {"robot": replace(UR5E.robot, model=f"UR5e-{joints}", joints=names)}
    for table in ("kinematics", "links", "limits", "drives"):
        values = getattr(UR5E, table)
        columns = {name: getattr(values, name) for name in values.__struct_fields__}
        shorter = {name: value[:joints] for name, value in columns.items() if isinstance(value, tuple)}
        changes[table] = replace(values, **shorter)
    flexible = UR5E.link_flexibility
    kept = [number for number in flexible.links if number < joints]
    changes["link_flexibility"] = replace(
        flexible, links=tuple(kept), stiffness=flexible.stiffness[: len(kept)]
    )
    changes["collision"] = type(UR5E.collision)()  # such an arm would carry its payload inside itself
    changes["poses"] = {name: pose[:joints] for name, pose in UR5E.poses.items()}
    return replace(UR5E, **changes)


POLYNOMIAL = {
    "joints": (1, 2),
    "degree": 1,
    # 1, then cos and sin of shoulder and elbow: 6.7 Hz at Q1 and Q2, 15 Hz at Q3, and back on the way.
    "f_d_coefficients": (10.0, 1.5, 0.0, -1.8, 3.0),
    "zeta_coefficients": (0.25, 0.0, 0.0, 0.09, 0.0),
    "f_d_range": (5.0, 16.0),
    "zeta_range": (0.05, 0.45),
}
FITTING = [
    name
    for name, entry in SHAPERS.items()
    if entry.zeta_max > POLYNOMIAL["zeta_range"][1] and entry.peak == 1.0
]
"""Shapers for its damping that keep the limits of what they shape."""


def calibration(mass: float = 5.0, robot: str = "UR5e", name: str = "test", **polynomial) -> Calibration:
    spread = {"median": 1.0, "p90": 2.0}
    return calibration_of(
        {
            "name": name,
            "robot": robot,
            "payload": {"mass": mass, "com": [0.0, 0.0, 0.0405], "inertia": [0.006, 0, 0, 0.006, 0, 0.006]},
            "polynomial": POLYNOMIAL | polynomial,
            "provenance": {
                "command": "by hand", "version": "0", "seed": 0, "configurations": 1, "ring_downs": 1, "rejected": 0,
                "measured_f_d_range": [6.0, 15.0], "measured_zeta_range": [0.1, 0.35],
                **{f"{how}_{of}_percent": spread for how in ("residual", "cross_validated") for of in ("f_d", "zeta")},
            },
        }
    )  # fmt: skip


class Line(ControlCycle):
    """A control line with short names for tests."""

    at_rest = property(lambda self: self.mode.at_rest)
    reference = property(lambda self: self.sample.reference)

    def plan(self, target, limits: MotionLimits, speed: float = 1.0):
        return quickest_motion(JointLine(self.reference, target), limits, speed)

    def stream(self, stream_period: float, limits: MotionLimits) -> SetpointStream:
        """Follow set-points from rest; no guard watches."""
        limits, reach = self.filter.reduced_limits(limits), np.array(self.description.limits.position)
        torque = StreamTorqueMargin(self.description, self.dynamics)
        return self.begin(SetpointStream(self.reference, stream_period, limits, reach=reach, torque=torque))


def cycle(name: str = "zv", q=Q1, estimator=None, seed: int = 0, plant: Plant | None = None) -> Line:
    payload = body(paper_payload(UR5E))
    tvist = TvistFilter(shaper(name), estimator or Polynomial(**POLYNOMIAL), joints=6)
    return Line(UR5E, tvist, q=np.array(q), declared=payload, carried=payload, seed=seed, plant=plant)


class NoArm:
    """A plant that follows its commands exactly."""

    payload = UR5E.payload

    def step(self, command):
        return Measurement(command.q, command.qd, np.zeros_like(command.q), np.zeros(3))

    def reset(self, command, **_):
        return self.step(command)

    def truth(self):
        return None


def without_arm(*arguments, **named) -> Line:
    """A `cycle` whose plant follows exactly."""
    return cycle(*arguments, plant=NoArm(), **named)


def setup(description: RobotDescription = UR5E, **changes) -> Setup:
    start = {"q": description.poses["Q1"], "payload": paper_payload(description), "calibration": None}
    return Setup(description=description, **({"clock": "free"} | start | changes))


class Kept(Sink):
    def __init__(self) -> None:
        self.events, self.entries, self.states, self.errors = [], [], [], []
        self.event, self.journal = self.events.append, self.entries.append
        self.state, self.raised = self.states.append, self.errors.append


class Robot:
    """A controller with a lease, and its output."""

    def __init__(
        self,
        description: RobotDescription = UR5E,
        *,
        lease_s: float = 30.0,
        plant: Plant | None = None,
        **changes,
    ) -> None:
        self.controller = Controller(setup(description, **changes), plant)
        self.token = self.controller.receive(c.TakeControl(client="a", lease_s=lease_s)).token
        self.states, self.events = [], []

    def send(self, kind, **fields):
        if "token" in kind.__struct_fields__:
            fields.setdefault("token", self.token)
        return self.controller.receive(kind(**fields))

    def setpoint(self, sequence, q, **fields):
        setpoint = c.Setpoint(**({"token": self.token, "sequence": sequence, "q": tuple(q)} | fields))
        self.controller.receive_setpoint(setpoint)

    def tick(self, count: int = 1):
        for _ in range(count):
            state, events = self.controller.tick()
            assert not self.controller.programs.raised
            self.states.append(state)
            self.events += events
        return self.states[-1] if self.states else None

    def until(self, wanted, most: int = 30_000):
        """Tick until something is so; return the last state."""
        for _ in range(most):
            self.tick()
            if wanted():
                return self.states[-1]
        raise AssertionError("it never was so")

    def until_rest(self, most: int = 5000):
        return self.until(lambda: self.controller.cycle.mode.at_rest, most)

    def move(self, ticks: int = 200) -> int:
        """Start a move to Q3 and let it run for some ticks; return its number."""
        accepted = self.send(c.MoveJ, q=tuple(Q3))
        self.tick(ticks)
        return accepted.id

    def stream(self, ticks: int = 100, swing=0.1, pace: float = 3.0, **limits):
        """A stream of set-points that swing to one side for some ticks, which goes on."""
        assert self.send(c.ServoStart, **limits) == Done()
        start = self.controller.cycle.sample.reference
        for k in range(ticks):
            self.setpoint(k, start + swing * (1 - np.cos(pace * k * H)))
            self.tick()

    def kinds(self):
        return [event.kind for event in self.events]

    def told(self, kind):
        return [event for event in self.events if event.kind == kind]

    def motions(self):
        """Return starts and ends of motions."""
        return [kind for kind in self.kinds() if kind.startswith("motion_")]

    def warnings(self):
        return [event.why for event in self.told("warning")]

    def column(self, name):
        return np.array([getattr(state, name) for state in self.states])


def bits(states):
    return [encode(state) for state in states]
