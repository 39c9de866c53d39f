"""Everyday motions of hidden robots that change after a while, and when they say so."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from proof.monitor.changing_arm import Change, ChangingArm
from tvist_controller.api.line import Setup, body, load_calibration, paper_payload
from tvist_controller.api.robot import Controller
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_plant.hidden import MASS
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.replies import Accepted

BASE = 1.5e5
"""Stiffness of a base that yields [N m/rad], as that of the plant `base`."""
CHANGES: dict[str, Change | None] = {
    "payload": Change("payload changed by 2 kg", mass=2.0),
    "springs": Change("gears and links 30 % softer", springs=0.7),
    "base": Change("base of 150 kN m/rad 30 % softer", base=0.7),
    "nothing": None,
}
"""What becomes of the arm."""
LESS = Change("payload changed by -2 kg", mass=-2.0)
"""What becomes of every second arm whose payload changes, if it carries as much."""
BEFORE, WITHIN, LATER = 20, 3, 10
"""Number of motions before the change, of those after it in which it should be noticed, and of those that are made."""
SPEEDS = ((0.6, 1.0, 50.0), (1.05, 1.4, 100.0), (1.5, 2.0, 100.0), (1.5, 3.0, 200.0))
"""Velocity, acceleration and jerk of the motions [rad/s, rad/s², rad/s³]."""
REST = (150, 400)
"""Shortest and longest rest between two motions, in ticks."""
PAYLOADS = (0.5, 3.0)
"""Smallest and largest declared payload [kg]."""


@dataclass(frozen=True)
class Outcome:
    """What one robot said."""

    alarms: int
    """Warnings before anything had changed."""
    motions: int
    """Motions until then."""
    noticed: int | None
    """Number of motions after the change with which the first warning came; None if there was none in time."""


class Worker:
    """A hidden robot that moves all day.

    Args:
        robot: Name of the robot file.
        shaper: Name of its shaper.
        seed: Seed of robot, payload and motions.
        base: Stiffness of its base; None for a rigid one [N m/rad].
    """

    def __init__(self, robot: str, shaper: str, seed: int, base: float | None) -> None:
        description, self.random = load(robot), np.random.default_rng([seed, 73])
        self.mass = float(self.random.uniform(*PAYLOADS))
        """Declared mass [kg]."""
        payload = paper_payload(description, self.mass)
        self.arm = ChangingArm(description, body(payload), seed, base)
        setup = Setup(
            description=description, q=description.poses["Q1"], payload=payload,
            calibration=load_calibration(f"{robot}_modal"), shaper=shaper, clock="free", seed=seed,
        )  # fmt: skip
        self._controller = Controller(setup, self.arm)
        reply = self._controller.receive(TakeControl(client="proof"))
        assert isinstance(reply, Accepted), "nobody else has control"
        self._token = str(reply.token)
        self.warnings: list[str] = []
        """What it has warned of."""

    def move(self) -> None:
        """Make a random motion, and rest."""
        while not isinstance(self._controller.receive(self._drawn()), Accepted):
            pass
        self._tick()
        while not self._controller.cycle.mode.at_rest:
            self._tick()
        for _ in range(int(self.random.integers(*REST))):
            self._tick()

    def _drawn(self) -> MoveJ:
        here = np.array(self._controller.latest.reference_q)
        away = self.random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0]) - here
        target = here + self.random.uniform(0.3, 1.0) * away
        velocity, acceleration, jerk = SPEEDS[self.random.integers(len(SPEEDS))]
        return MoveJ(
            token=self._token,
            q=tuple(target.tolist()),
            velocity=velocity,
            acceleration=acceleration,
            jerk=jerk,
        )

    def _tick(self) -> None:
        _, events = self._controller.tick()
        self.warnings += [str(event.why) for event in events if event.kind == "warning"]


def outcome(robot: str, change: str, shaper: str, seed: int) -> Outcome:
    """Let a hidden robot make random motions, and change it after `BEFORE` of them."""
    worker = Worker(robot, shaper, seed, BASE if change == "base" else None)
    for _ in range(BEFORE):
        worker.move()
    alarms, becomes = len(worker.warnings), CHANGES[change]
    if becomes is None:
        return Outcome(alarms, BEFORE, None)
    if change == "payload" and worker.mass > -LESS.mass / (1.0 - MASS) and seed % 2:
        becomes = LESS
    worker.arm.change(becomes)
    for number in range(1, LATER + 1):
        worker.move()
        if len(worker.warnings) > alarms:
            return Outcome(alarms, BEFORE, number)
    return Outcome(alarms, BEFORE, None)


def measure(
    robots: Sequence[str], seeds: Sequence[int], shapers: Sequence[str], progress: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Count what robots noticed and what they said without a reason, a row for each robot, shaper and change."""
    rows = []
    for robot, shaper, change in product(robots, shapers, CHANGES):
        found = []
        for seed in seeds:
            found.append(outcome(robot, change, shaper, seed))
            progress(f"{robot} {shaper} {change}")
        rows.append(
            {
                "robot": robot,
                "shaper": shaper,
                "change": change,
                "robots": len(found),
                f"within_{WITHIN}": sum((one.noticed or LATER + 1) <= WITHIN for one in found),
                f"within_{LATER}": sum(one.noticed is not None for one in found),
                "alarms": sum(one.alarms for one in found),
                "motions": sum(one.motions for one in found),
            }
        )
    return rows
