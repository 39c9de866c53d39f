"""What is looked at before it is done: streams, changes in motion, and what a line is going to do."""

import itertools

import numpy as np
import pytest
from tests.search import changes, streams

from tvist_controller.about import info_of
from tvist_controller.foresight.collision import CLEARANCE, CollisionModel
from tvist_controller.foresight.line_copy import MAX_AHEAD, resting_after
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.line.differentiator import STILL
from tvist_controller.trajectory import StuckError
from tvist_plant.description import Payload
from tvist_protocol import commands as c
from tvist_protocol.motions import SpeedL, StopL
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset

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


def test_a_pause_and_a_change_of_the_filter_are_foreseen_too():
    robot = Robot()
    robot.send(c.MoveJ, q=tuple(Q3))
    robot.tick(300)
    robot.send(c.SetShaper, name="ei")
    robot.tick(20)
    robot.send(c.Pause)
    cycle_ = robot.controller.cycle
    ahead = robot.controller.motion.outlook.foresee()
    for expected in ahead[2:]:
        robot.tick()
        assert cycle_.position == pytest.approx(expected, abs=1e-12)
    assert not cycle_.mode.at_rest
    assert np.abs(cycle_.position - ahead[-1]).max() < 1e-6


def test_a_motion_that_will_get_stuck_is_not_foreseen_and_a_stop_on_it_is_reported():
    """A stop of the tool that is under way may end before its time, near a singular posture."""
    robot = Robot(q=(0.0, -1.2, 1.5, -1.8, -1.57, 0.0))
    robot.send(SpeedL, xd=(0.1, 0.0, 0.0, 0.0, 0.0, 0.0), acceleration=1.0)
    robot.tick(100)
    robot.send(StopL, acceleration=0.5)
    robot.tick(2)

    class Stuck(type(robot.controller.cycle.trajectory)):
        def next(self):
            raise StuckError("near a singular posture")

    robot.controller.cycle.trajectory.__class__ = Stuck
    assert robot.controller.motion.outlook.foresee() is None
    assert robot.send(SimulationInject, fault="safeguard_stop") == Done()
    robot.tick()
    (told,) = (event for event in robot.events if event.kind == "safety_stop")
    assert told.duration is None or told.duration > 0.0


def test_what_lasts_too_long_is_not_foreseen():
    line = without_arm()
    line.begin(line.plan(Q3, type(PAPER)(0.01, 0.1, 1.0)))
    line.step()
    assert MAX_AHEAD * H < 100.0
    assert Stopper(line).foresee() is None


@pytest.mark.parametrize("number", range(10))
def test_no_stream_brings_the_reference_into_the_clearance_however_it_ends(number):
    outcome = streams.judge(UR5E, streams.draw(UR5E, number))
    assert outcome.kept, outcome


@pytest.mark.parametrize("number", range(16))
def test_no_change_in_motion_leads_the_reference_into_the_clearance(number):
    outcome = changes.judge(UR5E, number)
    assert outcome.kept, outcome


def test_a_payload_that_would_meet_the_floor_on_the_rest_of_the_way_is_refused_and_changes_nothing():
    robot, plain = Robot(), Robot()
    start, target = (0.0, -1.57, 0.0, -1.57, 0.0, 0.0), (0.0, -0.3, 0.0, -1.57, 0.0, 0.0)
    for one in (robot, plain):
        one.send(SimulationReset, q=start)
        one.send(c.MoveJ, q=target)
        one.tick(200)
    moment = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)
    reply = robot.send(c.SetPayload, mass=3.0, com=(0.3, 0.0, 0.3), inertia=moment)
    assert isinstance(reply, Refused)
    assert (reply.code, reply.limit) == ("collision", CLEARANCE)
    assert "payload and floor" in reply.why
    for one in (robot, plain):
        one.until_rest()
    assert robot.states == plain.states
    assert robot.send(c.SetPayload, mass=3.0, com=(0.0, 0.0, 0.05), inertia=moment) == Done()


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


def test_no_point_travels_farther_than_the_reach_of_the_joints_that_turn():
    random = np.random.default_rng(0)
    for com in ((0.0, 0.0, 0.04), (0.25, -0.1, 0.1)):
        model = CollisionModel(UR5E, Payload(mass=2.0, com=com))
        for _ in range(60):
            q, turned = random.uniform(-3, 3, (2, 6)) * np.array([[1.0], [0.05]])
            here, there = model._gaps(q).min(), model._gaps(q + turned).min()
            assert abs(there - here) <= model.travel(turned) + 1e-9


def test_info_says_how_long_stops_last():
    info = info_of(Robot().controller).stopping
    assert [(row.payload, row.speed) for row in info] == [
        (mass, speed) for mass in (0.0, UR5E.limits.payload) for speed in (0.33, 0.66, 1.0)
    ]
    for slow, fast in itertools.pairwise(info[:3]):
        assert slow.duration < fast.duration
        assert slow.way < fast.way
    assert all(empty.way < loaded.way for empty, loaded in zip(info[:3], info[3:], strict=True))


def test_a_stream_that_is_refused_from_standstill_ends_and_says_so():
    """At the very edge of the clearance even the first set-point leads too far."""
    robot = Robot()
    model = robot.controller.motion.collisions
    q, low = np.array([0.0, -0.2, 0.0, -1.57, 0.0, 0.0]), 0.8
    while low - q[1] > 1e-9:  # halve: the lowest shoulder that is clear
        middle = np.array([0.0, 0.5 * (q[1] + low), 0.0, -1.57, 0.0, 0.0])
        if model.meeting(middle) is None:
            q = middle
        else:
            low = float(middle[1])
    robot.send(SimulationReset, q=tuple(q))
    assert robot.send(c.ServoStart) == Done()
    for sequence in range(100):
        robot.setpoint(sequence, q + np.array([0.0, 1e-5 * sequence**2, 0.0, 0.0, 0.0, 0.0]))
        robot.tick()
    ended = [event for event in robot.events if event.kind == "stream_stopped"]
    assert [event.code for event in ended] == ["collision"]
    assert not robot.controller.motion.streaming
    assert model.nearest(robot.column("target_q")) >= CLEARANCE - 1e-9
    assert isinstance(robot.send(c.MoveJ, q=(0.0, -1.0, 0.0, -1.57, 0.0, 0.0)), Accepted)
