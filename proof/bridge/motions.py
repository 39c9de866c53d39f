"""The paper's motions and random ones, by a robot that shapes them itself and through a bridge that does."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proof.bridge.in_lockstep import Bridge, HiddenRobot, Link
from tvist_controller.api.line import (
    STILL,
    CollisionModel,
    InverseDynamics,
    MotionLimits,
    body,
    central_differences,
    paper_payload,
)
from tvist_controller.api.robot import truth_of
from tvist_lab.metrics import MotionRows
from tvist_lab.metrics.common_clock import AFTER_STOP, peak_later_than
from tvist_lab.recordings import Floats, Recording
from tvist_lab.study.line import point_to_point
from tvist_lab.study.measures import WORTH
from tvist_lab.study.moves import Move, is_free
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import RobotDescription, load
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_protocol.replies import Accepted
from tvist_server.moving import registers

ROBOTS = ("ur5e", "ur5-light")
"""Robot files, in turn."""
PAPER = ("Q2", "Q1", "Q3", "Q1")
"""Where the paper's motions end, from Q1."""
SPEEDS = ((1.5, 2.0, 100.0), (1.05, 1.4, 50.0), (0.8, 2.0, 200.0))
"""Velocity, acceleration and jerk of the motions [rad/s, rad/s², rad/s³]; the first are the paper's."""
REST = 250
"""Ticks at rest after a motion."""
TORQUE = 0.95
"""Share of the joints' torques that twice the motion's accelerations may need [-]. The simulated `servoj` is late where
they need more than the torques: nothing smooths what a client sends, and the arm swings as far again.
"""
POINTS = 3.0
"""Largest loss by the bridge that counts as none [percentage points]."""
BAD = ("protective_stop", "motion_stopped", "program_stopped")
"""Kinds of events that end a motion."""


@dataclass(frozen=True)
class Asked:
    """A motion to make."""

    q: Floats
    """Where it ends, shape (n,) [rad]."""
    speed: tuple[float, float, float]
    """See `SPEEDS`."""


@dataclass
class Made:
    """The motions that a robot made."""

    peaks: list[float] = field(default_factory=list)
    """Largest acceleration of the tool later than 10 ms after the stop of each [m/s²]."""
    ends: list[Floats] = field(default_factory=list)
    """Joint angles at the end of each rest, shape (n,) [rad]."""
    stops: list[str] = field(default_factory=list)
    """What ended a motion before its target."""


@dataclass(frozen=True)
class Row:
    """What a shaper leaves of a robot's vibration, inside the robot and in front of it."""

    robot: str
    seed: int
    shaper: str
    motions: int
    """Motions whose vibration counts."""
    inside_percent: float
    """Reduction of the peak by the shaper inside the robot, median [%]."""
    through_percent: float
    """The same through the bridge [%]."""
    points: float
    """Median of each motion's difference: through the bridge less inside [percentage points]."""
    points_p5: float
    """5th percentile of the differences."""
    worst_points: float
    """The lowest of them."""
    within_percent: float
    """Motions that lose at most 3 points by the bridge [%]."""
    stops: int
    """Motions that ended before their targets, protective stops among them."""
    beyond: int
    """Steps of the robot's target beyond its speed limit, and set-points cut off at a limit."""
    alone: int
    """Periods in which the program had no set-point."""
    older_percent: float
    """Set-points that the robot began to follow later than two ticks after they were computed [%]."""
    end_mrad: float
    """Largest distance of a joint's rest through the bridge from that inside the robot [mrad]."""


def asked(description: RobotDescription, count: int, seed: int) -> Iterator[Asked]:
    """Yield the paper's motions and random ones, each from the end of the one before.

    They are free of collisions, and the random ones leave the torques that `servoj` wants, see `TORQUE`.
    """
    payload, random = paper_payload(description), np.random.default_rng([seed, 79])
    collision, dynamics = (
        CollisionModel(description, body(payload)),
        InverseDynamics(description, body(payload)),
    )
    most = TORQUE * np.array(description.limits.torque)
    here = np.array(description.poses["Q1"])
    for name in PAPER:
        yield Asked(np.array(description.poses[name]), SPEEDS[0])
    found = 0
    while found < count:
        far = random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0])
        there = here + random.uniform(0.3, 1.0) * (far - here)
        speed = SPEEDS[random.integers(len(SPEEDS))]
        states = zip(
            *central_differences(point_to_point(here, there, MotionLimits(*speed)), PERIOD), strict=True
        )
        if all(
            (np.abs(dynamics.torque(q, qd, 2.0 * qdd)) <= most).all() for q, qd, qdd in states
        ) and is_free(collision, Move(tuple(here.tolist()), tuple(there.tolist()), payload.mass)):
            found, here = found + 1, there
            yield Asked(there, speed)


def made(side: HiddenRobot | Bridge, motions: Sequence[Asked]) -> Made:
    """Let a robot make motions, one after the other from rest to rest, until one is stopped."""
    done = Made()
    for motion in motions:
        velocity, acceleration, jerk = motion.speed
        target = tuple(motion.q.tolist())
        reply = side.send(MoveJ, q=target, velocity=velocity, acceleration=acceleration, jerk=jerk)
        if not isinstance(reply, Accepted):
            done.stops.append(str(reply))
            break
        peak = _made(side)
        bad = [
            f"{event.kind}: {event.why}" for event in (*side.events, *side.robot.events) if event.kind in BAD
        ]
        if bad:
            done.stops.append(bad[0])
            break
        done.peaks.append(peak)
        done.ends.append(np.array(side.robot.controller.latest.actual_q))
    return done


def _made(side: HiddenRobot | Bridge) -> float:
    """Tick until the motion that begins has ended, and rest; return its peak [m/s²]."""
    ticks, stop, before = 0, 0, side.wanted
    rows: list[tuple[int, Floats, Floats]] = []
    while len(rows) < REST:
        side.tick()
        ticks += 1
        if np.abs(side.wanted - before).max() > STILL:
            stop = ticks
        before = side.wanted
        if side.controller.cycle.mode.at_rest:
            truth = truth_of(side.robot.plant)
            rows.append((ticks, truth.specific_force, truth.flange_rotation))
    tick, force, rotation = (np.array(column) for column in zip(*rows, strict=True))
    turn = Rotation.from_matrix(rotation).as_rotvec()
    recording = Recording({
        "tick": tick.astype(float), "timestamp": tick * PERIOD, "truth_tool_acceleration": force,
        "truth_flange_pose": np.hstack([np.zeros_like(turn), turn]),
    })  # fmt: skip
    rest = MotionRows(start=0, reference_stop=0, shaped_stop=0, end=len(rows))
    return peak_later_than(recording, rest, (stop + side.late) * PERIOD + AFTER_STOP)


def rows_of(
    name: str, seed: int, shapers: Sequence[str], count: int, link: Link, tell: Callable[[str], None]
) -> list[Row]:
    """Compare the shapers inside a hidden robot with the same ones in front of it."""
    description = load(name)
    payload, start = paper_payload(description), np.array(description.poses["Q1"])
    motions = list(asked(description, count, seed))

    def inside(shaper: str) -> Made:
        return made(HiddenRobot(description, seed, start, payload, shaper), motions)

    plain, found = inside("none"), []
    for shaper in shapers:
        bridge = Bridge(description, seed, start, payload, shaper, link)
        found.append(_row(name, seed, shaper, plain, inside(shaper), made(bridge, motions), bridge))
        one = found[-1]
        tell(f"{name}, seed {seed}, {shaper}: {one.points:+.2f} points, worst {one.worst_points:+.2f}")
    return found


def _row(name: str, seed: int, shaper: str, plain: Made, inside: Made, through: Made, bridge: Bridge) -> Row:
    number = min(len(one.peaks) for one in (plain, inside, through))
    before, within, behind = (np.array(one.peaks[:number]) for one in (plain, inside, through))
    counts, port = before >= WORTH, bridge.port
    less, less_through = (100.0 * (1.0 - peaks[counts] / before[counts]) for peaks in (within, behind))
    points = less_through - less
    speed = min(bridge.robot.controller.setup.description.limits.velocity)
    ages = port.counts.played
    apart = np.abs(np.array(inside.ends[:number]) - np.array(through.ends[:number]))
    return Row(
        robot=name, seed=seed, shaper=shaper, motions=int(counts.sum()),
        inside_percent=float(np.median(less)), through_percent=float(np.median(less_through)),
        points=float(np.median(points)), points_p5=float(np.percentile(points, 5)),
        worst_points=float(points.min()), within_percent=100.0 * float(np.mean(points >= -POINTS)),
        stops=len(inside.stops) + len(through.stops),
        beyond=int(port.counts.largest_step > speed * PERIOD) + port.setpoints.limited,
        alone=port.output(registers.ALONE),
        older_percent=100.0 * sum(n for age, n in ages.items() if age > 2) / sum(ages.values()),
        end_mrad=1e3 * float(apart.max()),
    )  # fmt: skip


def report(
    robots: int, seed: int, shapers: Sequence[str], count: int, tell: Callable[[str], None]
) -> dict[str, Any]:
    """Compare shapers on hidden robots.

    Args:
        robots: Number of hidden robots, of each model in turn.
        seed: Seed of the first of them, its motions and its link; others follow.
        shapers: Names of the shapers.
        count: Number of random motions after the paper's.
        tell: Takes a line of progress.
    """
    found: list[Row] = []
    for number in range(robots):
        name = ROBOTS[number % len(ROBOTS)]
        found += rows_of(name, seed + number, shapers, count, Link(), tell)
    return {"link": vars(Link()), "rows": [vars(one) for one in found]}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return the rows as a table."""
    columns = list(result["rows"][0]) if result["rows"] else []
    rows = [
        [f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()]
        for row in result["rows"]
    ]
    return [(columns, rows)]
