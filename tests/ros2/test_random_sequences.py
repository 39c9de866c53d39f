"""Whatever ROS 2 nodes and other clients ask for: every goal ends, control is given back, nothing is left behind."""

import asyncio
import math
import random
from contextlib import suppress

import pytest
from tests.ros2.nodes import ACTION, duration, stepped_robot, trajectory_of
from tests.ros2.test_gateway import QUIET, STILL, TIGHT, there_and_back

from tvist_client import LoopbackTransport, Robot
from tvist_protocol import SetSpeed, SimulationInject, TvistError
from tvist_ros2.action import EXECUTING, SUCCEEDED
from tvist_ros2.gateway import CONTROLLER, DASHBOARD, POSITIONS
from tvist_ros2.messages import ros


class Chaos:
    """Does one random thing after another with a robot, without waiting for answers."""

    def __init__(self, robot, other, rng):
        self.robot, self.other, self.rng = robot, other, rng
        self.asked, self.goals, self.holding = [], [], False

    def posture(self):
        q = self.robot.q
        q[self.rng.randrange(6)] += self.rng.uniform(-0.1, 0.1)
        return self.rng.choice([q, q, q, [math.nan, *q[1:]], q[:5], [100.0] * 6])

    def points(self):
        good = there_and_back(self.robot.q, time=self.rng.choice([0.3, 0.6]), by=0.05)
        return self.rng.choice([good, good, good, [], [(0.1, self.posture(), STILL)], good[::-1]])

    def follow(self):
        self.robot.node.send(POSITIONS, ros.Float64MultiArray(data=self.posture()))

    def move(self):
        self.robot.node.send(f"{CONTROLLER}/joint_trajectory", trajectory_of(self.points()))

    def serve(self):
        name = f"dashboard_client/{self.rng.choice(list(DASHBOARD))}"
        self.asked.append(self.robot.node.ask(name, ros.Trigger_Request()))

    def goal(self):
        uuid = ros.UUID(bytes([self.rng.randrange(1, 256)] * 16))
        tolerances = {name: self.rng.choice([[], [], TIGHT]) for name in ("path_tolerance", "goal_tolerance")}
        tolerances["goal_time_tolerance"] = duration(0.1)  # without, a goal may wait for ever
        wanted = ros.FollowJointTrajectory_Goal(trajectory_of(self.points()), **tolerances)
        request = ros.FollowJointTrajectory_SendGoal_Request(uuid, wanted)
        self.goals.append((uuid, self.robot.node.ask(f"{ACTION}/send_goal", request)))
        self.asked.append(self.robot.result(uuid))

    def cancel(self):
        uuid = self.rng.choice([ros.UUID(), *(uuid for uuid, _ in self.goals)])
        request = ros.CancelGoal_Request(ros.GoalInfo(uuid))
        self.asked.append(self.robot.node.ask(f"{ACTION}/cancel_goal", request))

    async def disturb(self):
        """Let another client change the speed, cause a fault with the gateway's right, or stop the arm."""
        lease = self.robot.host.controller.session.lease
        token = "" if lease is None else lease.token
        with suppress(TvistError):
            await self.rng.choice(
                [
                    self.other.stop,
                    lambda: self.other.request(SetSpeed(token=token, fraction=self.rng.choice([0.5, 1.0]))),
                    lambda: self.other.request(SimulationInject(token=token, fault="protective_stop")),
                    self.jog,
                ]
            )()

    async def jog(self):
        async with self.other.control("other") as arm:
            await arm.move_j(there_and_back(self.robot.q, by=0.05)[0][1], wait=False)
            await self.robot.step(self.rng.randrange(1, 200))


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(1, 6))]
)
async def test_random_sequence_leaves_the_robot_at_rest_and_free(seed):
    rng = random.Random(seed)
    async with stepped_robot(**QUIET) as robot:
        await robot.step(10)
        other = Robot.over(LoopbackTransport(robot.host, "other"))
        before = asyncio.all_tasks()
        chaos = Chaos(robot, other, rng)
        kinds = [chaos.follow, chaos.follow, chaos.follow, chaos.move, chaos.goal, chaos.goal, chaos.cancel]
        for _ in range(24):
            if rng.random() < 0.15:
                await chaos.disturb()
            else:
                rng.choice([*kinds, chaos.serve])()
            await robot.step(rng.choice([0, 0, 1, 20, 100, 300]))
        await robot.step(1500)
        assert robot.host.controller.session.lease is None
        for task in chaos.asked:
            assert task.done()
            assert task.exception() is None
        for _, task in chaos.goals:
            assert task.done()
        last = robot.node.published[f"{ACTION}/status"]
        assert not last or all(one.status > EXECUTING for one in last[-1].status_list)
        await robot.settle()
        assert asyncio.all_tasks() == before
        for name in ("unlock_protective_stop", "brake_release"):
            await robot.trigger(name)
        await robot.step(600)
        uuid, accepted = await robot.send_goal(there_and_back(robot.q, time=1.0))
        assert accepted
        assert (await robot.until(robot.result(uuid))).status == SUCCEEDED
        await other.close()
