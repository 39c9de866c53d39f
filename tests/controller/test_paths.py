"""Motions in space: lines, arcs and blends where an independent computation has them, shaped as unshaped."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.plant.arms import chain
from tests.search.draws import SHAPERS
from tests.search.subject import Subject

from tvist_controller.kinematics.arm import Arm
from tvist_controller.setup import paper_payload
from tvist_protocol import commands as c
from tvist_protocol.io import SetTcp
from tvist_protocol.motions import (
    ArcSegment,
    JointSegment,
    LineSegment,
    MoveC,
    MoveL,
    MovePath,
    ProcessSegment,
)
from tvist_protocol.replies import Accepted, Refused

from .paths import journey
from .robots import Q1, UR5E, H
from .spaces import BENT, NO_TOOL, TOOL, away, begun, errors, pose_of, tool_pose


@pytest.mark.parametrize(
    "seed",  # 581 creeps to its end
    [*range(22), 581, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(22, 120))],
)
def test_a_random_path_is_where_it_should_be_with_every_shaper(seed):
    trip = journey([seed, 31], [SHAPERS[seed % len(SHAPERS)]])
    robot = trip.begin()
    robot.until_rest(500_000)
    robot.tick(20)
    q = np.array(robot.references)
    off, turned = errors(q[:: max(len(q) // 400, 1)], trip.legs)
    assert off <= 5e-5
    assert turned <= 1e-4
    for order, limit in ((1, UR5E.limits.velocity), (2, UR5E.limits.acceleration)):
        assert np.abs(np.diff(q, order, axis=0)).max() / H**order <= min(limit)
    position, rotation = tool_pose(q[-1])
    end, turned_end = trip.legs[-1].end
    assert np.linalg.norm(position - end) <= 1e-6
    assert (rotation * turned_end.inv()).magnitude() <= 1e-6
    kinds = [event.kind for event in robot.events if event.kind.startswith("motion")]
    assert kinds == ["motion_started", "motion_done"]


def went(robot: Subject, kind, **fields) -> np.ndarray:
    """The tool's positions in a motion, one for each tick, shape (k, 3)."""
    reply = robot.send(kind, **fields)
    assert isinstance(reply, Accepted), reply
    begun_at = len(robot.references) - 1
    robot.until_rest()
    return np.array([tool_pose(q, NO_TOOL)[0] for q in robot.references[begun_at:]])


def speeds(positions) -> np.ndarray:
    return np.linalg.norm(np.diff(positions, axis=0), axis=1) / H


def test_velocity_acceleration_and_jerk_are_those_of_the_tools_trapezoid():
    positions = went(begun(), MoveL, pose=away((0.1, 0.3, -0.1)), velocity=0.4, acceleration=1.5, jerk=50.0)
    s = np.concatenate([[0.0], np.cumsum(speeds(positions) * H)])
    derivatives = [np.abs(np.diff(s, order)).max() / H**order for order in (1, 2, 3)]
    assert derivatives == pytest.approx([0.4, 1.5, 50.0], rel=1e-3)
    length = np.linalg.norm([0.1, 0.3, -0.1])
    ideal = length / 0.4 + 0.4 / 1.5 + 1.5 / 50.0
    assert (len(positions) - 2) * H == pytest.approx(ideal, abs=4 * H)


@pytest.mark.parametrize("duration", [0.8, 2.0, 7.0])
@pytest.mark.parametrize("kind", ["line", "joints", "path"])
def test_a_duration_wins_over_velocity_and_acceleration(kind, duration):
    robot = begun()
    line = LineSegment(pose=away((0.05, 0.1, 0.05)), duration=0.6 * duration, blend=0.03, velocity=0.01)
    then = LineSegment(pose=away((0.1, 0.1, 0.05)), duration=0.4 * duration, velocity=0.01)
    positions = {
        "line": lambda: went(robot, MoveL, pose=away((0.1, 0.1, 0.05)), duration=duration, velocity=0.01),
        "joints": lambda: went(robot, c.MoveJ, q=tuple(BENT + 0.1), duration=duration, velocity=0.01),
        "path": lambda: went(robot, MovePath, segments=(line, then)),
    }[kind]()
    assert (len(positions) - 2) * H == pytest.approx(duration, abs=4 * H)


@pytest.mark.parametrize(
    "fields", [{"kind": MoveL, "pose": away((0.1, 0.3, -0.1))}, {"kind": c.MoveJ, "q": Q1}]
)
def test_a_duration_that_is_too_short_takes_longer_within_the_limits(fields):
    robot, kind = begun(), fields["kind"]
    target = {name: tuple(value) for name, value in fields.items() if name != "kind"}
    went(robot, kind, duration=0.01, **target)
    q = np.array(robot.references)
    assert len(q) * H > 0.2
    assert np.abs(np.diff(q, axis=0)).max() / H > 0.5 * min(UR5E.limits.velocity)
    assert np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= min(UR5E.limits.acceleration) * 1.0001


def test_joint_limits_slow_a_line_down_and_do_not_refuse_it():
    positions = went(begun(), MoveL, pose=away((0.1, 0.3, -0.1)), velocity=30.0, acceleration=300.0, jerk=1e5)
    assert 0.5 < speeds(positions).max() < 3.0


def test_a_process_keeps_its_speed_in_blends_and_a_line_slows_down_there():
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


def test_the_second_of_two_blends_that_overlap_is_skipped_and_the_arm_stops_there():
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


def test_blends_of_which_two_just_fit_are_both_made():
    corners = [(0.2, 0.0, 0.0), (0.2, 0.2, 0.0), (0.0, 0.2, 0.0)]
    robot = begun(BENT + np.array([0.0, 0.2, 0.2, 0.0, 0.0, 0.0]))
    start = robot.references[0]
    segments = tuple(LineSegment(pose=away(corner, q=start), blend=0.1) for corner in corners)
    positions = went(robot, MovePath, segments=segments)
    assert [event.code for event in robot.events if event.code == "blend_skipped"] == []
    assert speeds(positions)[100:-100].min() > 0.1


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
    q = np.array(robot.references)
    assert (
        np.abs(np.diff(q, 2, axis=0)).max() / H**2 <= 2.0 * 4.0
    )  # of joints on a joint part; a line may need more


def test_a_path_that_goes_back_as_it_came_turns_inside_its_blend():
    segments = (
        LineSegment(pose=away((0.1, 0.0, 0.0)), blend=0.04),
        LineSegment(pose=away((0.0, 0.0, 0.0))),
    )
    positions = went(begun(), MovePath, segments=segments) - tool_pose(BENT, NO_TOOL)[0]
    assert 0.06 < positions[:, 0].max() < 0.1
    assert np.abs(positions[:, 1:]).max() < 1e-6
    assert np.abs(positions[-1]).max() < 1e-6


def test_poses_are_given_in_a_frame():
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


def test_a_line_is_that_of_the_tool_centre_point():
    robot = begun(tcp=TOOL)
    goal = away((0.05, 0.2, 0.0), (0.5, 0.2, -0.3), tcp=TOOL)
    assert isinstance(robot.send(MoveL, pose=goal), Accepted)
    robot.until_rest()
    start, end = tool_pose(BENT)[0], np.array(goal[:3])
    along = (end - start) / np.linalg.norm(end - start)
    for q in robot.references[::20]:
        moved = tool_pose(q)[0] - start
        assert np.linalg.norm(moved - (moved @ along) * along) < 1e-6


def test_a_target_where_the_tool_is_ends_at_once():
    robot = begun()
    went(robot, MoveL, pose=away((0.0, 0.0, 0.0)))
    assert [event.kind for event in robot.events][-2:] == ["motion_started", "motion_done"]
    went(robot, MovePath, segments=(LineSegment(pose=away((0.0, 0.0, 0.0)), blend=0.1),) * 3)


@pytest.mark.parametrize(
    ("kind", "fields", "code", "where", "said"),
    [
        (MoveL, {"pose": away((5.0, 0.0, 0.0))}, "no_solution", "pose", "no joint positions"),
        (MoveL, {"pose": away((0.7, 0.2, 0.2))}, "singular", "pose", "% of the way"),
        (MoveL, {"pose": away((0.0, 0.0, -0.6))}, "collision", "pose", "% of the way"),
        (
            MoveC,
            {"via": away((0.1, 0.0, 0.0)), "pose": away((0.2, 0.0, 0.0))},
            "out_of_range",
            "via",
            "on a line",
        ),
        (
            MoveC,
            {"via": away((0.1, 0.0, 0.0)), "pose": away((0.0, 0.0, 0.0))},
            "out_of_range",
            "via",
            "the same",
        ),
        (
            MovePath,
            {"segments": (LineSegment(pose=away((0.1, 0.0, 0.0))), LineSegment(pose=away((9.0, 0.0, 0.0))))},
            "no_solution",
            "segments[1].pose",
            "no joint positions",
        ),
        (MovePath, {"segments": (JointSegment(q=(0.0,) * 5),)}, "out_of_range", "segments[0].q", "5 angles"),
        (
            MovePath,
            {"segments": (JointSegment(q=(9.0,) * 6),)},
            "limit_position",
            "segments[0].q[0]",
            "9 rad",
        ),
        (
            MovePath,
            {
                "segments": (
                    ArcSegment(via=away((0.1, 0.0, 0.0)), pose=away((0.1, 0.1, 0.0)), acceleration=1e-3),
                )
            },
            "out_of_range",
            "segments[0].acceleration",
            "at least",
        ),
        (MoveL, {"pose": away((0.1, 0.0, 0.0)), "velocity": 1e-5}, "out_of_range", "velocity", "at least"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_place_and_nothing_moves(kind, fields, code, where, said):
    robot = begun()
    reply = robot.send(kind, **fields)
    assert isinstance(reply, Refused), reply
    assert (reply.code, reply.where) == (code, where)
    assert said in reply.why
    robot.tick(10)
    assert (np.array(robot.references) == BENT).all()


def test_from_a_singular_posture_no_line_leads_on():
    reply = begun(Q1).send(MoveL, pose=away((-0.1, 0.0, 0.0), q=Q1))
    assert reply.code == "singular"
    assert "move_j" in reply.why


def test_a_joint_that_would_leave_its_range_is_named_with_the_share_of_the_way():
    near_the_end = BENT.copy()
    near_the_end[5] = 6.2
    reply = begun(near_the_end).send(MoveL, pose=away((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), q=near_the_end))
    turned = begun(near_the_end).send(MoveL, pose=away((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), q=near_the_end))
    refused = [one for one in (reply, turned) if isinstance(one, Refused)]
    assert [one.code for one in refused] == ["limit_position"]
    assert "wrist_3" in refused[0].why
    assert "% of the way" in refused[0].why


def test_a_change_of_the_tool_is_part_of_the_plan():
    """A plan made before `set_tcp` was carried out does not hold after it."""
    robot = begun()
    controller = robot.controller
    line = MoveL(token=robot.token, pose=away((0.05, 0.05, 0.0), tcp=TOOL))
    stale = controller.plans.now(line)
    assert controller.plans.hold(stale)
    robot.send(SetTcp, offset=TOOL)
    assert not controller.plans.hold(stale)
    assert controller.plans.found(line, stale) is not stale.found, "it is made again"


@pytest.mark.parametrize("radius", [1e-9, 1e-6, 1e-4])
def test_a_blend_too_small_to_be_worthwhile_is_a_stop(radius):
    robot = begun()
    segments = (
        LineSegment(pose=away((0.1, 0.0, 0.0)), blend=radius),
        LineSegment(pose=away((0.1, 0.1, 0.0))),
    )
    positions = went(robot, MovePath, segments=segments)
    assert [event.code for event in robot.events if event.kind == "warning"][-1] == "blend_skipped"
    assert len(positions) * H < 2.0


@pytest.mark.parametrize("rest", [1e-10, 1e-8, 1e-6, 1e-4])
def test_a_sliver_between_two_blends_slows_nothing_down(rest):
    corners = [(0.1, 0.0, 0.0), (0.1, 0.1, 0.0), (0.0, 0.1, 0.0)]
    blends = (0.05, 0.05 - rest, 0.0)
    segments = tuple(
        LineSegment(pose=away(to), blend=blend) for to, blend in zip(corners, blends, strict=True)
    )
    positions = went(begun(), MovePath, segments=segments)
    assert speeds(positions)[100:-100].min() > 0.1


@pytest.mark.parametrize("duration", [1e-300, 3600.0])
def test_any_duration_is_planned_within_a_moment(duration):
    """Planning looks at the places where limits may bind, whose number does not grow with the duration."""
    robot = begun()
    segments = (
        LineSegment(pose=away((0.1, 0.0, 0.0)), duration=duration),
        JointSegment(q=tuple(BENT), duration=duration),
    )
    assert isinstance(robot.send(MovePath, segments=segments), Accepted)
    assert isinstance(begun().send(MoveL, pose=away((0.1, 0.0, 0.0)), duration=duration), Accepted)
    law = robot.controller.cycle.trajectory.law
    assert len(law.moments) < 5000


def test_a_redundant_arm_makes_blends_too():
    description = chain(7)
    q = np.linspace(0.5, 1.2, 7) * np.where(np.arange(7) % 2, 1.0, -1.0)
    robot = Subject(description, q, paper_payload(description, 0.0), shaper="none")
    tool = Arm(description)
    rotation, position = tool.pose(q)
    targets = [
        position + np.array(moved) for moved in ((0.03, 0.0, 0.0), (0.03, 0.03, 0.0), (0.0, 0.03, 0.03))
    ]
    segments = tuple(
        LineSegment(pose=pose_of(to, Rotation.from_matrix(rotation)), blend=0.01, velocity=0.1)
        for to in targets
    )
    reply = robot.send(MovePath, segments=segments)
    assert isinstance(reply, Accepted), reply
    robot.until_rest()
    steps = np.abs(np.diff(robot.references, 2, axis=0)).max() / H**2
    assert steps <= min(description.limits.acceleration)
    assert np.linalg.norm(tool.pose(robot.references[-1])[1] - targets[-1]) < 1e-6
