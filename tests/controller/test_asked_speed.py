"""A speed or a duration that was asked for and is not reached is told with both numbers, and only if a limit is why."""

import pytest
from tests.controller.scripts import a_robot, run

UP = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, -{way}, 0, 0, 0]), {how})"
TWIST = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0, 0, 0, 2]), a=5, v=1)"
TURN = "movej([-1.6, -1.727, -2.203, -0.808, 1.595, {to}], {how})"
ARC = (
    "movec(pose_trans(get_target_tcp_pose(), p[0.05, 0, 0.05, 0, 0, 0]), "
    "pose_trans(get_target_tcp_pose(), p[0.1, 0, 0, 0, 0, 0]), {how})"
)


def warned(line, **changes):
    robot = run(a_robot(**changes), line)
    return [(event.code, event.why) for event in robot.events if event.kind == "warning"]


@pytest.mark.parametrize(
    "line",
    [
        UP.format(way=0.15, how="a=1.2, v=0.25"),
        UP.format(way=0.055, how="a=1.2, v=0.25"),  # just long enough
        UP.format(way=0.03, how="a=1.2, v=0.25"),  # a triangle
        UP.format(way=0.03, how="a=1.2, v=1"),
        UP.format(way=0.005, how="a=3, v=1"),
        UP.format(way=0.1, how="t=1"),
        ARC.format(how="a=1.2, v=0.25"),
        TURN.format(to=0.5, how="a=1.4, v=1.05"),
        TURN.format(to=0.2, how="a=2, v=3"),
        TURN.format(to=0.2, how="t=0.5"),
        TURN.format(to=0.2, how="v=9, t=0.5"),  # the speed does not count
    ],
)
def test_what_is_reached_or_ends_too_soon_is_not_told(line):
    assert warned(line) == []


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        (UP.format(way=0.15, how="a=30, v=9"), "limit_acceleration", ["velocity is 0.", "of 9 m/s", "jerk"]),
        (UP.format(way=0.02, how="a=30, v=9"), "limit_acceleration", ["velocity is 0.", "of 9 m/s", "jerk"]),
        (UP.format(way=0.3, how="a=30, v=2"), "limit_acceleration", ["velocity is 0.", "of 2 m/s", "jerk"]),
        (TWIST, "limit_velocity", ["of 1 m/s", "joint wrist_3", "3.142 rad/s"]),
        (UP.format(way=0.1, how="t=0.05"), "limit_acceleration", ["duration is 0.", "instead of 0.05"]),
        (ARC.format(how="a=30, v=2"), "limit_acceleration", ["velocity is 0.", "of 2 m/s"]),
        (TURN.format(to=0.5, how="a=40, v=3"), "limit_acceleration", ["of 3 rad/s", "jerk", "100 rad/s³"]),
        (TURN.format(to=2.5, how="a=40, v=9"), "limit_velocity", ["v of movej is 9 rad/s", "at most 3.142"]),
        (TURN.format(to=0.5, how="t=0.1"), "limit_acceleration", ["duration is 0.", "instead of 0.1"]),
    ],
)
def test_what_a_limit_lowers_is_told_with_both_numbers(line, code, words):
    ((found, why),) = warned(line)
    assert found == code
    assert all(word in why for word in words), why
