"""`tvist ros2`: make a served robot a ROS 2 robot."""

import asyncio
import re
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.failure import Misuse, check_range, failing_on, interrupted
from tvist_cli.output import say
from tvist_client.fleet import place_of
from tvist_client.robot import ENDPOINT, NAME, Robot
from tvist_client.transports.zenoh import only_robot
from tvist_ros2.gateway import Gateway
from tvist_ros2.node import Node
from tvist_ros2.outputs import RATE
from tvist_ros2.rclpy_node import RclpyNode
from tvist_ros2.zenoh_node import ZenohNode

NAMESPACE = r"[A-Za-z_]\w*(/[A-Za-z_]\w*)*"


def ros2(  # without a `Connection`, because the namespace is ROS 2's
    endpoint: str = ENDPOINT,
    *,
    name: str | None = None,
    domain: Annotated[int, Parameter(env_var="ROS_DOMAIN_ID")] = 0,
    namespace: str = "",
    rate: float = RATE,
    rclpy: bool = False,
    security: Path | None = None,
) -> None:
    """Connect a served robot with ROS 2 until Control+C: its state on topics, motions by topic and action.

    Nodes with rmw_zenoh see the robot if ENDPOINT is their router, as a server with --ros2 is, and nothing of ROS 2
    needs to be installed here. Every ROS 2 node that reaches the router can move the robot.

    Args:
        endpoint: Connect to the robot and to ROS 2 at this Zenoh endpoint.
        name: Select the robot of this name, or NAMESPACE/NAME [ur5e; if there is none, the only robot at the
            endpoint].
        domain: ROS_DOMAIN_ID of the nodes that see the robot.
        namespace: Put the robot's topics, services and actions into this ROS 2 namespace.
        rate: Publish this many states per second of the robot's time, 1 to 500.
        rclpy: Use the installed ROS 2, with any middleware, instead of Zenoh alone; source its setup first.
        security: Not possible: ROS 2 nodes have no roles.
    """
    if security is not None:
        raise Misuse("security does not go with ROS 2: any node may move the robot, with or without a role")
    if namespace and not re.fullmatch(NAMESPACE, namespace, re.ASCII):
        raise Misuse(f"namespace is {namespace!r}: must be words such as left/arm, which ROS 2 allows")
    check_range("domain", domain, 0, 232)  # as in ROS 2
    check_range("rate", rate, 1.0, RATE)
    try:
        asyncio.run(_connect(endpoint, name, domain, namespace, rate, rclpy=rclpy))
    except KeyboardInterrupt:
        raise interrupted("the robot is no longer connected with ROS 2; it keeps running") from None


async def _connect(
    endpoint: str, name: str | None, domain: int, namespace: str, rate: float, *, rclpy: bool
) -> None:
    with failing_on():
        place = place_of(name or await only_robot(endpoint, NAME))
        async with await Robot.connect(endpoint, place.robot, namespace=place.namespace) as robot:
            info = await robot.info()
            own, within = f"tvist_{place.robot}".replace("-", "_"), f"/{namespace}" if namespace else ""
            node: Node
            if rclpy:
                node = RclpyNode(domain, within, own)
            else:
                lossless = info.clock != "realtime"
                node = await ZenohNode.open(endpoint, domain, within, own, lossless=lossless)
            try:
                gateway = Gateway(robot, info, node, name=own, rate=rate, say=say)
                where = f"domain {domain}, namespace {within or '/'}"
                say(f"{info.name} is in ROS 2, {where}. Press Control+C to stop.")
                await gateway.run()
            finally:
                await node.close()
