"""The server: robots, each with its own recording, that share a network and, in real time, a clock."""

import asyncio
import contextlib
import gc
import secrets
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from threading import Thread
from typing import TYPE_CHECKING, NamedTuple

from tvist_controller.controller import Controller
from tvist_controller.instruments.report import Sink
from tvist_protocol.keys import within
from tvist_server.assembly import (
    Share,
    check_paces,
    check_together,
    make_clocks,
    make_robot,
    security_of,
    ur_interfaces,
)
from tvist_server.clock import Realtime
from tvist_server.config import ServeConfig
from tvist_server.gateways.base import Gateway, Prepare, Starting
from tvist_server.gateways.console import Console, ConsoleGateway
from tvist_server.gateways.metrics import Metrics, MetricsGateway
from tvist_server.gateways.network import Network
from tvist_server.gateways.ros2 import Ros2Gateway
from tvist_server.gateways.security import is_local
from tvist_server.plan_ahead import PlanAhead
from tvist_server.robot import ServedRobot
from tvist_server.shutdown import Shutdown
from tvist_server.ur_ports import InterfaceName

if TYPE_CHECKING:
    from tvist_server.gateways.ur.interfaces import UrInterfaces
    from tvist_server.recording.recorder import Recorder

LEAVE = 0.6  # longest time for clients to read pending messages at shutdown [s]


INSTANCE_BYTES = 4  # number of random bytes that distinguish the tokens of this run from earlier ones


class RecordingResult(NamedTuple):
    """Location and completeness of a recording."""

    place: str  # description of its location
    dropped: int  # number of messages dropped because the queue was full
    error: str | None  # reason why the recording ended early; None: it did not


class Server:
    """One or more robots on the network.

    Raise StartError for an invalid configuration, RecorderError or GatewayError if a recording or an endpoint fails.
    """

    def __init__(
        self,
        config: ServeConfig,
        observe: Callable[[Controller], Sink] | None = None,  # used instead of the console
        share: Share | None = None,  # robots of this process; None: all
        prepare: Prepare | None = None,  # does slow work before the robots are made
    ) -> None:
        setups = config.setups()
        check_together(config, len(setups))
        several = len(setups) > 1
        share = Share(range(len(setups))) if share is None else share
        setups = [setups[number] for number in share.numbers]
        if config.clock == "realtime":  # equal runs in lockstep must be equal, including tokens
            setups = [replace(setup, instance=secrets.token_hex(INSTANCE_BYTES)) for setup in setups]
        self._observed = observe is not None
        self.granted: list[str] = []  # what the system granted to make ticks punctual; complete after `start`
        # A worker needs no protection: clients reach it through another process, which is protected.
        listen, guard = (
            security_of(config, [setup.name for setup in setups]) if share.router is None else ([], {})
        )
        self.robots: list[ServedRobot] = []
        self.metrics: Metrics | None = None  # figures for Prometheus; None if they are not published
        self.left = True
        """Whether the network is closed after `close`; Zenoh may still wait for a client that has stopped reading."""
        lockstep, starting = config.clock != "realtime", Starting()
        self._network = Network(
            listen,
            guard,
            lockstep=lockstep,
            connect=config.connect if share.router is None else (share.router,),
            security=config.security if share.router is None else None,
            namespace=config.namespace or "",
            on_router=partial(self._tell_router, ", ".join(config.connect)) if share.router is None else None,
            gossip=config.ros2,
        )
        try:
            self._console = Console()
            self.metrics = (
                None if config.metrics is None or share.router is not None else Metrics(config.metrics)
            )
            self._network.expect([setup.name for setup in setups], starting)
            if prepare is not None:
                prepare(starting.note)
            for setup in setups:
                self.robots.append(make_robot(setup, config, observe, several=several))
            check_paces(config, self.robots)
            self._clocks = make_clocks(config, self.robots)
            self._interfaces: list[UrInterfaces] = []
            self.ur: list[tuple[str, dict[InterfaceName, int]]] = []
            """Address and ports of each robot's UR interfaces; empty if they are closed."""
            for number, robot in zip(share.numbers, self.robots, strict=True):
                robot.open(self._gateways(robot, config, number))
        except BaseException:  # including a signal
            self.discard()
            raise

    def share_control(self, host: str, token: str) -> None:
        """Let UR clients at the address `host` use a lease that this process holds as `ur-ADDRESS`; before `start`."""
        for interfaces in self._interfaces:
            interfaces.adopt(host, token)

    def _tell_router(self, where: str, there: bool) -> None:
        why = "is back" if there else "and to its clients was lost; the robot tries to reconnect"
        for robot in self.robots:
            robot.warn(f"the connection to the router at {where} {why}")

    def discard(self) -> None:
        """If the server has not started, close its robots and remove their recordings."""
        if self.metrics is not None:
            self.metrics.close()
        for robot in self.robots:
            robot.close()
        for recorder in self._recorders:
            recorder.discard()
        self._network.close()

    def _gateways(self, robot: ServedRobot, config: ServeConfig, number: int) -> list[Gateway]:
        name, intake, lockstep = robot.setup.name, robot.intake, config.clock != "realtime"
        # Without the option `truth`, that topic is offered only if all clients are on this machine.
        local = not config.connect and all(map(is_local, config.endpoints))
        wanted = robot.want_truth if local else None
        gateways: list[Gateway] = [
            self._network.gateway(name, intake, lockstep=lockstep, truth=robot.setup.truth, wanted=wanted),
            robot.sockets,
        ]
        if config.ur:
            interfaces = ur_interfaces(robot, config, number)
            self._interfaces.append(interfaces)
            self.ur.append((interfaces.address, interfaces.ports))
            gateways.append(interfaces)
        if config.ros2:
            place = within(config.namespace or "", name)
            gateways.append(Ros2Gateway(config.reached, place, name if config.robots else "", robot.warn))
        if self.metrics is not None:
            gateways.append(
                self.metrics.add(MetricsGateway(config.namespace or "", name, lambda: robot.newest))
            )
        if not self._observed:
            gateways.append(ConsoleGateway(self._console, name, partial(config.command_line, name=name)))
        return gateways

    def start(self) -> None:
        """Start the clocks and answer clients."""
        # The objects created before live until the end: the garbage collector need not visit them again.
        gc.collect()
        gc.freeze()
        # Time after which the tick thread demands the interpreter's lock; the default, 5 ms, exceeds a tick.
        sys.setswitchinterval(1e-4)
        self._console.start()
        for plan in self._planning:
            plan.start()
        for clock in self._clocks:
            clock.start()
            self.granted += clock.granted if isinstance(clock, Realtime) else []

    def close(self) -> None:
        """Shut down in order: stop the clocks, close the recordings, deliver pending messages to clients that read."""
        for plan in self._planning:
            plan.end()
        # A planning thread waits for jobs of the tick thread, so it must end first.
        for plan in self._planning:
            plan.close()
        for clock in self._clocks:
            clock.close()
        for recorder in self._recorders:
            recorder.close()
        leaving = Thread(target=self._leave, name="tvist-leave", daemon=True)
        leaving.start()
        leaving.join(LEAVE)
        self.left = not leaving.is_alive()
        gc.unfreeze()

    def _leave(self) -> None:
        """Release the arms and close the network. A client that has stopped reading can delay this for ten seconds."""
        try:
            for robot in self.robots:
                robot.host.leave_arm()
            for robot in self.robots:
                robot.close()
            self._console.close()
            if self.metrics is not None:
                self.metrics.close()
        finally:
            with contextlib.suppress(Exception):
                self._network.close()

    async def run(self, ready: Callable[[], None], ending: Shutdown) -> None:
        """Serve until a signal comes or all robots have failed (see `failure`); call `ready` once the robots answer."""
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        ending.on_request(lambda: loop.call_soon_threadsafe(ended.set))
        self.start()
        try:
            for gateway in (one for robot in self.robots for one in robot.gateways):
                await gateway.open()
            ready()
            while not (ended.is_set() or all(robot.host.failure for robot in self.robots)):
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(ended.wait(), 1.0)
                for robot in self.robots:
                    robot.publish_telemetry()
                self._console.update()
        finally:
            for gateway in (one for robot in self.robots for one in robot.gateways):
                await gateway.shut()
            self.close()

    @property
    def page(self) -> str | None:
        """Address of the page with figures for Prometheus; None if they are not published."""
        return None if self.metrics is None else self.metrics.page

    @property
    def ur_clients(self) -> int:
        """Number of open connections to UR's interfaces."""
        return sum(interfaces.clients for interfaces in self._interfaces)

    @property
    def failure(self) -> str | None:
        """Why a robot has stopped ticking; None if all of them tick."""
        return next((robot.host.failure for robot in self.robots if robot.host.failure is not None), None)

    @property
    def _recorders(self) -> "list[Recorder]":
        return [robot.recorder for robot in self.robots if robot.recorder is not None]

    @property
    def _planning(self) -> list[PlanAhead]:
        return [robot.plan_ahead for robot in self.robots if robot.plan_ahead is not None]

    @property
    def recordings(self) -> list[RecordingResult]:
        """The recordings, after `close`."""
        return [
            RecordingResult(
                str(recorder.place or f"a file that is no longer {recorder.path}"),
                recorder.dropped,
                recorder.error,
            )
            for recorder in self._recorders
        ]
