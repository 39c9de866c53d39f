"""What is looked at before it is done: streams, changes in motion, and what a line is going to do."""

import itertools

import numpy as np
import pytest

from tvist_controller.about import info_of
from tvist_controller.foresight.collision import CLEARANCE
from tvist_controller.foresight.line_copy import resting_after
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.line.differentiator import STILL
from tvist_protocol import commands as c
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationReset

from .robots import FITTING, PAPER, Q3, UR5E, H, Robot, without_arm


@pytest.mark.parametrize("name", [*FITTING[:4], "none"])
def test_what_is_foreseen_is_what_happens_to_the_bit(name):
    random = np.random.default_rng(FITTING.index(name) if name in FITTING else 99)
    line = without_arm(name)
    motion = line.begin(line.plan(Q3, PAPER))
    for moment in sorted(random.integers(2, 1100, 3)):
        while line.trajectory._ticks < moment and not line.at_rest and motion.rate == 1.0:
            line.step()
        ahead = Stopper(line).foresee()
        assert ahead is not None
        if moment > 800:
            break
    for expected in ahead[2:]:
        line.step()
        assert (line.position == expected).all()
    assert line.at_rest
    assert np.abs(np.diff(ahead[resting_after(ahead) :], axis=0)).max(initial=0.0) <= STILL


@pytest.mark.parametrize("shaper", ["none", "zv", "ei3"])
def test_a_stream_whose_end_through_the_filter_would_meet_is_stopped_instead(shaper):
    """With its own low acceleration the stream would come to rest in the floor; a hard stop does not."""
    robot, start = Robot(), np.array([0.0, -1.6, 0.0, -1.57, 0.0, 0.0])
    robot.send(c.SetShaper, name=shaper)
    robot.send(SimulationReset, q=tuple(start))
    robot.send(c.ServoStart, velocity=1.5, acceleration=1.0, jerk=100.0)
    q, speed, sequence = start.copy(), 0.0, 0
    while q[1] < -0.2:
        speed = min(speed + 0.9 * H, 1.0)
        q[1] += speed * H
        robot.setpoint(sequence, q)
        robot.tick()
        sequence += 1
    assert robot.controller.motion.streaming
    assert robot.send(c.ServoStop) == Done()
    robot.until_rest()
    ended = [event for event in robot.events if event.kind == "stream_stopped"]
    assert [event.code for event in ended] == ["collision"]
    assert "through the filter" in ended[0].why
    model = robot.controller.motion.collisions
    assert model.nearest(robot.column("target_q")) >= CLEARANCE


def test_info_says_how_long_stops_last():
    info = info_of(Robot().controller).stopping
    assert [(row.payload, row.speed) for row in info] == [
        (mass, speed) for mass in (0.0, UR5E.limits.payload) for speed in (0.33, 0.66, 1.0)
    ]
    for slow, fast in itertools.pairwise(info[:3]):
        assert slow.duration < fast.duration
        assert slow.way < fast.way
    assert all(empty.way < loaded.way for empty, loaded in zip(info[:3], info[3:], strict=True))
