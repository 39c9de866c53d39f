"""Where the arm would meet itself or the floor."""

import itertools

import numpy as np
import pinocchio as pin
import pytest

from tvist_controller.collision import CLEARANCE, CollisionModel
from tvist_controller.trajectory import JointLine
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import Payload
from tvist_plant.model import link_frame, rigid_model
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationReset

from .robots import UR5E, Robot

Q1, Q2, Q3 = (np.array(UR5E.poses[name]) for name in ("Q1", "Q2", "Q3"))
DOWN = np.array([0.0, 0.6, 0.0, -1.57, 0.0, 0.0])
"""The upper arm points below the horizon."""


@pytest.fixture(scope="module")
def model():
    return CollisionModel(UR5E, UR5E.payload)


def capsules(q):
    """Ends and radii of all bodies in the world, by forward kinematics of this test's own."""
    arm = rigid_model(UR5E, Payload())
    data = arm.createData()
    pin.forwardKinematics(arm, data, q)
    found = {}
    for part in UR5E.collision.bodies:
        at = pin.SE3.Identity()
        if part.link >= 0:
            at = data.oMi[part.link + 1] * link_frame(UR5E, part.link)
        found[part.name] = (at.act(np.array(part.start)), at.act(np.array(part.end)), part.radius)
    flange = data.oMi[6] * link_frame(UR5E, 5)
    com, radius = np.array(UR5E.payload.com), UR5E.collision.payload_radius
    inset = com * min(radius / np.linalg.norm(com), 1.0)
    found["payload"] = (flange.act(inset), flange.act(2 * com - inset), radius)
    return found


def distance(one, other):
    """Between two capsules, by brute force over both axes."""
    t = np.linspace(0.0, 1.0, 201)[:, None]
    a, b = one[0] + t * (one[1] - one[0]), other[0] + t * (other[1] - other[0])
    return np.linalg.norm(a[:, None] - b[None], axis=2).min() - one[2] - other[2]


def nearest(q):
    """Least distance of pairs that can meet, and to the floor."""
    bodies = capsules(q)
    names = list(bodies)
    apart = {frozenset(pair) for pair in UR5E.collision.apart}
    pairs = [
        distance(bodies[a], bodies[b])
        for (i, a), (j, b) in itertools.combinations(enumerate(names), 2)
        if j - i > 1 and frozenset((a, b)) not in apart
    ]
    floor = [min(bodies[name][0][2], bodies[name][1][2]) - bodies[name][2] for name in names[2:]]
    return min(pairs + floor)


def test_meetings_are_those_of_an_independent_geometry(model):
    met = 0
    for q in WORKSPACE.random(150, 6, seed=8):
        expected = nearest(q)
        if abs(expected - CLEARANCE) < 1e-3:  # brute force is no finer
            continue
        assert (model.meeting(q) is not None) == (expected < CLEARANCE), (q, expected)
        met += expected < CLEARANCE
    assert 5 < met < 100


def test_the_papers_motions_are_free(model):
    for start, end in ((Q1, Q2), (Q1, Q3), (Q3, Q1)):
        assert model.on_way(JointLine(start, end).whole) is None


def test_a_way_that_is_found_free_is_free_by_small_steps(model):
    poses = [q for q in WORKSPACE.random(60, 6, seed=3) if model.meeting(q) is None]
    free = 0
    for start, end in itertools.pairwise(poses):
        way = end - start
        found = model.on_way(JointLine(start, end).whole)
        fine = [model.meeting(start + share * way) for share in np.linspace(0.0, 1.0, 400)]
        deepest = min((meeting.distance for meeting in fine if meeting is not None), default=CLEARANCE)
        if found is None:
            free += 1
            assert deepest > CLEARANCE - 0.01  # a step of 0.02 rad may pass a corner by that much
        else:
            assert deepest < CLEARANCE
    assert free > 20


def test_a_move_that_would_collide_is_refused_with_the_pair_and_the_time():
    robot = Robot()
    reply = robot.send(c.MoveJ, q=tuple(DOWN))
    assert isinstance(reply, Refused)
    assert reply.code == "collision"
    assert "floor" in reply.why
    assert "s after the start" in reply.why
    before = robot.states[-1].target_q if robot.states else None
    robot.tick(50)
    assert before is None or robot.states[-1].target_q == before
    assert robot.send(c.MoveJ, q=tuple(Q2)) == Accepted(id=1)


def test_an_arm_that_is_in_a_meeting_may_move_out_of_it_and_not_further_in():
    robot = Robot()
    assert isinstance(robot.send(SimulationReset, q=tuple(DOWN)), Done)
    deeper = DOWN + np.array([0.0, 0.2, 0.0, 0.0, 0.0, 0.0])
    assert robot.send(c.MoveJ, q=tuple(deeper)).code == "collision"
    assert robot.send(c.MoveJ, q=(0.0, -0.5, 0.0, -1.57, 0.0, 0.0)) == Accepted(id=1)


def test_a_stream_that_would_collide_is_stopped_before_it_does():
    robot = Robot()
    start = np.array([0.0, -1.0, 0.0, -1.57, 0.0, 0.0])
    robot.send(SimulationReset, q=tuple(start))
    assert robot.send(c.ServoStart) == Done()
    q = start.copy()
    for sequence in range(2000):
        q[1] += min(0.002 * 0.004 * sequence, 0.002 * 1.2)
        if not robot.controller.motion.streaming:
            break
        robot.setpoint(sequence, tuple(q))
        robot.tick()
    robot.until_rest()
    ended = [event for event in robot.events if event.kind == "stream_stopped"]
    assert [event.code for event in ended] == ["collision"]
    # The stop begins a tick after it is known to be needed: of the clearance that tick's way is lost.
    for state in robot.states[-200:]:
        assert nearest(np.array(state.target_q)) > 0.0


def test_a_robot_file_without_bodies_never_meets_anything():
    import msgspec

    bare = msgspec.structs.replace(UR5E, collision=type(UR5E.collision)())
    assert CollisionModel(bare, UR5E.payload).meeting(DOWN) is None
