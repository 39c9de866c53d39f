"""Lines, postures and poses over the wire."""

import math

import pytest

from .test_wire import validate
from .wire import STOPPED

BENT = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0]


@pytest.fixture
def bent(stepped):
    """A robot in lockstep in a bent posture, the token of its lease, and the pose of its tool."""
    stepped.listen("state", "event")
    with stepped.control() as token:
        stepped.command("simulation.reset", token=token, q=BENT, seed=0)
        answer = stepped.command("forward_kinematics")
        assert answer["type"] == "tool_pose", answer
        yield stepped, token, answer["pose"]


def after(pose, x=0.0, y=0.0, z=0.0):
    """A pose shifted in the base frame."""
    return [pose[0] + x, pose[1] + y, pose[2] + z, *pose[3:]]


def played(wire, token, **command):
    """The events of a motion, and the states until its end."""
    begun = len(wire.received["event"]), len(wire.received["state"])
    answer = wire.command(token=token, **command)
    assert answer["type"] == "accepted", answer
    ended = ("motion_done", "motion_stopped")

    def events():
        return [event for event in wire.received["event"][begun[0] :] if event.get("id") == answer["id"]]

    while not any(event["kind"] in ended for event in events()):
        wire.step(token, 100)
    return events(), wire.received["state"][begun[1] :]


def pose_at(wire, q):
    answer = wire.command("forward_kinematics", q=q)
    validate(answer)
    return answer["pose"]


def test_a_line_is_straight_and_ends_at_its_pose(bent):
    wire, token, start = bent
    goal = after(start, 0.1, 0.1, -0.05)
    events, states = played(wire, token, type="move_l", pose=goal)
    assert [event["kind"] for event in events] == ["motion_started", "motion_done"]
    assert states[-1]["runtime_state"] == STOPPED
    assert pose_at(wire, states[-1]["target_q"]) == pytest.approx(goal, abs=1e-9)
    answer = wire.command("forward_kinematics", q=states[-1]["target_q"], frame=goal)
    assert answer["pose"] == pytest.approx([0.0] * 6, abs=1e-9)
    way = math.dist(goal[:3], start[:3])
    for state in states[::25]:
        at = pose_at(wire, state["target_q"])
        there, left = math.dist(at[:3], start[:3]), math.dist(at[:3], goal[:3])
        assert there + left == pytest.approx(way, abs=1e-5)
        assert at[3:] == pytest.approx(start[3:], abs=1e-5)


def test_kinematics_are_answered_without_control(stepped):
    pose = stepped.command("forward_kinematics", q=BENT)["pose"]
    answer = stepped.command("inverse_kinematics", pose=pose, near=BENT)
    validate(answer)
    assert answer["q"] == pytest.approx(BENT, abs=1e-9)
    refused = stepped.command("inverse_kinematics", pose=[2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert (refused["type"], refused["code"], refused["where"]) == ("refused", "no_solution", "pose")
