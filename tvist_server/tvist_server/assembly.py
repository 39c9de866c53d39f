"""Distributes a server's robots over processes; creates the robots, their interfaces and their clocks."""

import multiprocessing
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_controller.controller import Controller
from tvist_controller.instruments.report import Sink
from tvist_controller.setup import Setup
from tvist_plant.plant import PERIOD
from tvist_server.allowed_hosts import AllowedHosts
from tvist_server.clock import Clock, Lockstep, Realtime
from tvist_server.config import ServeConfig
from tvist_server.gateways.security import check_endpoints, check_ur_address, server_security
from tvist_server.option_values import StartError, recording_of
from tvist_server.robot import ServedRobot

if TYPE_CHECKING:
    from tvist_server.gateways.ur.interfaces import UrInterfaces


LOCAL = "unixsock-stream/"  # prefix of the endpoints reserved for the server's own processes


@dataclass(frozen=True)
class Share:
    """The robots that one process of a server serves."""

    numbers: range  # indices of these robots in the list of all robots
    router: str | None = None
    """Endpoint of the process that clients connect to; None if this process has the configured endpoints."""


def shares(robots: int, workers: int) -> list[range]:
    """Return each process's range of robot indices; the numbers of robots differ by at most one."""
    bounds = [worker * robots // workers for worker in range(workers + 1)]
    return [range(first, last) for first, last in pairwise(bounds)]


def check_together(config: ServeConfig, robots: int) -> None:
    """Raise StartError for an invalid duration, folder, host or input, or options that exclude each other."""
    config.keep_ticks()
    config.dump_folder()
    config.program_folder(config.name)
    AllowedHosts(config.ur_allow)
    if config.reserve_inputs:
        from tvist_server.gateways.ur.rtde.variables import matching  # it is slow to import

        matching(config.reserve_inputs)
    several, routed = config.workers > 1, bool(config.connect)
    own = next((one for one in config.endpoints if one.startswith(LOCAL)), None)
    workers = f"workers is {config.workers}"
    for wrong, why in (
        (routed and config.endpoints and config.security is not None,
         "connect, listen and security exclude each other: the router checks certificates, so leave listen out"),
        (several and config.workers > robots, f"{workers}: must be at most the number of robots, {robots}"),
        (several and "fork" not in multiprocessing.get_all_start_methods(),
         f"{workers}: this system cannot fork processes, so give 1"),
        (several and routed and config.endpoints,
         "connect, listen and workers exclude each other: each process connects to the router, so leave listen out"),
        (several and routed and config.metrics is not None,
         "connect, metrics and workers exclude each other: run one server for each process, each with its own port"),
        (several and own is not None,
         f"listen is {own}, and {workers}: Unix sockets are for the server's own processes, so listen on tcp/ or tls/"),
        (config.ros2 and config.security is not None,
         "ros2 and security exclude each other: every ROS 2 node can move the robot, whatever its certificate allows"),
        (config.ros2 and several,
         f"ros2 needs one process, and {workers}: connect to rmw_zenohd, and run tvist ros2 for each robot"),
        (config.ros2 and robots > 1 and config.clock != "realtime",
         "ros2 needs one time for all robots, which in lockstep they do not have: serve one robot per ROS_DOMAIN_ID"),
    ):  # fmt: skip
        if wrong:
            raise StartError(why)


def make_robot(
    setup: Setup, config: ServeConfig, observe: Callable[[Controller], Sink] | None, *, several: bool
) -> ServedRobot:
    """Create a robot to serve; raise StartError if that is impossible."""
    path = None
    if config.record is not None:
        path = recording_of(config.record, setup.name) if several else Path(config.record)
    programs, dump, keep = config.program_folder(setup.name), config.dump_folder(), config.keep_ticks()
    try:
        return ServedRobot(setup, path, dump, observe, programs, AllowedHosts(config.ur_allow), keep)
    except ValueError as error:
        raise StartError(str(error)) from error


def security_of(config: ServeConfig, names: Sequence[str]) -> tuple[list[str], dict[str, Any]]:
    """Return endpoints to listen on and the settings that protect them; StartError if that is impossible."""
    check_endpoints("connect", config.connect)
    # The router checks the certificates of clients that reach the robot through it.
    return server_security(
        config.endpoints,
        names,
        security=None if config.connect else config.security,
        insecure=config.insecure,
        namespace=config.namespace or "",
        ros2=config.ros2,
    )


def ur_interfaces(robot: ServedRobot, config: ServeConfig, number: int) -> "UrInterfaces":
    """Create UR interfaces of robot `number`; StartError if other machines could reach them unprotected."""
    from tvist_server.gateways.ur.interfaces import UrInterfaces
    from tvist_server.gateways.ur.rtde.variables import matching

    address, ports = config.interfaces(number)
    check_ur_address(address, insecure=config.insecure)
    reserved = matching(config.reserve_inputs)
    setup, lockstep = robot.setup, config.clock != "realtime"
    return UrInterfaces(
        robot.intake,
        setup.description,
        setup.name,
        address,
        ports,
        lockstep=lockstep,
        gripper=robot.ask_gripper if setup.cell is not None and setup.cell.gripper is not None else None,
        programs=config.program_folder(setup.name),
        reserved=reserved,
    )


def check_paces(config: ServeConfig, robots: Sequence[ServedRobot]) -> None:
    """If a plant starts ticks, raise StartError if the clock is not real time or there are more robots."""
    if not any(robot.driven.pace for robot in robots):
        return
    if config.clock != "realtime" or config.speed != 1.0:
        wanted = f"clock is {config.clock}" if config.clock != "realtime" else f"speed is {config.speed:g}"
        raise StartError(f"{wanted}, but the plant {config.plant} gives the tick: leave it out")
    if len(robots) > 1:
        raise StartError(
            f"plant is {config.plant}, which gives the tick, and there are {len(robots)} robots: serve each by a "
            "process of its own (workers), or alone"
        )


def make_clocks(config: ServeConfig, robots: Sequence[ServedRobot]) -> list[Clock]:
    """Create clocks: in real time one for all robots; else one per robot, so that none waits for another."""
    if config.clock == "realtime":
        driven = [robot.driven for robot in robots]
        return [Realtime(driven, PERIOD, config.speed, priority=config.realtime_priority)]
    return [Lockstep(robot.driven, robot.repeat) for robot in robots]
