"""A ROS 2 node in memory, and a robot in this process whose time a test steps."""

import asyncio
from collections import defaultdict
from contextlib import asynccontextmanager

from tvist_client import LoopbackTransport, Robot
from tvist_controller.loopback import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_ros2.cdr import decode, encode
from tvist_ros2.gateway import CONTROLLER, Gateway
from tvist_ros2.messages import ros
from tvist_ros2.node import Node

ACTION = f"{CONTROLLER}/follow_joint_trajectory/_action"
AT_ONCE = 20  # ticks between which nobody reacts
JOINTS = [
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint",
]  # fmt: skip


class MemoryNode(Node):
    """Keeps what is published, in encoded form as on a network.

    Attributes:
        published: Messages by topic; those of both types of feedback are in the topic's list.
        qos: Quality of service by topic.
    """

    def __init__(self):
        self.published, self.qos = defaultdict(list), {}
        self._subscribed, self._served = {}, {}

    def publisher(self, name, of, qos=None):
        self.qos[name] = qos

        def publish(message):
            self.published[name].append(decode(of.request, encode(message)))

        return publish

    def subscribe(self, name, _of, callback):
        self._subscribed[name] = callback

    def serve(self, name, _of, answer):
        self._served[name] = answer

    async def close(self):
        pass

    def send(self, name, message):
        self._subscribed[name](decode(type(message), encode(message)))

    def ask(self, name, request):
        """Start to call a service; return the task with the answer."""
        return asyncio.create_task(self._served[name](request))


class SteppedRobot:
    """A robot behind a gateway; `step` lets time pass and everybody react."""

    def __init__(self, host, other, stepper, node):
        self.host, self.other, self.node = host, other, node
        self.stepper, self._goals = stepper, 0

    async def settle(self):
        """Let everybody react without time passing."""
        for _ in range(20):
            await asyncio.sleep(0)

    async def step(self, ticks):
        for first in range(0, ticks, AT_ONCE):
            await self.stepper.step(min(AT_ONCE, ticks - first))
            await self.settle()

    async def until(self, task, ticks=5000):
        """Step until a task is done; return its result."""
        await self.settle()
        for _ in range(0, ticks, AT_ONCE):
            if task.done():
                return task.result()
            await self.step(AT_ONCE)
        raise AssertionError(f"{task} is not done after {ticks} ticks")

    @property
    def q(self):
        """The shaped reference."""
        return list(self.host.controller.report.state.target_q)

    @property
    def now(self):
        return ros.Time(*divmod(round(1e9 * self.host.controller.report.state.timestamp), 10**9))

    @property
    def said(self):
        """What was refused, and why."""
        return [message.msg for message in self.node.published["/rosout"]]

    async def send_goal(self, points, names=JOINTS, **more):
        """Send a goal with points (time, q, qd); return its identifier and whether it was accepted."""
        self._goals += 1
        uuid = ros.UUID(self._goals.to_bytes(16, "big"))
        goal = ros.FollowJointTrajectory_Goal(trajectory_of(points, names), **more)
        request = ros.FollowJointTrajectory_SendGoal_Request(uuid, goal)
        answer = await self.until(self.node.ask(f"{ACTION}/send_goal", request))
        return uuid, answer.accepted

    def result(self, uuid):
        request = ros.FollowJointTrajectory_GetResult_Request(uuid)
        return self.node.ask(f"{ACTION}/get_result", request)

    async def cancel(self, uuid, until=ros.Time()):  # noqa: B008  it cannot change
        request = ros.CancelGoal_Request(ros.GoalInfo(uuid, until))
        return await self.until(self.node.ask(f"{ACTION}/cancel_goal", request))

    def move(self, points, **more):
        """Send points to the topic for trajectories."""
        self.node.send(f"{CONTROLLER}/joint_trajectory", trajectory_of(points, **more))

    async def trigger(self, name):
        return await self.until(self.node.ask(f"dashboard_client/{name}", ros.Trigger_Request()))


def trajectory_of(points, names=JOINTS, stamp=0.0):
    return ros.JointTrajectory(
        ros.Header(ros.Time(*divmod(round(stamp * 1e9), 10**9))),
        joint_names=list(names),
        points=[
            ros.JointTrajectoryPoint(list(q), list(qd), time_from_start=duration(time))
            for time, q, qd in points
        ],
    )


def duration(seconds):
    return ros.Duration(*divmod(round(seconds * 1e9), 10**9))


@asynccontextmanager
async def stepped_robot(node=None, rate=500.0, **setup):
    host = LoopbackHost(free_setup(clock="lockstep", **setup))
    robot, other = Robot.over(LoopbackTransport(host)), Robot.over(LoopbackTransport(host, "clock"))
    node = node or MemoryNode()
    gateway = Gateway(robot, await robot.info(), node, rate=rate)
    running = asyncio.create_task(gateway.run())
    async with other.clock_control("clock") as stepper:
        stepped = SteppedRobot(host, other, stepper, node)
        await stepped.settle()
        yield stepped
    running.cancel()
    await asyncio.wait([running])
    await robot.close()
    await other.close()
