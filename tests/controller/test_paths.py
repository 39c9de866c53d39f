"""Lines, arcs and blends match an independent computation, shaped and unshaped."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.search.spaces import BENT, NO_TOOL, away, begun, pose_of, tool_pose
from tests.search.subject import Subject

from tvist_protocol import commands as c
from tvist_protocol.commands import MoveJ, Pause, Resume, SetPayload, Stop
from tvist_protocol.motions import JointSegment, LineSegment, MoveC, MoveL, MovePath, ProcessSegment
from tvist_protocol.replies import Accepted, Refused
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.transitions import Activity

from .robots import H


def went(robot: Subject, kind, **fields) -> np.ndarray:
    """Return the tool's positions in a motion, one per tick, shape (k, 3)."""
    reply = robot.send(kind, **fields)
    assert isinstance(reply, Accepted), reply
    begun_at = len(robot.references) - 1
    robot.until_rest()
    return np.array([tool_pose(q, NO_TOOL)[0] for q in robot.references[begun_at:]])


def speeds(positions) -> np.ndarray:
    return np.linalg.norm(np.diff(positions, axis=0), axis=1) / H


def test_move_l_uses_the_requested_velocity_acceleration_and_jerk():
    positions = went(begun(), MoveL, pose=away((0.1, 0.3, -0.1)), velocity=0.4, acceleration=1.5, jerk=50.0)
    s = np.concatenate([[0.0], np.cumsum(speeds(positions) * H)])
    derivatives = [np.abs(np.diff(s, order)).max() / H**order for order in (1, 2, 3)]
    assert derivatives == pytest.approx([0.4, 1.5, 50.0], rel=1e-3)
    length = np.linalg.norm([0.1, 0.3, -0.1])
    ideal = length / 0.4 + 0.4 / 1.5 + 1.5 / 50.0
    assert (len(positions) - 2) * H == pytest.approx(ideal, abs=4 * H)


@pytest.mark.parametrize(("kind", "duration"), [("line", 2.0), ("joints", 7.0), ("path", 0.8)])
def test_a_duration_replaces_velocity_and_acceleration(kind, duration):
    robot = begun()
    line = LineSegment(pose=away((0.05, 0.1, 0.05)), duration=0.6 * duration, blend=0.03, velocity=0.01)
    then = LineSegment(pose=away((0.1, 0.1, 0.05)), duration=0.4 * duration, velocity=0.01)
    positions = {
        "line": lambda: went(robot, MoveL, pose=away((0.1, 0.1, 0.05)), duration=duration, velocity=0.01),
        "joints": lambda: went(robot, c.MoveJ, q=tuple(BENT + 0.1), duration=duration, velocity=0.01),
        "path": lambda: went(robot, MovePath, segments=(line, then)),
    }[kind]()
    assert (len(positions) - 2) * H == pytest.approx(duration, abs=4 * H)


def test_process_segments_keep_their_speed_in_blends_unlike_lines():
    paths = {}
    for make in (ProcessSegment, LineSegment):
        corners = [(0.1, 0.0, 0.0), (0.1, 0.15, 0.0), (0.0, 0.15, 0.1)]
        segments = tuple(make(pose=away(corner), blend=0.03, velocity=0.2) for corner in corners)
        paths[make] = speeds(went(begun(), MovePath, segments=segments))
    away_from_ends = slice(120, -120)
    even = paths[ProcessSegment][away_from_ends]
    assert even.max() == pytest.approx(0.2, rel=2e-3)
    assert even.min() == pytest.approx(0.2, rel=2e-3)
    assert paths[LineSegment][away_from_ends].min() < 0.19


def test_the_second_of_two_overlapping_blends_is_skipped():
    corners = [(0.1, 0.0, 0.0), (0.1, 0.1, 0.0), (0.0, 0.1, 0.1)]
    segments = tuple(LineSegment(pose=away(corner), blend=0.06) for corner in corners)
    robot = begun()
    positions = went(robot, MovePath, segments=segments)
    warned = [event for event in robot.events if event.code == "blend_skipped"]
    assert [event.why.split(":")[0] for event in warned] == ["segments[1]"]
    assert warned[0].why.endswith("overlaps the blend beside it: give a smaller radius to one of them")
    assert warned[0].id == 1
    corner = tool_pose(BENT, NO_TOOL)[0] + np.array(corners[1])
    near = np.linalg.norm(positions - corner, axis=1)
    assert near.min() <= 1e-6
    assert speeds(positions)[np.argmin(near) - 1] < 1e-3


@pytest.mark.parametrize("way", ["joint to line", "line to joint"])
def test_joint_moves_blend_with_lines_inside_the_radius(way):
    joint = JointSegment(q=tuple(BENT + 0.3), blend=0.05)
    line = LineSegment(pose=away((0.1, 0.1, 0.1)), blend=0.05)
    segments = (joint, line) if way == "joint to line" else (line, joint)
    robot = begun()
    positions = went(robot, MovePath, segments=segments)
    corner = tool_pose(BENT + 0.3, NO_TOOL)[0]
    if way == "line to joint":
        corner = tool_pose(BENT, NO_TOOL)[0] + 0.1
    near = np.linalg.norm(positions - corner, axis=1).min()
    assert 1e-3 < near < 0.05
    assert speeds(positions)[50:-50].min() > 0.02
    hardest = np.abs(np.diff(robot.references, 2, axis=0)).max() / H**2
    assert hardest <= 2.0 * 4.0  # of joints on a joint part; a line may need more


def test_a_reversal_turns_inside_its_blend():
    segments = (LineSegment(pose=away((0.1, 0.0, 0.0)), blend=0.04), LineSegment(pose=away((0.0, 0.0, 0.0))))
    positions = went(begun(), MovePath, segments=segments) - tool_pose(BENT, NO_TOOL)[0]
    assert 0.06 < positions[:, 0].max() < 0.1
    assert np.abs(positions[:, 1:]).max() < 1e-6
    assert np.abs(positions[-1]).max() < 1e-6


def test_poses_can_be_given_in_a_frame():
    frame = (0.3, -0.2, 0.1, 0.4, 0.5, -0.6)
    inside = Rotation.from_rotvec(frame[3:])
    goals = [away((0.1, 0.1, 0.0)), away((0.0, 0.2, 0.0), (0.1, 0.2, 0.3))]
    seen = [
        pose_of(
            inside.inv().apply(np.array(goal[:3]) - frame[:3]), inside.inv() * Rotation.from_rotvec(goal[3:])
        )
        for goal in goals
    ]
    for plain, framed in (
        ((MoveL, {"pose": goals[1]}), (MoveL, {"pose": seen[1], "frame": frame})),
        (
            (MoveC, {"via": goals[0], "pose": goals[1]}),
            (MoveC, {"via": seen[0], "pose": seen[1], "frame": frame}),
        ),
    ):
        ends = [went(begun(), kind, **fields) for kind, fields in (plain, framed)]
        np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)


def test_a_path_out_of_joint_range_is_refused_with_joint_and_progress():
    near_the_end = BENT.copy()
    near_the_end[5] = 6.2
    reply = begun(near_the_end).send(MoveL, pose=away((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), q=near_the_end))
    turned = begun(near_the_end).send(MoveL, pose=away((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), q=near_the_end))
    refused = [one for one in (reply, turned) if isinstance(one, Refused)]
    assert [one.code for one in refused] == ["limit_position"]
    assert "wrist_3" in refused[0].why
    assert "% of the way" in refused[0].why


@pytest.mark.parametrize("again", [Pause, SimulationInject])
def test_a_pause_between_two_parts_lasts_until_resume(again):
    """The first part is about to end, so it does; the pause then holds the arm at the corner."""
    robot, corners = begun(shaper="zv"), ((0.1, 0.0, 0.0), (0.1, 0.1, 0.0))
    robot.send(MovePath, segments=tuple(LineSegment(pose=away(corner)) for corner in corners))
    cycle = robot.controller.cycle
    while cycle.trajectory.duration - cycle.trajectory.time > 0.02:
        robot.tick()
    robot.send(Pause)
    robot.tick(200)
    assert robot.controller.cycle.mode.at_rest
    assert robot.controller.motion.activity is Activity.PAUSED
    robot.send(again, **({"fault": "safeguard_stop"} if again is SimulationInject else {}))
    robot.tick(100)
    assert robot.controller.cycle.mode.at_rest
    robot.send(SimulationInject, fault="normal")
    robot.send(Resume)
    robot.until_rest()
    assert [event.kind for event in robot.events][-1] == "motion_done"


def test_a_payload_change_is_checked_on_the_remaining_parts():
    robot = begun(shaper="none")
    position = tool_pose(BENT, (0.0,) * 6)[0]
    low = (0.0, 0.0, 0.2 - position[2])
    reply = robot.send(
        MovePath, segments=(LineSegment(pose=away((0.05, 0.0, 0.0))), LineSegment(pose=away(low)))
    )
    assert isinstance(reply, Accepted), reply
    robot.tick(40)
    robot.send(Pause)
    robot.tick(300)
    long = {"mass": 1.0, "com": (0.0, 0.0, 0.4), "inertia": (0.01, 0.0, 0.0, 0.01, 0.0, 0.01)}
    assert robot.send(SetPayload, **long).code == "collision"


@pytest.mark.parametrize("kind", [MoveL, MoveJ])
def test_a_very_slow_motion_is_paused_at_once(kind):
    robot = begun(shaper="zv")
    target = {"pose": away((0.05, 0.1, 0.0))} if kind is MoveL else {"q": tuple(BENT + 0.2)}
    assert isinstance(robot.send(kind, duration=300.0, **target), Accepted)
    robot.tick(5000)
    robot.send(Pause)
    robot.tick(150)
    before = robot.references[-1]
    robot.tick(200)
    assert np.abs(robot.references[-1] - before).max() < 1e-9
    robot.send(Resume)
    robot.tick(500)
    assert np.abs(robot.references[-1] - before).max() > 1e-5
    robot.send(Stop)
    robot.tick(200)
    assert robot.controller.cycle.mode.at_rest
    assert [event.kind for event in robot.events if event.id is not None][-1] == "motion_stopped"
