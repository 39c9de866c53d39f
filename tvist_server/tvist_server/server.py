"""Served robots: each with its recording, one clock and one network for all, until somebody ends them."""

import asyncio
import contextlib
import gc
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from threading import Thread

from tvist_plant.plant import PERIOD
from tvist_server.clock import Clock, Lockstep, Realtime
from tvist_server.config import ConfigError, ServeConfig
from tvist_server.courier import Courier
from tvist_server.ending import Ending
from tvist_server.fleet import recording_of
from tvist_server.gateways.console import Console, ConsoleGateway
from tvist_server.gateways.exposure import ExposureError, guarded, guarded_doors
from tvist_server.gateways.network import Network
from tvist_server.gateways.ur.doors import UrDoors
from tvist_server.robot import ServedRobot
from tvist_server.setup import Setup
from tvist_server.ur_ports import Door

LEAVE = 0.6
"""How long clients may take at the end to read what waits for them [s]."""


class Server:
    """Robots on the network.

    Args:
        config: How they are served.

    Raises:
        ConfigError: The configuration is wrong.
        RecordingError: A recording cannot be written.
        GatewayError: An endpoint cannot be listened on.
    """

    def __init__(self, config: ServeConfig) -> None:
        setups = config.setups()
        try:
            listen, guard = guarded(
                config.listen,
                [setup.name for setup in setups],
                security=config.security,
                insecure=config.insecure,
            )
        except ExposureError as error:
            raise ConfigError(str(error)) from error
        self.robots: list[ServedRobot] = []
        self._doors: list[UrDoors] = []
        self.left = True
        """After `close`: whether the network is left. Zenoh, or who hands on, may still wait for a client that has
        stopped reading."""
        try:
            for setup in setups:
                self.robots.append(_robot(setup, config, several=len(setups) > 1))
            self._couriers, self._clocks = _drivers(config, self.robots)
            lockstep = config.clock != "realtime"
            self._network = Network(listen, guard, lockstep=lockstep)
            self._gateways = [
                self._network.gateway(robot.setup.name, robot, lockstep=lockstep, truth=robot.setup.truth)
                for robot in self.robots
            ]
            self._console = Console()
            # In real time the clock sees to it that messages are handed on; in lockstep each message does.
            for number, robot in enumerate(self.robots):
                if config.ur:
                    self._doors.append(_doors(robot, config, number))
                wake = self._couriers[number].wake if lockstep else None
                name = robot.setup.name
                console = ConsoleGateway(self._console, name, partial(config.command_line, name=name))
                robot.outlet.open([self._gateways[number], *self._doors[number : number + 1], console], wake)
        except BaseException:  # a signal, too
            for doors in self._doors:
                doors.close()
            for robot in self.robots:
                robot.discard_recording()
            raise

    # ------------------------------------------------------------------ life

    def start(self) -> None:
        """Begin to tick and to answer."""
        # What lives now lives to the end: the collector need not look at it again.
        gc.collect()
        gc.freeze()
        sys.setswitchinterval(1e-4)
        self._console.start()
        for courier in self._couriers:
            courier.start()
        for robot in self.robots:
            robot.start()
        for clock in self._clocks:
            clock.start()

    def close(self) -> None:
        """End in order: no more ticks, recordings closed, what waits handed on, as far as clients take it."""
        for robot in self.robots:
            robot.outlet.hurry()
            robot.end_planning()
        for robot in self.robots:
            robot.stop_planning()
        for clock in self._clocks:
            clock.close()
        for robot in self.robots:
            robot.close_recording()
        leaving = Thread(target=self._leave, name="tvist-leave", daemon=True)
        leaving.start()
        leaving.join(LEAVE)
        self.left = not leaving.is_alive() and all(courier.ended for courier in self._couriers)
        gc.unfreeze()

    def _leave(self) -> None:
        """Leave the network. A client that has stopped reading can hold this up for ten seconds."""
        try:
            for courier in self._couriers:
                courier.close()
            for doors in self._doors:
                doors.close()
            self._console.close()
        finally:
            with contextlib.suppress(Exception):
                self._network.close()

    async def run(self, ready: Callable[[], None], ending: Ending) -> None:
        """Serve until a signal comes, or until a controller fails; then `failure` says why.

        Args:
            ready: Called once the robots tick and answer.
            ending: The signals.
        """
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        ending.hear(lambda: loop.call_soon_threadsafe(ended.set))
        self.start()
        try:
            for doors in self._doors:
                await doors.first_tick()
                await doors.open()
            ready()
            while not ended.is_set() and self.failure is None:
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(ended.wait(), 1.0)
                self._tell_telemetry()
        finally:
            for doors in self._doors:
                await doors.shut()
            self.close()

    @property
    def ur(self) -> list[tuple[str, dict[Door, int]]]:
        """Address and ports of each robot's UR interfaces; none where they are not open."""
        return [(doors.address, doors.ports) for doors in self._doors]

    @property
    def failure(self) -> str | None:
        """Why a robot ticks no more, where one does not."""
        return next((robot.failure for robot in self.robots if robot.failure is not None), None)

    def _tell_telemetry(self) -> None:
        # In lockstep each robot has a clock of its own.
        clocks = self._clocks if len(self._clocks) > 1 else self._clocks * len(self.robots)
        for number, (robot, clock) in enumerate(zip(self.robots, clocks, strict=True)):
            gateways = [self._gateways[number], *self._doors[number : number + 1]]
            robot.tell_telemetry(gateways, clock.punctuality(robot.driven))
        self._console.update()


def _robot(setup: Setup, config: ServeConfig, *, several: bool) -> ServedRobot:
    path = None
    if config.record is not None:
        path = recording_of(config.record, setup.name) if several else Path(config.record)
    try:
        return ServedRobot(setup, path, Path(config.dump))
    except ValueError as error:
        raise ConfigError(str(error)) from error


def _doors(robot: ServedRobot, config: ServeConfig, number: int) -> UrDoors:
    address, ports = config.doors(number)
    try:
        guarded_doors(address, insecure=config.insecure)
    except ExposureError as error:
        raise ConfigError(str(error)) from error
    return UrDoors(
        robot, robot.setup.description, robot.setup.name, address, ports, lockstep=config.clock != "realtime"
    )


def _drivers(config: ServeConfig, robots: Sequence[ServedRobot]) -> tuple[list[Courier], list[Clock]]:
    """What lets time pass and what hands on: one of each for all robots in real time, in lockstep for each robot.

    In lockstep nothing may be lost, so that whoever hands on waits for a slow client, and for one robot alone.
    """
    if config.clock == "realtime":
        courier, driven = Courier([robot.outlet for robot in robots]), [robot.driven for robot in robots]
        clock = Realtime(driven, courier.wake, PERIOD, config.speed, priority=config.realtime_priority)
        return [courier], [clock]
    couriers = [Courier([robot.outlet]) for robot in robots]
    return couriers, [Lockstep(robot.driven, robot.repeat) for robot in robots]
