"""Collisions of the arm with itself and the floor."""

import itertools
from importlib import resources

import numpy as np
import pinocchio as pin
import pytest

from tvist_controller.foresight.collision import CLEARANCE, CollisionModel
from tvist_controller.trajectory import JointLine
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import DescriptionError, Payload, load
from tvist_plant.model import link_frame, rigid_model
from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationReset
from tvist_protocol.values import Payload as Carried

from .robots import Q2, UR5E, Robot

DOWN = np.array([0.0, 0.6, 0.0, -1.57, 0.0, 0.0])
"""The upper arm points below the horizon."""


@pytest.fixture(scope="module")
def model():
    return CollisionModel(UR5E, UR5E.payload)


def capsules(q, payload=UR5E.payload):
    """Return ends and radii of all bodies in the base frame, by the test's own forward kinematics."""
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
    com, radius = np.array(payload.com), UR5E.collision.payload_radius
    inset = com * min(radius / np.linalg.norm(com), 1.0)
    found["payload"] = (flange.act(inset), flange.act(2 * com - inset), radius)
    return found


def distance(one, other):
    """Return the distance between two capsules, by brute force along one axis."""
    a, axis = one[0] + np.linspace(0.0, 1.0, 401)[:, None] * (one[1] - one[0]), other[1] - other[0]
    share = np.clip((a - other[0]) @ axis / max(axis @ axis, 1e-12), 0.0, 1.0)
    return np.linalg.norm(a - other[0] - share[:, None] * axis, axis=1).min() - one[2] - other[2]


def gaps(q):
    """Return the distances of all pairs that can meet, including the floor."""
    bodies = capsules(q)
    names = list(bodies)
    apart = {frozenset(pair) for pair in UR5E.collision.apart}
    pairs = [
        distance(bodies[a], bodies[b])
        for (i, a), (j, b) in itertools.combinations(enumerate(names), 2)
        if j - i > 1 and frozenset((a, b)) not in apart
    ]
    floor = [min(bodies[name][0][2], bodies[name][1][2]) - bodies[name][2] for name in names[2:]]
    return np.array(pairs + floor)


def test_collisions_match_an_independent_geometry(model):
    met = 0
    for q in WORKSPACE.random(100, 6, seed=8):
        expected = gaps(q).min()
        if abs(expected - CLEARANCE) < 1e-3:  # brute force is no finer
            continue
        assert (model.meeting(q) is not None) == (expected < CLEARANCE), (q, expected)
        met += expected < CLEARANCE
    assert 5 < met < 100


def test_a_path_found_free_is_free_in_small_steps(model):
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


def test_a_colliding_move_is_refused_with_bodies_and_time(robot):
    reply = robot.send(c.MoveJ, q=tuple(DOWN))
    assert isinstance(reply, Refused)
    assert reply.code == "collision"
    assert "floor" in reply.why
    assert "s after the start" in reply.why
    before = robot.tick().target_q
    assert robot.tick(50).target_q == before
    assert robot.send(c.MoveJ, q=tuple(Q2)) == Accepted(id=1)


def turned_wrists(number):
    posture = WORKSPACE.random(1, 6, seed=number)[0]
    posture[4:] = np.random.default_rng(number).uniform(-2, 2, 2)
    return posture


@pytest.mark.parametrize("number", [7, 26, 124, 302, 509])
def test_a_path_out_of_a_collision_brings_no_pair_of_bodies_closer(model, number):
    """The nearest pair may separate while another pair, also too close, would come closer."""
    start = turned_wrists(number)
    assert model.meeting(start) is not None
    way = JointLine(start, start + np.random.default_rng([number, 1]).uniform(-0.5, 0.5, 6)).whole
    depth = np.minimum([gaps(way.at(share)) for share in np.linspace(0.0, 1.0, 11)], CLEARANCE)
    nearer = (np.maximum.accumulate(depth) - depth).max()
    # Brute force is no finer than a millimetre.
    assert nearer < 1e-3 if model.on_way(way) is None else nearer > 0.0


INERTIA = (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)


@pytest.mark.parametrize(
    ("name", "mass", "com"), [("ur5e", 5.0, UR5E.payload.com), ("ur30", 2.0, (0.1, -0.2, 0.2))]
)
def test_a_reset_into_a_collision_is_refused_with_posture_and_bodies(name, mass, com):
    arm, robot = load(name), Robot(description=load(name))
    declared = {"mass": mass, "com": com, "inertia": INERTIA}
    assert robot.send(c.SetPayload, **declared) == Done()
    model = CollisionModel(arm, Payload(**declared))
    refused = 0
    for number in range(40):
        q = turned_wrists(number)
        before, met = robot.controller.cycle.position, model.meeting(q)
        # The carried payload is the robot file's, a short disc.
        plain = CollisionModel(arm, robot.controller.cycle.plant.payload).meeting(q)
        reply = robot.send(SimulationReset, q=tuple(q), seed=number)
        if met is None and plain is None:
            assert isinstance(reply, Done)
            continue
        refused += 1
        assert (reply.code, reply.where, reply.limit) == ("collision", "q", CLEARANCE)
        for part in (str(met or plain), f"[{q[0]:.4g}, {q[1]:.4g}"):
            assert part in reply.why
        assert (robot.controller.cycle.position == before).all()
    assert 1 < refused < 39


@pytest.mark.parametrize("name", ["payload", "floor"])
def test_no_body_of_a_robot_file_is_called_like_payload_or_floor(name, tmp_path):
    text = (resources.files("tvist_plant") / "robots" / "ur5e.toml").read_text(encoding="utf-8")
    (tmp_path / "arm.toml").write_text(text.replace('name = "flange"', f'name = "{name}"'), encoding="utf-8")
    with pytest.raises(DescriptionError, match="all must differ, also from payload and floor"):
        load(tmp_path / "arm.toml")


def test_a_robot_cannot_start_in_a_collision():
    with pytest.raises(ValueError, match=r"start: at q = \[0, 0.6, .*wrist_2 and floor would overlap by"):
        Robot(q=tuple(DOWN))
    far = Carried(mass=3.0, com=(0.3, 0.0, 0.3), inertia=INERTIA)
    with pytest.raises(ValueError, match="payload and floor"):
        Robot(q=(0.0, -0.3, 0.0, -1.57, 0.0, 0.0), carried=far)
    Robot(q=(0.0,) * 6, description=UR5E.without_floor())


def test_an_arm_in_collision_may_move_out_but_not_further_in():
    robot, low = Robot(), np.array([0.0, -0.3, 0.0, -1.57, 0.0, 0.0])
    robot.send(SimulationReset, q=tuple(low))
    assert robot.send(c.SetPayload, mass=3.0, com=(0.3, 0.0, 0.3), inertia=INERTIA) == Done()
    assert robot.controller.motion.collisions.meeting(low) is not None
    assert isinstance(robot.send(SimulationReset, mode="RUNNING"), Done)
    deeper = low + np.array([0.0, 0.1, 0.0, 0.0, 0.0, 0.0])
    reply = robot.send(c.MoveJ, q=tuple(deeper))
    assert (reply.code, "payload and floor would overlap" in reply.why) == ("collision", True)
    assert robot.send(c.MoveJ, q=(0.0, -0.9, 0.0, -1.57, 0.0, 0.0)) == Accepted(id=1)
    robot.until_rest()
    assert robot.controller.motion.collisions.meeting(robot.controller.cycle.position) is None
