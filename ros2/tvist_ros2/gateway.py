"""A robot as a ROS 2 robot: connects the robot's states and commands with a node."""

import asyncio
import re
from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from tvist_client.arm import Arm
from tvist_client.robot import Robot
from tvist_protocol import Info, TvistError
from tvist_protocol.errors import one_line
from tvist_ros2.action import TrajectoryAction
from tvist_ros2.messages import TYPES, ros
from tvist_ros2.mover import Mover
from tvist_ros2.names import Qos
from tvist_ros2.node import Node
from tvist_ros2.outputs import RATE, Outputs
from tvist_ros2.tasks import Tasks

CONTROLLER = "scaled_joint_trajectory_controller"  # as in UR's driver
POSITIONS = "forward_position_controller/commands"
REPEAT_S = 1.0  # time without a state after which the last one is published again [s]
WARN = 30  # a level of rcl_interfaces/msg/Log
SAME_S = 1.0  # time within which the same warning, perhaps with other numbers, is given only once [s]

Command = Callable[[Arm], Awaitable[None]]
Service = Callable[[], Awaitable[None]]

DASHBOARD: dict[str, Command] = {
    "power_on": lambda arm: arm.power_on(release_brakes=False),
    "brake_release": lambda arm: arm.power_on(),
    "power_off": lambda arm: arm.power_off(),
    "unlock_protective_stop": lambda arm: arm.unlock_protective_stop(),
    "restart_safety": lambda arm: arm.restart_safety(),
    "pause": lambda arm: arm.pause_program(),
    "close_popup": lambda arm: arm.close_popup(),
}
"""Services that need control for a moment, as UR's driver names them in `dashboard_client`."""


class Gateway:
    """Publishes what the robot does, and carries out what ROS 2 asks for."""

    def __init__(
        self,
        robot: Robot,
        info: Info,
        node: Node,
        *,
        name: str = "tvist",  # of the node, for the log
        rate: float = RATE,  # states to publish per second of the robot's time [Hz]
        say: Callable[[str], None] = lambda _: None,  # tells people what was refused
    ) -> None:
        self._robot, self._name, self._say = robot, name, say
        self._outputs = Outputs(node, info, rate)
        self._log = node.publisher("/rosout", TYPES["rcl_interfaces/msg/Log"], Qos(1000, latched=True))
        self._warned: dict[str, float] = {}  # when each warning was given
        self._tasks = Tasks()
        node.warn = self._warn
        self._mover = Mover(robot, self._warn)
        self._action = TrajectoryAction(
            node, f"{CONTROLLER}/follow_joint_trajectory", self._mover, self._outputs, self._warn
        )
        positions = TYPES["std_msgs/msg/Float64MultiArray"]
        node.subscribe(
            POSITIONS, positions, lambda message: self._mover.follow(message.data, self._outputs.tick)
        )
        node.subscribe(
            f"{CONTROLLER}/joint_trajectory", TYPES["trajectory_msgs/msg/JointTrajectory"], self._trajectory
        )
        trigger = TYPES["std_srvs/srv/Trigger"]
        services: dict[str, Service] = {"stop": self._stop, "play": self._mover.play}
        services |= {its_name: partial(self._controlled, command) for its_name, command in DASHBOARD.items()}
        for its_name, service in services.items():
            node.serve(f"dashboard_client/{its_name}", trigger, partial(self._answer, service))

    async def run(self) -> None:
        """Work until the robot disconnects, which raises NotConnectedError."""
        states = self._robot.states()
        repeating = asyncio.create_task(self._repeat())
        try:
            self._outputs.take(await self._robot.state())
            async for state in states:
                self._outputs.take(state)
                self._action.take(state)
        finally:
            repeating.cancel()
            self._action.close()
            await self._tasks.cancel()
            await self._mover.close()

    async def _repeat(self) -> None:
        """Publish the last state each second in which no state came: nodes with `use_sim_time` wait for the time."""
        while True:
            before = self._outputs.latest
            await asyncio.sleep(REPEAT_S)
            if self._outputs.latest is before:
                self._outputs.publish()

    def _trajectory(self, message: Any) -> None:
        self._tasks.start(self._action.start(ros.FollowJointTrajectory_Goal(message)))

    async def _controlled(self, command: Command) -> None:
        async with self._mover.control() as arm:
            await command(arm)

    async def _stop(self) -> None:
        self._action.drop_waiting()
        self._mover.ignore_positions()
        await self._robot.stop()

    async def _answer(self, service: Service, _: Any) -> Any:
        """Carry out a service; the answer says whether it was done, or why not."""
        try:
            await service()
        except TvistError as error:
            return ros.Trigger_Response(False, str(error))
        return ros.Trigger_Response(True, "")

    def _warn(self, why: str) -> None:
        """Tell people and `/rosout` what was refused; the same thing only once in some seconds."""
        now, why = asyncio.get_running_loop().time(), one_line(why)
        self._warned = {said: when for said, when in self._warned.items() if now < when + SAME_S}
        cause = re.sub(r"[-+.\d]+", "", why)
        if cause not in self._warned:
            self._warned[cause] = now
            self._say(why)
            self._log(ros.Log(self._outputs.now(), WARN, self._name, why))
