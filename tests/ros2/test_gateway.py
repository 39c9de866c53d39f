"""What ROS 2 nodes see of a robot and how they move it, in lockstep."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.ros2.nodes import ACTION, JOINTS, duration, stepped_robot

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


def there_and_back(q, time=1.0, joint=0, by=0.2):
    """Return two points: one joint turns, and turns back."""
    far = list(q)
    far[joint] += by
    return [(time, far, STILL), (2 * time, q, STILL)]


def flange_of(urdf, angles):
    """Return position and rotation of the last link in the first, along the joints of a URDF."""
    place, turn = np.zeros(3), Rotation.identity()
    for joint in ET.fromstring(urdf).findall("joint"):  # noqa: S314  it is ours
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
        place, turn = flange_of(described.data, dict(zip(JOINTS, state.actual_q, strict=True)))
        assert place == pytest.approx(state.actual_TCP_pose[:3], abs=1e-9)
        assert (turn.inv() * Rotation.from_rotvec(state.actual_TCP_pose[3:])).magnitude() < 1e-9
        shapes = [shape.tag for shape in ET.fromstring(described.data).findall(".//collision/geometry/*")]  # noqa: S314  it is ours
        assert shapes == ["cylinder"] * 7


async def test_rate_reduces_states_but_not_the_clock():
    async with stepped_robot(rate=50.0, **QUIET) as robot:
        await robot.step(200)
        assert len(robot.node.published["joint_states"]) == 21
        assert len(robot.node.published["/clock"]) == 201


async def test_dashboard_switches_power_and_says_why_it_cannot():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        for name, mode in (("power_off", 3), ("power_on", 5), ("brake_release", 7)):
            assert (await robot.trigger(name)).success
            await robot.step(10)
            assert robot.host.controller.report.state.robot_mode == mode
        assert (await robot.trigger("stop")).success
        refused = await robot.trigger("pause")
        assert not refused.success
        assert "no program" in refused.message


async def test_arm_follows_position_commands_and_gives_control_back_at_rest():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        target = robot.q
        for _ in range(50):
            target[0] += 0.004
            robot.node.send(POSITIONS, ros.Float64MultiArray(data=target))
            await robot.step(10)
        assert robot.host.controller.session.lease.client == "ros2"
        await robot.step(500)
        assert robot.q == pytest.approx(target, abs=1e-6)
        assert robot.host.controller.session.lease is None
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=[9.0] * 6))
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=[0.0]))
        await robot.step(20)
        wrong, refused = (message.msg for message in robot.node.published["/rosout"])
        assert "has 1 numbers: must have 6" in wrong
        assert "limit_position" in refused or "9" in refused


@pytest.mark.parametrize("goals", [4, pytest.param(20, marks=pytest.mark.nightly)])
async def test_goals_are_reached_with_feedback_of_both_types(goals):
    """Every goal has the joints in another order, and every other one has no velocities."""
    rng = np.random.default_rng(0)
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
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


async def test_cancelled_goal_stops_on_its_path_and_the_next_is_accepted():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
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
        assert len((await robot.cancel(ros.UUID())).goals_canceling) == 1


async def test_rejected_goal_changes_nothing_and_its_reason_is_logged():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
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
            assert why in robot.node.published["/rosout"][-1].msg
        assert robot.q == q
        assert robot.host.controller.session.lease is None
        moving, accepted = await robot.send_goal(there_and_back(q))
        assert accepted
        for _ in range(40):
            assert not (await robot.send_goal([]))[1]
        assert (await robot.until(robot.result(moving))).status == SUCCEEDED


async def test_newest_trajectory_replaces_the_one_before():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
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


async def test_goal_waits_for_its_tolerance_until_it_is_cancelled_or_replaced():
    """Without a tolerance of time there is no end, as with ROS 2's controller."""
    tight = {"goal_tolerance": [ros.JointTolerance("shoulder_pan_joint", 1e-9)]}
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
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


async def test_feedback_is_in_the_time_of_the_trajectory():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        async with robot.other.control("slow") as arm:
            await arm.set_speed(0.5)
        uuid, _ = await robot.send_goal(there_and_back(robot.q))
        began = len(robot.node.published["joint_states"])
        assert (await robot.until(robot.result(uuid))).status == SUCCEEDED
        assert len(robot.node.published["joint_states"]) - began > 1900
        last = robot.node.published[f"{ACTION}/feedback"][-2].feedback
        assert seconds(last.desired.time_from_start) == pytest.approx(2.0, abs=0.1)
        assert last.index == 1


@pytest.mark.parametrize(("stamp", "ticks"), [(0.0, 500), (0.2, 400), (0.6, 600)])
async def test_trajectory_starts_at_its_stamp(stamp, ticks):
    async with stepped_robot(**QUIET) as robot:
        await robot.step(200)  # 0.4 s
        goal = [robot.q[0] + 0.05, *robot.q[1:]]
        robot.move([(0.1, robot.q, STILL), (1.0, goal, STILL)], stamp=stamp)
        await robot.step(ticks - 40)
        assert robot.q != pytest.approx(goal, abs=1e-6)
        await robot.step(60)
        assert robot.q == pytest.approx(goal, abs=1e-6)
        robot.move([(0.1, goal, STILL)], stamp=0.1)
        await robot.step(1)
        assert "has ended" in robot.node.published["/rosout"][-1].msg


async def test_position_command_during_a_trajectory_is_refused_with_a_reason():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        uuid, _ = await robot.send_goal(there_and_back(robot.q))
        await robot.step(100)
        robot.node.send(POSITIONS, ros.Float64MultiArray(data=robot.q))
        assert (await robot.until(robot.result(uuid))).status == SUCCEEDED
        (warned,) = robot.node.published["/rosout"]
        assert "a position command was refused" in warned.msg


async def test_tolerances_and_stops_abort_a_goal():
    tight = [ros.JointTolerance("shoulder_pan_joint", 1e-9)]
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        for more, code in (
            ({"path_tolerance": tight}, PATH_TOLERANCE_VIOLATED),
            ({"goal_tolerance": tight, "goal_time_tolerance": duration(0.1)}, GOAL_TOLERANCE_VIOLATED),
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


async def test_trajectory_topic_moves_the_arm():
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        points = there_and_back(robot.q)[:1]
        robot.move(points)
        await robot.step(700)
        assert robot.q == pytest.approx(points[0][1], abs=1e-6)


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
