"""Two nodes of our own over a Zenoh router, and `tvist serve --ros2`."""

import asyncio
import signal
from contextlib import asynccontextmanager
from functools import partial

import pytest
import zenoh.ext
from tests.conformance.served import PATIENCE, Served, finished, refused_to_start
from tests.places import free_endpoint
from tests.ros2.nodes import ACTION, JOINTS, stepped_robot, trajectory_of
from tests.system.waiting import eventually
from zenoh.handlers import Callback

from tvist_client.errors import NotConnectedError
from tvist_client.transports.inbox import wake
from tvist_client.transports.session import close_session, open_session
from tvist_protocol.modes import RobotMode
from tvist_ros2.cdr import decode, encode
from tvist_ros2.gateway import POSITIONS
from tvist_ros2.messages import TYPES, ros, seconds
from tvist_ros2.names import key
from tvist_ros2.zenoh_node import ATTACHMENT, ZenohNode
from tvist_server.gateways.access import open_access
from tvist_server.gateways.network import Network
from tvist_server.gateways.ros2 import Ros2Gateway

SEND_GOAL, GET_RESULT, TRIGGER = (
    TYPES[name]
    for name in (
        "control_msgs/action/FollowJointTrajectory_SendGoal",
        "control_msgs/action/FollowJointTrajectory_GetResult",
        "std_srvs/srv/Trigger",
    )
)
SERVICES = 12  # of a robot's node
IDENTIFIER = bytes(range(16))
ATTACHED = ATTACHMENT.pack(7, 0, 16, IDENTIFIER)


class Peer:
    """What a node of rmw_zenoh does: it subscribes, calls services and looks for tokens."""

    def __init__(self, endpoint):
        self.session, self.loop = open_session(endpoint), asyncio.get_running_loop()
        self.kept = []

    def topic(self, name, of):
        """Return a queue of the messages and attachments of a topic, also of those sent before if it is latched."""
        queue = asyncio.Queue()

        def on_sample(sample):
            item = decode(of.request, bytes(sample.payload)), ATTACHMENT.unpack(bytes(sample.attachment))
            wake(self.loop, partial(queue.put_nowait, item))

        history = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        callback = Callback(on_sample, indirect=False)
        where = key(0, name, of)
        self.kept.append(
            zenoh.ext.declare_advanced_subscriber(self.session, where, callback, history=history)
        )
        return queue

    async def replies(self, where, payload, attachment=ATTACHED):
        """Call all services of a key; return their replies."""
        replies, ended = [], asyncio.Event()
        callback = Callback(replies.append, partial(wake, self.loop, ended.set), indirect=False)
        self.session.get(where, callback, payload=payload, attachment=attachment, timeout=60)
        await ended.wait()
        return replies

    async def call(self, name, of, request):
        replies = []
        while not replies:  # this session may not have learned of the service yet
            replies = await self.replies(key(0, name, of), encode(request))
        (reply,) = replies
        number, _, size, identifier = ATTACHMENT.unpack(bytes(reply.ok.attachment))
        assert (number, size, identifier) == (7, 16, IDENTIFIER)
        return decode(of.response, bytes(reply.ok.payload))

    def tokens(self):
        replies = self.session.liveliness().get("@ros2_lv/**", timeout=PATIENCE)
        return {str(reply.ok.key_expr) for reply in replies}


@asynccontextmanager
async def over_zenoh():
    """Run a robot in lockstep with its node at a router, and a peer there."""
    endpoint = free_endpoint()
    network = Network([endpoint], gossip=True)
    node = await ZenohNode.open(endpoint, 0, "", "tvist_ur5e", lossless=True)
    peer = Peer(endpoint)
    try:
        async with stepped_robot(node, calibration="none", shaper="none") as robot:
            # The router drops messages of which it knows no receiver yet. Services are announced last.
            eventually(lambda: sum("/SS/" in token for token in peer.tokens()) == SERVICES)
            yield robot, peer
    finally:
        close_session(peer.session)
        await node.close()
        network.close()


async def moved():
    """Move the robot by the action; return all joint states that a tick brought."""
    async with over_zenoh() as (robot, peer):
        states = peer.topic("/joint_states", TYPES["sensor_msgs/msg/JointState"])
        uuid, q = ros.UUID(b"goal" * 4), robot.q
        points = [(0.5, [q[0] + 0.1, *q[1:]], [0.0] * 6)]
        goal = ros.FollowJointTrajectory_Goal(trajectory_of(points))
        request = ros.FollowJointTrajectory_SendGoal_Request(uuid, goal)
        assert (await peer.call(f"/{ACTION}/send_goal", SEND_GOAL, request)).accepted
        asked = ros.FollowJointTrajectory_GetResult_Request(uuid)
        result = asyncio.create_task(peer.call(f"/{ACTION}/get_result", GET_RESULT, asked))
        await robot.step(400)
        assert (await result).result.error_code == 0
        received = [await states.get()]
        while received[-1][0].header.stamp != robot.now:
            received.append(await states.get())
        numbers = [attached[0] for _, attached in received]
        assert numbers == list(range(numbers[0], numbers[0] + len(received)))
        assert len({attached[3] for _, attached in received}) == 1
        assert received[-1][0].name == JOINTS
        ticked = [encode(message) for message, _ in received if seconds(message.header.stamp) > 0]
        assert len(ticked) == 400
        return ticked


async def test_two_nodes_move_the_robot_and_repeat_it_to_the_last_bit():
    assert await moved() == await moved()


async def test_late_node_gets_what_is_latched_and_sees_every_entity():
    async with over_zenoh() as (robot, peer):
        await robot.step(10)
        description = peer.topic("/robot_description", TYPES["std_msgs/msg/String"])
        assert "shoulder_pan_joint" in (await description.get())[0].data
        answer = await peer.call("/dashboard_client/stop", TRIGGER, ros.Trigger_Request())
        assert answer.success
        kinds = [token.split("/")[5] for token in peer.tokens()]
        assert [kinds.count(kind) for kind in ("NN", "SS", "MS")] == [1, SERVICES, 2]


async def test_router_that_drops_messages_of_ros_2_is_named(monkeypatch):
    monkeypatch.setattr("tvist_ros2.zenoh_node.SEEN_S", 0.5)
    endpoint = free_endpoint()
    network = Network([endpoint], {"access_control": open_access(["ur5e"])})
    try:
        with pytest.raises(
            NotConnectedError, match="does not pass on messages of ROS 2: start it as tvist serve"
        ):
            await ZenohNode.open(endpoint, 0, "", "tvist_ur5e")
    finally:
        network.close()


async def test_messages_that_cannot_be_read_are_reported_and_services_answer_with_an_error():
    async with over_zenoh() as (robot, peer):
        await robot.step(10)
        told = peer.topic("/rosout", TYPES["rcl_interfaces/msg/Log"])
        positions = key(0, f"/{POSITIONS}", TYPES["std_msgs/msg/Float64MultiArray"])
        stop, request = key(0, "/dashboard_client/stop", TRIGGER), encode(ros.Trigger_Request())
        for data, why in (
            (b"\x00\x00" + encode(ros.Float64MultiArray())[2:], "begins with '0000': must begin with 0001"),
            (encode(ros.Float64MultiArray(data=robot.q))[:-1], "cannot be decoded"),
        ):
            peer.session.put(positions, data)
            assert why in (await told.get())[0].msg
        for payload, attachment, why in (
            (request, None, "the attachment has 0 bytes: must have 33"),
            (b"", ATTACHED, "begins with ''"),
        ):
            (reply,) = await peer.replies(stop, payload, attachment)
            assert why in bytes(reply.err.payload).decode()
            assert why in (await told.get())[0].msg
        assert (await peer.call("/dashboard_client/stop", TRIGGER, ros.Trigger_Request())).success


async def test_key_with_a_wildcard_calls_no_service():
    async with over_zenoh() as (robot, peer):
        await robot.step(10)
        every = key(0, "/dashboard_client/*", TRIGGER)
        assert await peer.replies(every, encode(ros.Trigger_Request())) == []
        assert robot.host.controller.report.state.robot_mode == RobotMode.RUNNING


async def test_states_and_time_are_repeated_while_time_stands_still(monkeypatch):
    monkeypatch.setattr("tvist_ros2.gateway.REPEAT_S", 0.01)
    async with over_zenoh() as (_, peer):
        clock = peer.topic("/clock", TYPES["rosgraph_msgs/msg/Clock"])
        first, second = (await clock.get())[0], (await clock.get())[0]
        assert first == second


@pytest.mark.realtime
async def test_served_robot_is_a_ros_2_robot():
    with Served("--ros2") as served:
        served.wait_until_said("is in ROS 2, domain 0")
        peer = Peer(served.endpoint)
        try:
            states = peer.topic("/joint_states", TYPES["sensor_msgs/msg/JointState"])
            assert (await states.get())[0].name == JOINTS
            assert (await peer.call("/dashboard_client/stop", TRIGGER, ros.Trigger_Request())).success
        finally:
            close_session(peer.session)
        assert served.end(signal.SIGINT) == 0


async def test_server_tells_that_its_gateway_has_ended():
    told = asyncio.Queue()
    gateway = Ros2Gateway("nowhere", "ur5e", "", told.put_nowait)
    await gateway.open()
    assert "ended with exit code 1" in await told.get()
    await gateway.shut()


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (("--security", "keys"), "every ROS 2 node can move the robot"),
        (("--robots", "ur5e*2", "--clock", "lockstep"), "needs one time for all robots"),
        (("--robots", "ur5e*2", "--workers", "2"), "run tvist ros2 for each robot"),
    ],
)
def test_ros2_refuses_what_it_cannot_keep(options, why):
    code, said = refused_to_start("--ros2", *options)
    assert code == 2
    assert why in said


@pytest.mark.parametrize(
    ("option", "value", "why"),
    [("--security", "keys", "any node may move"), ("--namespace", "a*", "must be words")],
)
def test_gateway_refuses_what_it_cannot_keep(option, value, why):
    ended = finished("-m", "tvist_cli", "ros2", option, value)
    assert ended.returncode == 2
    assert why in ended.stderr
