"""A controller in front of a robot moves it as one inside would, over a link that loses packages."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.bridge.in_lockstep import IDEAL, Bridge, HiddenRobot, Link
from tests.controller.robots import Q1, UR5E

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
from tvist_lab.recordings import Recording
from tvist_lab.study.line import point_to_point
from tvist_lab.study.measures import WORTH
from tvist_lab.study.moves import Move, is_free
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_protocol.commands import MoveJ
from tvist_protocol.replies import Accepted
from tvist_server.moving import program as registers

PAYLOAD = paper_payload(UR5E)
NEAR = Q1 + np.array([0.15, 0.0, 0.0, 0.1, 0.1, 0.1])  # what needs more than 90 % of a torque is late


def targets(side, ticks):
    rows = []
    for _ in range(ticks):
        side.tick()
        state = side.robot.controller.latest
        rows.append((state.target_q, state.actual_q))
    return np.array(rows)


@pytest.mark.parametrize("shaper", ["zv", "auto"])
def test_over_an_ideal_link_an_external_shaper_equals_an_internal_one_with_a_delay(shaper):
    inside = HiddenRobot(UR5E, 3, Q1, PAYLOAD, shaper)
    bridge = Bridge(UR5E, 3, Q1, PAYLOAD, shaper, IDEAL)
    for side in (inside, bridge):
        side.send(MoveJ, q=tuple(NEAR.tolist()))
    there, through = targets(inside, 500), targets(bridge, 500)
    late = bridge.late
    assert late <= 3  # a tick to be there, a period of buffer, and the robot's differentiator
    apart = np.abs(through[late:, 0] - there[:-late, 0])
    assert apart.max() < 1e-5
    # Nothing is compensated twice: the arm rests where the robot alone would let it rest, not only its target.
    assert np.abs(through[-1] - there[-1]).max() < 2e-5
    assert np.abs(through[-1, 0] - NEAR).max() < 1e-9


PAPER = ("Q2", "Q1", "Q3", "Q1")  # where the paper's motions end, from Q1
SPEEDS = ((1.5, 2.0, 100.0), (1.05, 1.4, 50.0), (0.8, 2.0, 200.0))
"""Velocity, acceleration and jerk of the motions [rad/s, rad/s², rad/s³]; the first are the paper's."""
REST = 250  # ticks at rest after a motion
TORQUE = 0.95
"""Share of the joints' torques that twice the motion's accelerations may need [-]. The simulated `servoj` is late where
they need more than the torques: nothing smooths what a client sends, and the arm swings as far again.
"""
BAD = ("protective_stop", "motion_stopped", "program_stopped")  # kinds of events that end a motion


def asked(description, count, seed):
    """Yield ends and speeds of the paper's motions and of random ones, each from the end of the one before.

    They are free of collisions, and the random ones leave the torques that `servoj` wants, see `TORQUE`.
    """
    payload, random = paper_payload(description), np.random.default_rng([seed, 79])
    collision = CollisionModel(description, body(payload))
    dynamics, most = InverseDynamics(description, body(payload)), TORQUE * np.array(description.limits.torque)
    yield from ((np.array(description.poses[name]), SPEEDS[0]) for name in PAPER)
    here, found = np.array(description.poses["Q1"]), 0
    while found < count:
        far = random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0])
        there = here + random.uniform(0.3, 1.0) * (far - here)
        speed = SPEEDS[random.integers(len(SPEEDS))]
        way = point_to_point(here, there, MotionLimits(*speed))
        states = zip(*central_differences(way), strict=True)
        light = all((np.abs(dynamics.torque(q, qd, 2.0 * qdd)) <= most).all() for q, qd, qdd in states)
        if light and is_free(collision, Move(tuple(here.tolist()), tuple(there.tolist()), payload.mass)):
            found, here = found + 1, there
            yield there, speed


@dataclass
class Made:
    peaks: list[float] = field(default_factory=list)
    """Largest acceleration of the tool later than 10 ms after the stop of each [m/s²]."""
    ends: list[np.ndarray] = field(default_factory=list)
    """Joint angles at the end of each rest, shape (n,) [rad]."""

    @classmethod
    def by(cls, side, motions):
        """Let a robot make motions, one after the other from rest to rest."""
        done = cls()
        for q, (velocity, acceleration, jerk) in motions:
            how = {"velocity": velocity, "acceleration": acceleration, "jerk": jerk}
            assert isinstance(side.send(MoveJ, q=tuple(q.tolist()), **how), Accepted)
            done.peaks.append(peak(side))
            done.ends.append(np.array(side.robot.controller.latest.actual_q))
            assert not [event for event in (*side.events, *side.robot.events) if event.kind in BAD]
        return done


def peak(side):
    """Tick until the motion that begins has ended, and rest; return its peak [m/s²]."""
    ticks, stop, before, rows = 0, 0, side.wanted, []
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


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "seed", "shaper"), [("ur5e", 11, "auto"), ("ur5-light", 12, "auto-target")])
def test_over_a_lossy_link_an_external_shaper_is_as_effective_as_an_internal_one(
    name, seed, shaper, measured
):
    description = load(name)
    own = description, seed, np.array(description.poses["Q1"]), paper_payload(description)
    bridge = Bridge(*own, shaper, Link())
    sides = HiddenRobot(*own), HiddenRobot(*own, shaper), bridge
    motions = list(asked(description, 8, seed))
    plain, inside, through = (Made.by(side, motions) for side in sides)
    before, within, behind = (np.array(one.peaks) for one in (plain, inside, through))
    rings = before >= WORTH
    less, less_through = (100.0 * (1.0 - peaks[rings] / before[rings]) for peaks in (within, behind))
    apart = 1e3 * float(np.abs(np.array(inside.ends) - np.array(through.ends)).max())
    for what, value in {
        "motions that ring": rings.sum(), "inside, median [%]": np.median(less),
        "points, worst": (less_through - less).min(), "periods alone": bridge.port.output(registers.ALONE),
        "rest apart [mrad]": apart,
    }.items():  # fmt: skip
        measured(what, f"{value:.4g}")
    assert rings.sum() >= 6
    assert (less_through - less).min() > -3.0
    assert bridge.port.counts.largest_step <= min(description.limits.velocity) * PERIOD
    assert bridge.port.setpoints.limited == 0
    assert apart < 0.05
