"""Robots at all of their limits: moves, paths and streams, and what their shaped references make of the limits."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tests.search.draws import postures
from tests.search.subject import RigidArm

from tvist_controller.controller import Controller
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.line.differentiator import central_differences
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.setup import Setup, body, paper_payload
from tvist_controller.sources.calibrations import load as load_calibration
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.simulation import SimulationReset
from tvist_shaping.catalogue import SHAPERS
from tvist_shaping.named import BUILT_IN

SEVEN = Path(__file__).parents[1] / "plant" / "urdf" / "seven.urdf"
ARMS = {
    "ur5e, polynomials": ("ur5e", "ur5e_5kg"),
    "ur5e": ("ur5e", "ur5e_modal"),
    "ur3e": ("ur3e", "ur3e_modal"),
    "ur10e": ("ur10e", "ur10e_modal"),
    "ur16e": ("ur16e", "ur16e_modal"),
    "ur20": ("ur20", "ur20_modal"),
    "ur30": ("ur30", "ur30_modal"),
    "seven joints": (SEVEN, None),
}
"""Arms with their own calibrations; the last one is yet to be identified."""
SHAPES = BUILT_IN.names()
KEPT = 1.003
"""Largest ratio of a shaped reference to a limit of velocity or acceleration [-]."""
TORQUE = 1.001
"""Largest ratio of its torque to the limit, for sampling [-]."""


@dataclass(frozen=True)
class Ratios:
    """Largest values of a shaped reference over the joints' limits [-]."""

    velocity: float
    acceleration: float
    torque: float

    @property
    def kept(self) -> bool:
        return self.velocity <= KEPT and self.acceleration <= KEPT and self.torque <= TORQUE

    @property
    def in_motion(self) -> bool:
        """As `kept`, where a change of the shaper or a stream's client decides about the torque."""
        return self.velocity <= KEPT and self.acceleration <= KEPT


class Extreme:
    """One robot without a flexible arm.

    Args:
        arm: Key of `ARMS`.
        shaper: Name of its shaper.
        random: Source of its start and its payload.
    """

    def __init__(self, arm: str, shaper: str, random: np.random.Generator) -> None:
        robot, calibration = ARMS[arm]
        self.description = load(robot)
        self.random, self.limits = random, self.description.limits
        reach = 0.95 * np.array(self.limits.position)
        polynomials = calibration == "ur5e_5kg"
        mass = self.description.payload.mass * (
            1.0 if polynomials else random.choice([0.0, 1.0, random.random()])
        )
        payload = paper_payload(self.description, float(mass))
        collisions = CollisionModel(self.description, body(payload))
        while True:
            self.start, self.goal = np.clip(postures(self.description, random, 2), -reach, reach)
            if collisions.meeting(self.start) is None:
                break
        known = None if calibration is None else load_calibration(calibration)
        self.setup = setup = Setup(
            self.description, tuple(self.start.tolist()), payload, known, shaper="none", clock="free"
        )
        self._dynamics = InverseDynamics(self.description, body(payload))
        self.controller = Controller(setup, RigidArm(body(payload)))
        self.token = self.controller.receive(c.TakeControl(client="a", lease_s=3600.0), session="1f").token
        self.known = not isinstance(self.send(c.SetShaper, name=shaper), Refused)
        if not self.known and shaper in SHAPERS:  # it is for less damping than some postures have
            self.send(c.SetEstimator, name="fixed", f_d=(8.0,), zeta=(0.1,))
            self.known = not isinstance(self.send(c.SetShaper, name=shaper), Refused)
        """Whether the arm can have this shaper."""
        self.references = [self.controller.cycle.position]
        self.events = []

    def send(self, kind, **fields):
        if "token" in kind.__struct_fields__:
            fields["token"] = self.token
        return self.controller.receive(kind(**fields))

    def place(self, q) -> None:
        """Put it somewhere at rest."""
        assert not isinstance(self.send(SimulationReset, q=q), Refused)
        self.start = np.array(q)
        self.references = [self.controller.cycle.position]

    def tick(self) -> None:
        _, events = self.controller.tick()
        self.events += events
        self.references.append(self.controller.cycle.position)

    def until_rest(self, most: int = 20_000) -> None:
        for _ in range(most):
            self.tick()
            if self.controller.cycle.mode.at_rest and not self.controller.motion.motions.running:
                return
        raise AssertionError("it does not come to rest")

    def full(self) -> dict[str, float]:
        """All of the arm's limits, or some of the acceleration."""
        least = min(self.limits.acceleration)
        share = self.random.choice([1.0, self.random.uniform(0.1, 1.0)])
        return {
            "velocity": min(self.limits.velocity),
            "acceleration": float(share * least),
            "jerk": min(self.limits.jerk),
        }

    def move(self):
        return self.send(c.MoveJ, q=tuple(self.goal.tolist()), **self.full())

    def stream(self, seconds: float, period: float = PERIOD, then: str | None = None) -> None:
        """A stream at all limits, whose targets change in mid-motion; half-way, it gets another shaper."""
        limits, every, sequence = self.full(), round(period / PERIOD), 0
        assert not isinstance(self.send(c.ServoStart, period=period, **limits), Refused)
        q, qd = self.start.copy(), np.zeros(len(self.start))
        goal = q
        for tick in range(round(seconds / PERIOD)):
            if then is not None and 2 * tick == round(seconds / PERIOD):
                assert not isinstance(self.send(c.SetShaper, name=then), Refused)
            if not self.controller.motion.streaming:  # something was in the way
                break
            if tick % 200 == 0 or self.random.random() < 0.005:
                goal = self.start + self.random.uniform(-1.5, 1.5, len(q))
            if tick % every == 0:  # as quick as possible, which the limiter makes a motion of
                qd = np.clip((goal - q) / 0.05, -limits["velocity"], limits["velocity"])
                q = q + qd * period
                self.controller.receive_setpoint(
                    c.Setpoint(token=self.token, sequence=sequence, q=tuple(q.tolist()))
                )
                sequence += 1
            self.tick()

    def ratios(self) -> Ratios:
        q = np.array(self.references)
        limits = self.limits
        return Ratios(
            float((np.abs(np.diff(q, axis=0)).max(axis=0) / PERIOD / limits.velocity).max()),
            float((np.abs(np.diff(q, 2, axis=0)).max(axis=0) / PERIOD**2 / limits.acceleration).max()),
            float(
                (
                    np.abs(self._dynamics.torques(*central_differences(q, PERIOD))).max(axis=0)
                    / limits.torque
                ).max()
            ),
        )


def accepted(reply) -> bool:
    return isinstance(reply, Accepted)
