"""`tvist ros2 --rclpy` in real time, as a node of an installed ROS 2 sees it:

    PYTHON -m pytest tests/acceptance/ros2.py

README.md says what this Python needs. The machine must have nothing else to do.
"""

import os
import signal
import subprocess
import sys
from contextlib import ExitStack

import pytest
from tests.conformance.served import NOISE, Served
from tests.ros2.nodes import JOINTS

from tvist_ros2.gateway import CONTROLLER, POSITIONS

rclpy = pytest.importorskip("rclpy")
ActionClient = pytest.importorskip("rclpy.action").ActionClient
GoalStatus = pytest.importorskip("action_msgs.msg").GoalStatus
Duration = pytest.importorskip("rclpy.duration").Duration
FollowJointTrajectory = pytest.importorskip("control_msgs.action").FollowJointTrajectory
JointState = pytest.importorskip("sensor_msgs.msg").JointState
Float64MultiArray = pytest.importorskip("std_msgs.msg").Float64MultiArray
Trigger = pytest.importorskip("std_srvs.srv").Trigger
trajectory_msgs = pytest.importorskip("trajectory_msgs.msg")
JointTrajectory = trajectory_msgs.JointTrajectory

pytestmark = [pytest.mark.acceptance, pytest.mark.realtime]
DOMAIN = os.getpid() % 100 + 1
NEAR = 0.01  # deviation of an arm that has arrived [rad]
SECOND = 500  # number of states
SERVICES = ("power_off", "brake_release", "pause")


class Client:
    """A node that watches the robot and moves it; `positions` and `trajectories` are its publishers."""

    def __init__(self):
        node = self._node = rclpy.create_node("client")
        self._executor = rclpy.get_global_executor()
        self._executor.add_node(node)
        self._states = []
        node.create_subscription(JointState, "joint_states", self._states.append, 100)
        self.positions = node.create_publisher(Float64MultiArray, POSITIONS, 10)
        self.trajectories = node.create_publisher(JointTrajectory, f"{CONTROLLER}/joint_trajectory", 10)
        self._action = ActionClient(node, FollowJointTrajectory, f"{CONTROLLER}/follow_joint_trajectory")
        # A server waits only 0.1 s for a new client's end before it answers, so they all meet first.
        self._services = {name: node.create_client(Trigger, f"dashboard_client/{name}") for name in SERVICES}
        assert all(service.wait_for_service(60.0) for service in self._services.values())
        assert self._action.wait_for_server(60.0)
        while not (self.positions.get_subscription_count() and self.trajectories.get_subscription_count()):
            self.next_states(1)

    def next_states(self, number):
        """Wait for new states."""
        self._states.clear()
        while len(self._states) < number:
            self._executor.spin_once()
        return list(self._states)

    def q(self):
        return list(self.next_states(1)[0].position)

    def rest_at(self, q):
        """Wait until the arm has been at a posture for a second."""
        while not all(is_near(state.position, q) for state in self.next_states(SECOND)):
            pass

    def answer(self, future):
        self._executor.spin_until_future_complete(future)
        return future.result()

    def call(self, service):
        return self.answer(self._services[service].call_async(Trigger.Request()))

    def send_goal(self, q, seconds, feedback=None):
        goal = FollowJointTrajectory.Goal(trajectory=trajectory_to(q, seconds))
        return self.answer(self._action.send_goal_async(goal, feedback_callback=feedback))

    def result(self, goal):
        """Wait for the end of a goal; return its status and result."""
        return self.answer(goal.get_result_async())


def trajectory_to(q, seconds):
    time = Duration(seconds=seconds).to_msg()
    point = trajectory_msgs.JointTrajectoryPoint(positions=q, velocities=[0.0] * 6, time_from_start=time)
    return JointTrajectory(joint_names=JOINTS, points=[point])


def is_near(one, other):
    return max(abs(a - b) for a, b in zip(one, other, strict=True)) < NEAR


@pytest.fixture(scope="module")
def client():
    rclpy.init(domain_id=DOMAIN)
    with Served(cold=True) as robot:
        words = ["-m", "tvist_cli", "ros2", robot.endpoint, "--rclpy", "--domain", str(DOMAIN)]
        gateway = subprocess.Popen([sys.executable, *words], stderr=subprocess.PIPE, text=True)
        try:
            yield Client()
        finally:
            gateway.send_signal(signal.SIGINT)
            _, told = gateway.communicate()
            print(told)
            rclpy.shutdown()
    assert gateway.returncode == 130
    assert not [word for word in NOISE if word in told]


def test_states_of_all_joints_arrive_in_order(client):
    states = client.next_states(2 * SECOND)
    assert all(list(state.name) == JOINTS for state in states)
    stamps = [(state.header.stamp.sec, state.header.stamp.nanosec) for state in states]
    assert stamps == sorted(set(stamps))


def test_arm_follows_positions(client):
    q = client.q()
    for _ in range(50):
        q[0] += 0.004
        client.positions.publish(Float64MultiArray(data=q))
        client.next_states(10)
    client.rest_at(q)


def test_arm_moves_along_a_trajectory_of_the_topic(client):
    q = client.q()
    q[0] -= 0.2
    client.trajectories.publish(trajectory_to(q, 1.0))
    client.rest_at(q)


@pytest.mark.parametrize("busy", [0, 2])
def test_every_goal_is_reached_also_beside_busy_processes(client, busy):
    q, outcomes, feedback = client.q(), [], []
    with ExitStack() as others:
        for _ in range(busy):
            other = others.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            others.callback(other.kill)
        for number in range(10):
            q[number // 2] += -0.1 if number % 2 else 0.1
            result = client.result(client.send_goal(q, 0.7, feedback.append))
            last = client.next_states(SECOND)[-1]  # the first ones may have waited since the motion
            outcomes.append((result.status, result.result.error_string, is_near(last.position, q)))
    assert outcomes == [(GoalStatus.STATUS_SUCCEEDED, "", True)] * 10
    assert len(feedback) > 10


def test_cancelled_goal_stops_on_its_way(client):
    start = client.q()
    goal = client.send_goal([start[0] + 0.5, *start[1:]], 3.0)
    while client.q()[0] < start[0] + 0.1:
        pass
    assert len(client.answer(goal.cancel_goal_async()).goals_canceling) == 1
    assert client.result(goal).status == GoalStatus.STATUS_CANCELED
    assert start[0] + 0.1 - NEAR < client.q()[0] < start[0] + 0.4


def test_impossible_goal_is_rejected(client):
    q = client.q()
    assert not client.send_goal([q[0] + 0.5, *q[1:]], 0.05).accepted
    client.rest_at(q)


def test_services_switch_power_and_say_why_they_cannot(client):
    assert client.call("power_off").success
    assert not client.send_goal(client.q(), 1.0).accepted
    assert client.call("brake_release").success
    assert client.result(client.send_goal(client.q(), 1.0)).status == GoalStatus.STATUS_SUCCEEDED
    refused = client.call("pause")
    assert not refused.success
    assert "no program" in refused.message
