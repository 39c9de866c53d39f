"""The paper's motions and random ones, by a robot that shapes them itself and through a bridge that does."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

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
from tvist_lab.study.moves import Move, is_free
from tvist_lab.workspace import WORKSPACE
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_protocol.replies import Accepted

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


def asked(description, count, seed):
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


def made(side, motions):
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


def _made(side):
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
