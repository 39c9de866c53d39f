"""`python -m tests.paper.following`: how well a robot follows a payload that nobody has declared, as a table.

The arm differs from what the controller knows: Coulomb friction ±20 % in each joint, which changes its sign within half
the speed, velocity gains ±10 %, torque sensors ±3 %, torque noise of 0.5 N m rms, and gear errors. Its springs are
those of the robot file; the controller has fitted ones. Nothing was tuned on the seeds of `main`.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from tvist_controller.api.line import DrivenLine, body, load_calibration, paper_payload
from tvist_controller.planning.snapshot import FilterState
from tvist_controller.safety.payload_learning import AFTER, MotionRecord, PayloadEstimator
from tvist_controller.sources.mode_source import first_source
from tvist_lab.study.line import PAPER, RESTING
from tvist_lab.study.moves import draw_moves
from tvist_lab.study.recipes import Recipe, own_move
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import GRAVITY

ROBOT, MODAL = load("ur5e"), load_calibration("ur5e_modal")
SEED = 7_000  # first seed of the tables


@dataclass(frozen=True)
class Arm:
    """An arm that differs from what the controller knows."""

    known: object
    true: object
    sensors: np.ndarray

    @classmethod
    def drawn(cls, seed, *, friction=True, masses=0.0):
        """Draw one; `masses` is the share by which each link is heavier or lighter."""
        random, known = np.random.default_rng([seed, 7]), ROBOT if friction else ROBOT.clean()
        drives, changed = known.drives, msgspec.structs.replace
        shares = (0.1, 0.2 if friction else 0.0, 0.03)
        gains, own, sensors = (1.0 + share * random.uniform(-1, 1, ROBOT.joints) for share in shares)
        drives = changed(
            drives,
            velocity_gain=tuple((gains * drives.velocity_gain).tolist()),
            coulomb_friction=tuple((own * drives.coulomb_friction).tolist()),
            friction_width=drives.friction_width * (0.5 if friction else 1.0),
        )
        heavier = 1.0 + masses * random.choice([-1.0, 1.0], ROBOT.joints)
        inertia = (heavier[:, None] * known.links.inertia).tolist()
        mass = tuple((heavier * known.links.mass).tolist())
        links = changed(known.links, mass=mass, inertia=tuple(map(tuple, inertia)))
        return cls(known, changed(known, drives=drives, links=links), sensors)


@dataclass(frozen=True)
class Driven:
    """What the drives get for a move while a mass is believed, with `elastic` or unshaped."""

    believed: object
    driven: object
    first: int
    stop: int

    @classmethod
    def of(cls, known, move, mass, shaper="elastic"):
        start, recipe = np.array(move.start), Recipe(shaper, MODAL)
        tvist, reference = own_move(recipe, known, replace(move, mass=mass), PAPER)
        elastic = recipe.elastic(known, tvist)
        tvist.reset(start)
        shaped = np.array([tvist.filter(q).copy() for q in [*reference, *[reference[-1]] * 60]])
        believed = paper_payload(known, mass)
        line = DrivenLine(known, body(believed))
        driven = line.drive(start, shaped, RESTING + len(shaped) + 200, RESTING, elastic)
        moving = np.flatnonzero(np.abs(np.diff(driven.targets[:, 0], axis=0)).max(axis=1) > 0)
        return cls(believed, driven, int(moving[0]), int(moving[-1]) + 2)

    def respond(self, arm, carried, seed):
        plant = FlexibleArm(arm.true, body(paper_payload(ROBOT, carried)))
        plant.reset(self.driven.rest, seed=seed)
        return plant.play(self.driven.commands)

    def recorded(self, response, sensors, seed):
        """Return a robot's recording of a response, with gains and noise of its torque sensors."""
        kept, measured = slice(self.first, self.stop + AFTER), response.measured
        noise = 0.5 * np.random.default_rng([seed, 99]).standard_normal(measured.moment.shape)
        moment = (sensors * measured.moment + noise)[kept]
        return MotionRecord(measured.q[kept], moment, self.stop - self.first, True, taken_for(self.believed))

    def peak(self, arm, carried, seed):
        """Largest acceleration of the tool later than 10 ms after the stop [m/s²]."""
        response = self.respond(arm, carried, seed)
        up = np.einsum("tji,j->ti", response.flange_rotation, [0.0, 0.0, GRAVITY])
        return float(np.linalg.norm(response.specific_force - up, axis=1)[self.stop + 4 :].max())


def taken_for(payload):
    """Return what a robot believes about its arm after a payload was declared."""
    return FilterState("zv", 1, first_source(ROBOT, None), payload, payload)


def followed(seed, *, friction=True, masses=0.0, motions=2):
    """Points of reduction behind the known payload's before and after each of some motions, and errors of mass [kg].

    None if the unshaped move vibrates too little to judge.
    """
    arm = Arm.drawn(seed, friction=friction, masses=masses)
    moves = draw_moves(ROBOT, motions + 1, seed, (0.0, 5.0)).moves
    mass, believed = moves[0].mass, float(np.random.default_rng([seed, 5]).uniform(0.0, 5.0))
    student, masses_believed = PayloadEstimator(arm.known), [believed]
    payload = paper_payload(ROBOT, believed)
    for number, move in enumerate(moves[:motions]):
        driven, own = Driven.of(arm.known, move, payload.mass), 10 * seed + number
        record = driven.recorded(driven.respond(arm, mass, own), arm.sensors, own)
        lesson = student.study(replace(record, beliefs=taken_for(payload)))
        payload = payload if lesson is None else lesson.payload
        masses_believed.append(payload.mass)
    last = moves[-1]
    unshaped = Driven.of(arm.known, last, mass, "none").peak(arm, mass, seed)
    if unshaped < 0.2:
        return None
    peaks = [Driven.of(arm.known, last, one).peak(arm, mass, seed) for one in (mass, *masses_believed)]
    behind = 100.0 * (np.array(peaks[1:]) - peaks[0]) / unshaped
    return behind, np.array(masses_believed) - mass


def unchanged(seed, arms, *, draws=6, friction=True, masses=0.0):
    """Return how many lessons arms teach whose payload is believed rightly, and the errors of its mass [kg].

    For each arm, gains and noise of its torque sensors are drawn several times.
    """
    known = Arm.drawn(seed, friction=friction).known
    (move,) = draw_moves(ROBOT, 1, seed, (0.0, 5.0)).moves
    driven = Driven.of(known, move, move.mass)
    lessons, found = 0, []
    for number in range(arms):
        arm = Arm.drawn(1_000_003 * seed + number, friction=friction, masses=masses)
        response = driven.respond(arm, move.mass, 1000 * seed + number)
        for draw in range(draws):
            student, random = PayloadEstimator(known), np.random.default_rng([seed, number, draw])
            sensors = 1.0 + 0.03 * random.uniform(-1.0, 1.0, known.joints)
            record = driven.recorded(response, sensors, int(random.integers(2**31)))
            lessons += student.study(record) is not None
            found.append(student._known.x[0] - move.mass)
    return lessons, found


CASES = {"friction": {}, "no friction": {"friction": False}, "links ±3 %": {"masses": 0.03}}
"""Arms of the tables."""


def main(cases: int) -> Iterator[str]:
    """Yield both tables as lines of Markdown."""
    yield "| arm | cases | before | after one | after two | within 2 points | mass, median / largest kg off |"
    yield "|---|---:|---|---|---|---|---|"
    for name, how in CASES.items():
        rows = [row for seed in range(SEED, SEED + cases) if (row := followed(seed, **how)) is not None]
        behind, errors = np.array([row[0] for row in rows]), np.abs([row[1][-1] for row in rows])
        points = " | ".join(f"{np.median(one):.1f} ({one.max():.1f})" for one in behind.T)
        within = " / ".join(f"{100 * np.mean(one <= 2.0):.0f}" for one in behind.T)
        yield f"| {name} | {len(rows)} | {points} | {within} % | {np.median(errors):.2f} / {errors.max():.2f} |"
    yield "\n| arm | motions | false steps | mass, median / largest kg off |\n|---|---:|---:|---|"
    for name, how in CASES.items():
        told, found = zip(*(unchanged(SEED + seed, 5, **how) for seed in range(cases)), strict=True)
        off = np.abs(np.concatenate(found))
        yield f"| {name} | {len(off)} | {sum(told)} | {np.median(off):.2f} / {off.max():.2f} |"


if __name__ == "__main__":
    for line in main(int(sys.argv[1]) if len(sys.argv) > 1 else 60):
        sys.stdout.write(line + "\n")
        sys.stdout.flush()
