"""What ROS 2 nodes see of a robot and how they move it, in lockstep."""

import asyncio
import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation
from tests.ros2.nodes import ACTION, JOINTS, duration, stepped_robot

from tvist_protocol import Pause, Resume, SetSpeed
from tvist_protocol.codec import encode
from tvist_ros2.action import (
    ABORTED,
    CANCELED,
    GOAL_TOLERANCE_VIOLATED,
    INVALID_GOAL,
    PATH_TOLERANCE_VIOLATED,
    SUCCEEDED,
    TERMINATED,
    UNKNOWN,
    UNKNOWN_GOAL,
)
from tvist_ros2.gateway import POSITIONS
from tvist_ros2.messages import ros, seconds

STILL = [0.0] * 6
QUIET = {"calibration": "none", "shaper": "none"}
TIGHT = [ros.JointTolerance("shoulder_pan_joint", 1e-9)]


@pytest.fixture
async def robot():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        yield robot


def there_and_back(q, time=1.0, joint=0, by=0.2):
    """Return two points: one joint turns, and turns back."""
    far = list(q)
    far[joint] += by
    return [(time, far, STILL), (2 * time, q, STILL)]


def flange_of(urdf, angles):
    """Return position and rotation of the last link in the first, along the joints of a URDF."""
    place, turn = np.zeros(3), Rotation.identity()
    for joint in urdf.findall("joint"):
        if (origin := joint.find("origin")) is not None:
            xyz, rpy = (np.array(origin.get(part).split(), dtype=float) for part in ("xyz", "rpy"))
            place, turn = place + turn.apply(xyz), turn * Rotation.from_euler("xyz", rpy)
        turn *= Rotation.from_rotvec([0.0, 0.0, angles.get(joint.get("name"), 0.0)])
    return place, turn


async def test_states_come_every_tick_with_the_clock_and_the_description_once():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(200)
        published = robot.node.published
        stamps = [seconds(message.header.stamp) for message in published["joint_states"]]
        assert stamps == pytest.approx([0.002 * tick for tick in range(201)])
        assert [seconds(message.clock) for message in published["/clock"]] == stamps
        state, last = robot.host.controller.report.state, {name: all_[-1] for name, all_ in published.items()}
        assert last["joint_states"].name == JOINTS
        assert last["joint_states"].position == state.actual_q
        assert last["joint_states"].effort == state.actual_moment
        pose = last["tcp_pose_broadcaster/pose"].pose
        assert [pose.position.x, pose.position.y, pose.position.z] == state.actual_TCP_pose[:3]
        turned = [getattr(pose.orientation, axis) for axis in "xyzw"]
        assert turned == pytest.approx(Rotation.from_rotvec(state.actual_TCP_pose[3:]).as_quat())
        felt = last["imu_sensor_broadcaster/imu"].linear_acceleration
        assert np.linalg.norm([felt.x, felt.y, felt.z]) == pytest.approx(9.81, abs=0.5)
        (described,) = published["robot_description"]
        assert robot.node.qos["robot_description"].latched
        urdf = ET.fromstring(described.data)  # noqa: S314  it is ours
        place, turn = flange_of(urdf, dict(zip(JOINTS, state.actual_q, strict=True)))
        assert place == pytest.approx(state.actual_TCP_pose[:3], abs=1e-9)
        assert (turn.inv() * Rotation.from_rotvec(state.actual_TCP_pose[3:])).magnitude() < 1e-9
        shapes = [shape.tag for shape in urdf.findall(".//collision/geometry/*")]
        assert shapes == ["cylinder"] * 7


async def test_rate_reduces_states_but_not_the_clock():
    async with stepped_robot(rate=50.0, **QUIET) as robot:
        await robot.step(200)
        assert len(robot.node.published["joint_states"]) == 21
        assert len(robot.node.published["/clock"]) == 201


async def test_dashboard_switches_power_and_says_why_it_cannot(robot):
    for name, mode in (("power_off", 3), ("power_on", 5), ("brake_release", 7)):
        assert (await robot.trigger(name)).success
        await robot.step(10)
        assert robot.host.controller.report.state.robot_mode == mode
    assert (await robot.trigger("stop")).success
    refused = await robot.trigger("pause")
    assert not refused.success
    assert "no program" in refused.message


async def test_arm_follows_position_commands_and_gives_control_back_at_rest(robot):
    target = robot.q
    for _ in range(50):
        target[0] += 0.004
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=target))
        await robot.step(10)
    assert robot.host.controller.session.lease.client == "ros2"
    await robot.step(500)
    assert robot.q == pytest.approx(target, abs=1e-6)
    assert robot.host.controller.session.lease is None
    for q, why in (([9.0] * 6, "9"), ([0.0], "q has 1 "), ([], "q has 0 ")):
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=q))
        await robot.step(20)
        assert why in robot.said[-1]
    assert len(robot.said) == 3


@pytest.mark.parametrize("goals", [4, pytest.param(20, marks=pytest.mark.nightly)])
async def test_goals_are_reached_with_feedback_of_both_types(robot, goals):
    """Every goal has the joints in another order, and every other one has no velocities."""
    rng = np.random.default_rng(0)
    start = np.array(robot.q)
    for number in range(goals):
        order = rng.permutation(6)
        target = start + rng.uniform(-0.05, 0.05, 6)
        qd = [STILL] if number % 2 else [[]]
        points = [(0.6, target[order], *qd)]
        uuid, accepted = await robot.send_goal(points, [JOINTS[place] for place in order])
        assert accepted
        ended = await robot.until(robot.result(uuid))
        assert (ended.status, ended.result.error_code) == (SUCCEEDED, 0)
        assert robot.q == pytest.approx(target, abs=1e-6)
    told = robot.node.published[f"{ACTION}/feedback"]
    newer = [one for one in told if hasattr(one.feedback, "index")]
    older = [one for one in told if not hasattr(one.feedback, "index")]
    assert len(newer) == len(older) >= goals * 12
    one = newer[-1].feedback
    assert one.error.positions == pytest.approx(np.subtract(one.desired.positions, one.actual.positions))
    assert robot.node.published[f"{ACTION}/status"][-1].status_list[-1].status == SUCCEEDED


async def test_cancelled_goal_stops_on_its_path_and_the_next_is_accepted(robot):
    start = robot.q
    uuid, _ = await robot.send_goal(there_and_back(start))
    await robot.step(200)
    assert (await robot.cancel(uuid)).goals_canceling[0].goal_id == uuid
    ended = await robot.until(robot.result(uuid))
    assert ended.status == CANCELED
    assert start[0] < robot.q[0] < start[0] + 0.2
    assert robot.q[1:] == pytest.approx(start[1:], abs=1e-9)
    _, accepted = await robot.send_goal([(1.0, start, STILL)])
    assert accepted
    assert (await robot.cancel(uuid)).return_code == TERMINATED
    assert (await robot.cancel(ros.UUID(b"x" * 16))).return_code == UNKNOWN_GOAL
    assert not (await robot.cancel(ros.UUID(), ros.Time(0, 1))).goals_canceling
    assert (await robot.cancel(ros.UUID(b"x" * 16), robot.now)).goals_canceling


async def test_rejected_goal_changes_nothing_and_its_reason_is_logged(robot):
    q = robot.q
    cases = [
        ([(1.0, q, STILL)], [*JOINTS[:5], "elbow"], "must be shoulder_pan_joint"),
        ([(1.0, q[:5], STILL)], JOINTS, r"points[0].positions has 5 numbers: must have 6"),
        ([], JOINTS, "has no points"),
        (there_and_back(q, time=0.1, by=2.0), JOINTS, "points[0]"),
        ([(1.0, q, STILL), (0.5, q, STILL)], JOINTS, "points[1]"),
    ]
    for points, names, why in cases:
        uuid, accepted = await robot.send_goal(points, names)
        assert not accepted
        assert (await robot.until(robot.result(uuid))).status == UNKNOWN
        assert why in robot.said[-1]
    assert robot.q == q
    assert robot.host.controller.session.lease is None
    moving, accepted = await robot.send_goal(there_and_back(q))
    assert accepted
    for _ in range(40):
        assert not (await robot.send_goal([]))[1]
    assert (await robot.until(robot.result(moving))).status == SUCCEEDED


async def test_newest_trajectory_replaces_the_one_before(robot):
    start = robot.q
    first, _ = await robot.send_goal(there_and_back(start))
    await robot.step(100)
    second, accepted = await robot.send_goal(there_and_back(start, time=1.5))
    assert accepted
    replaced = await robot.until(robot.result(first))
    assert (replaced.status, replaced.result.error_code) == (ABORTED, INVALID_GOAL)
    assert "newer" in replaced.result.error_string
    for place in range(1, 6):  # as a slider in a program sends them
        robot.move([(0.5, [start[0] + 0.02 * place, *start[1:]], [])])
        await robot.step(40)
    assert (await robot.until(robot.result(second))).status == ABORTED
    await robot.step(500)
    assert robot.q == pytest.approx([start[0] + 0.1, *start[1:]], abs=1e-6)
    assert robot.host.controller.session.lease is None


async def test_goal_waits_for_its_tolerance_until_it_is_cancelled_or_replaced(robot):
    """Without a tolerance of time there is no end, as with ROS 2's controller."""
    tight = {"goal_tolerance": TIGHT}
    for status in (CANCELED, ABORTED):
        uuid, _ = await robot.send_goal(there_and_back(robot.q)[:1], **tight)
        result = robot.result(uuid)
        await robot.step(1000)
        assert robot.host.controller.session.lease is None
        assert not result.done()
        if status == CANCELED:
            await robot.cancel(uuid)
        else:
            robot.move(there_and_back(robot.q))
        assert (await robot.until(result)).status == status


async def test_feedback_tells_the_time_of_the_trajectory(robot):
    """Not the clock's, which passes more quickly at half the speed, and in a pause."""
    q = robot.q
    points = [(1.0, [q[0] + 0.2, *q[1:]], STILL), (2.0, [q[0] + 0.3, *q[1:]], STILL)]
    uuid, _ = await robot.send_goal(points)
    token = robot.host.controller.session.lease.token
    await robot.step(100)
    for command in (SetSpeed(token=token, fraction=0.5), Pause(token=token), Resume(token=token)):
        robot.host.request("slow", encode(command))
        await robot.step(500)
    assert (await robot.until(robot.result(uuid))).status == SUCCEEDED
    told = [one.feedback for one in robot.node.published[f"{ACTION}/feedback"]]
    told = [one for one in told if hasattr(one, "index")]
    times = np.array([seconds(one.desired.time_from_start) for one in told])
    turned = np.array([one.desired.positions[0] for one in told]) - q[0]
    planned = CubicHermiteSpline([0.0, 1.0, 2.0], [0.0, 0.2, 0.3], [0.0, 0.0, 0.0])
    assert turned == pytest.approx(planned(times), abs=0.01)
    assert times[-1] == pytest.approx(2.0, abs=0.1)
    assert [one.index for one in told] == [min(int(time), 1) for time in times]


@pytest.mark.parametrize(("stamp", "ticks"), [(0.0, 500), (0.2, 400), (0.6, 600)])
async def test_trajectory_starts_at_its_stamp(robot, stamp, ticks):
    await robot.step(190)  # 0.4 s after the start
    goal = [robot.q[0] + 0.05, *robot.q[1:]]
    robot.move([(0.1, robot.q, STILL), (1.0, goal, STILL)], stamp=stamp)
    await robot.step(ticks - 40)
    assert robot.q != pytest.approx(goal, abs=1e-6)
    await robot.step(60)
    assert robot.q == pytest.approx(goal, abs=1e-6)
    robot.move([(0.1, goal, STILL)], stamp=0.1)
    await robot.step(1)
    assert "has ended" in robot.said[-1]


async def stream(robot, targets):
    """Send one position command each 20 ms."""
    for target in targets:
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=target))
        await robot.step(10)


def steps(q, first, last):
    """Return postures in which the first joint turns by 0.2 rad/s."""
    return [[q[0] + 0.004 * number, *q[1:]] for number in range(first, last)]


async def test_refused_position_command_leaves_the_one_before(robot):
    q = robot.q
    await stream(robot, steps(q, 1, 20))
    await stream(robot, [[math.nan, *q[1:]]])
    assert robot.host.controller.session.lease.client == "ros2"
    await robot.step(500)
    assert robot.q == pytest.approx(steps(q, 19, 20)[0], abs=1e-6)
    (said,) = robot.said
    assert "q[0] is NaN" in said


async def test_stopped_position_commands_are_followed_again_once_they_have_paused(robot):
    q = robot.q
    await stream(robot, steps(q, 1, 20))
    assert (await robot.trigger("stop")).success
    await robot.step(50)
    stopped = robot.q
    await stream(robot, steps(q, 20, 40))
    assert robot.q == stopped
    (said,) = robot.said
    assert "a stop was commanded" in said
    await robot.step(500)
    await stream(robot, steps(stopped, 1, 2))
    await robot.step(500)
    assert robot.q == pytest.approx(steps(stopped, 1, 2)[0], abs=1e-6)


async def test_a_stop_between_position_commands_counts_too(robot):
    q = robot.q
    await stream(robot, steps(q, 1, 2))
    await robot.step(200)
    assert (await robot.trigger("stop")).success
    stopped = robot.q
    await stream(robot, steps(q, 20, 40))
    assert robot.q == stopped


async def test_stop_also_drops_a_trajectory_that_waits(robot):
    await robot.send_goal(there_and_back(robot.q))
    await robot.step(100)
    robot.move(there_and_back(robot.q))
    await robot.settle()
    assert (await robot.trigger("stop")).success
    await robot.step(100)
    stopped = robot.q
    await robot.step(500)
    assert robot.q == stopped
    assert "it was stopped" in robot.said[-1]


async def test_tolerance_is_judged_at_its_tick_even_if_states_come_late(robot):
    uuid, _ = await robot.send_goal(there_and_back(robot.q), path_tolerance=TIGHT)
    await robot.stepper.step(2000)
    ended = await robot.until(robot.result(uuid))
    assert (ended.status, ended.result.error_code) == (ABORTED, PATH_TOLERANCE_VIOLATED)


async def test_program_plays_to_its_end_and_can_be_paused(robot):
    q = robot.q
    async with robot.other.control("other") as arm:
        await arm.load_program("turn", f"movej([{q[0] + 0.2}, {', '.join(map(str, q[1:]))}])")
    assert (await robot.trigger("play")).success
    await robot.step(100)
    assert (await robot.trigger("pause")).success
    await robot.step(200)
    paused = robot.q
    await robot.step(200)
    assert robot.q == paused
    assert (await robot.trigger("play")).success
    await robot.step(1000)
    assert robot.q[0] == pytest.approx(q[0] + 0.2, abs=1e-6)
    assert robot.host.controller.session.lease is None


async def test_position_command_during_a_trajectory_is_refused(robot):
    q = robot.q
    for delay in (0, 100):  # while the trajectory starts, and later
        robot.move(there_and_back(q, time=0.5))
        await asyncio.sleep(0)
        await robot.step(delay)
        await stream(robot, steps(q, 9, 10))
        await robot.step(700)
        assert robot.q == pytest.approx(q, abs=1e-6)
        assert "a position command was refused" in robot.said[-1]
        _, accepted = await robot.send_goal(there_and_back(q, time=0.5))
        assert accepted
        await robot.step(700)


async def test_gateway_that_ends_aborts_its_goal():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        uuid, _ = await robot.send_goal(there_and_back(robot.q))
        result = robot.result(uuid)
        await robot.step(100)
    assert (await result).status == ABORTED


async def test_warnings_in_turn_are_given_once_each(robot):
    for number in range(10):
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=[0.0] * (number % 2)))
        await robot.settle()
    assert len(robot.said) == 2


async def test_tolerances_and_stops_abort_a_goal(robot):
    for more, code in (
        ({"path_tolerance": TIGHT}, PATH_TOLERANCE_VIOLATED),
        ({"goal_tolerance": TIGHT, "goal_time_tolerance": duration(0.1)}, GOAL_TOLERANCE_VIOLATED),
    ):
        uuid, accepted = await robot.send_goal(there_and_back(robot.q), **more)
        assert accepted
        ended = await robot.until(robot.result(uuid))
        assert (ended.status, ended.result.error_code) == (ABORTED, code)
        assert "shoulder_pan_joint deviates" in ended.result.error_string
        await robot.step(100)
    uuid, _ = await robot.send_goal(there_and_back(robot.q))
    await robot.step(100)
    await robot.trigger("stop")
    ended = await robot.until(robot.result(uuid))
    assert ended.status == ABORTED
    assert "stopped" in ended.result.error_string


async def vibration(shaper):
    """Return the largest deviation of the tool's acceleration from rest after a goal [m/s²]."""
    async with stepped_robot(shaper=shaper) as robot:
        await robot.step(10)
        points = there_and_back(robot.q, time=0.7, by=0.5)[:1]
        uuid, accepted = await robot.send_goal(points)
        assert accepted
        assert (await robot.until(robot.result(uuid))).status == SUCCEEDED
        first = len(robot.node.published["imu_sensor_broadcaster/imu"])
        await robot.step(600)
        felt = [one.linear_acceleration for one in robot.node.published["imu_sensor_broadcaster/imu"][first:]]
        values = np.array([[one.x, one.y, one.z] for one in felt])
        return np.std(values[:250] - values[-250:].mean(axis=0))


async def test_imu_shows_the_vibration_and_its_reduction():
    assert await vibration("zv") < 0.5 * await vibration("none")
