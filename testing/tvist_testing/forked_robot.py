"""One robot in its own process, which the test's process commands over a socket.

Commands are `state` (publish the present state), `close` (complete the recording and end) and `leave` (end).
Answers are lines of JSON: at first the robot's endpoint or an error; after `close` or `leave` the number of
clients of UR's interfaces. The robot continues until these have left, since ur_rtde aborts its process if its
robot disappears. When the socket closes because the test's process has ended, the robot ends in any case.
"""

import asyncio
import contextlib
import json
import logging
import os
import secrets
import select
import signal
import socket
import sys
import threading
from functools import partial
from typing import Any

from tvist_controller.instruments.report import Sink
from tvist_controller.sources.own_plants import load_plant
from tvist_plant.plant import PERIOD
from tvist_plant.variants import Variant
from tvist_protocol.commands import Command, ReleaseControl, TakeControl
from tvist_protocol.errors import RefusedError
from tvist_protocol.programs import ProgramLoad
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationInject
from tvist_protocol.stream import Event, State
from tvist_server.config import from_mapping
from tvist_server.gateways.base import GatewayError
from tvist_server.robot import ServedRobot
from tvist_server.server import Server
from tvist_server.shutdown import Shutdown
from tvist_server.ur_ports import UrPorts
from tvist_testing.markers import WantedFault, WantedRobot

LOOK = 0.05  # time between two checks whether the last client is gone [s]
COMPLETING = 20.0  # longest wait for the end of the recording [s]
ATTEMPTS = 50
"""Ports or addresses to try, since another process may take one just before the robot listens there."""
CLIENT = "tvist_testing"  # client that injects faults if no other client has control
log = logging.getLogger("robot")


class Preparation(Sink):
    """Loads the program and injects the faults that a test's markers describe; logs events."""

    def __init__(self, wanted: WantedRobot) -> None:
        self._wanted = wanted
        later = [fault for fault in wanted.faults if fault.after > 0.0]
        self._later = sorted(later, key=lambda one: one.after)
        self._robot: ServedRobot | None = None

    def on(self, robot: ServedRobot) -> None:
        """Do everything that precedes the first tick."""
        self._robot = robot
        if self._wanted.program is not None:
            name, text = self._wanted.program
            _accept(robot, ProgramLoad(name=name, text=text))
        for fault in self._wanted.faults:
            if fault.after == 0.0:
                _inject(robot, fault)

    def event(self, event: Event) -> None:
        """Log an event."""
        why = f": {event.why}" if event.why else ""
        log.info("tick %d: %s%s", event.tick, event.kind, why)

    def state(self, state: State) -> None:
        """Inject the faults that are due after a tick; called in the controller's thread."""
        robot = self._robot
        while robot and self._later and state.tick * PERIOD >= self._later[0].after - 0.5 * PERIOD:
            robot.driven.post(partial(_inject_or_log, robot, self._later.pop(0)))


def _inject_or_log(robot: ServedRobot, fault: WantedFault) -> None:
    try:
        _inject(robot, fault)
    except RefusedError as error:
        log.warning("the fault %s was refused: %s", fault.fault, error)


def _inject(robot: ServedRobot, fault: WantedFault) -> None:
    session = robot.controller.session
    if free := session.lease is None:
        _accept(robot, TakeControl(client=CLIENT, lease_s=60.0))
    assert session.lease is not None
    token = session.lease.token
    injected = SimulationInject(
        token=token, fault=fault.fault, joint=fault.joint, seconds=fault.seconds, value=fault.value
    )
    _accept(robot, injected)
    if free:
        _accept(robot, ReleaseControl(token=token))


def _accept(robot: ServedRobot, command: Command) -> None:
    reply = robot.request(command)
    if isinstance(reply, Refused):
        raise RefusedError(reply)


def serve(wanted: WantedRobot, connection: socket.socket) -> int:
    """Serve a robot until the test's process ends it; return the exit code of this process."""
    _log_into(wanted.log)
    ending = Shutdown()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the test's process handles it, and then ends this one
    preparation = Preparation(wanted)
    try:
        server, place = _listening(wanted, preparation)
        preparation.on(server.robots[0])
    except Exception as error:  # noqa: BLE001  the test should report any error
        _tell(connection, {"error": str(error) or type(error).__name__})
        return 1
    listening = threading.Thread(target=_obey, args=(connection, server, ending), daemon=True)

    def ready() -> None:
        _tell(connection, {**place, "pid": os.getpid()})
        listening.start()

    asyncio.run(server.run(ready, ending))
    if server.failure is not None:
        log.error("%s", server.failure)
    return int(server.failure is not None)


def _listening(wanted: WantedRobot, preparation: Preparation) -> tuple[Server, dict[str, Any]]:
    """Return a server that listens on unused ports, and the addresses."""
    for _ in range(ATTEMPTS - 1):
        with contextlib.suppress(GatewayError):
            return _on_free_ports(wanted, preparation)
    return _on_free_ports(wanted, preparation)


def _on_free_ports(wanted: WantedRobot, preparation: Preparation) -> tuple[Server, dict[str, Any]]:
    address = _own_address() if wanted.ur else "127.0.0.1"
    place: dict[str, Any] = {"endpoint": f"tcp/{address}:{_free_port(address)}"}
    options: dict[str, Any] = {**wanted.options, "listen": (place["endpoint"],)}
    if (plant := options.get("plant")) is not None:
        maker = load_plant(plant).maker
        options["truth"] = isinstance(maker, Variant) or hasattr(maker, "truth")
    if wanted.ur:
        usual = address != "127.0.0.1"
        ports = {} if usual else {name: _free_port(address) for name in UrPorts.__struct_fields__}
        options |= {"ur": True, "ur_address": address, "ur_ports": ports}
    config = from_mapping(options, "robot")
    server = Server(config, lambda _: preparation)
    if wanted.ur:
        place["host"], place["ports"] = config.interfaces(0)
    return server, place


def _own_address() -> str:
    """Return a loopback address on which UR's usual ports are free, if the system has several."""
    if sys.platform != "linux":  # other systems have only 127.0.0.1
        return "127.0.0.1"
    return f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"


def _free_port(address: str) -> int:
    with socket.socket() as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


def _obey(connection: socket.socket, server: Server, ending: Shutdown) -> None:
    robot = server.robots[0]
    with contextlib.suppress(OSError), connection.makefile("rb") as orders:
        for order in orders:
            if order == b"state\n":
                robot.driven.post(robot.repeat)
                continue
            if order == b"close\n" and server.ur_clients and robot.recorder is not None:
                # Complete the recording between two ticks, while the robot continues.
                done = threading.Event()
                robot.driven.post(robot.recorder.close)
                robot.driven.post(done.set)
                done.wait(COMPLETING)
            _tell(connection, {"clients": server.ur_clients})
            # Wait until the last client of UR's interfaces is gone, or the test's process has ended.
            while server.ur_clients and not select.select([connection], [], [], LOOK)[0]:
                pass
            break
    ending.request()


def _tell(connection: socket.socket, message: dict[str, Any]) -> None:
    connection.sendall(json.dumps(message).encode() + b"\n")


def _log_into(path: str) -> None:
    """Redirect all output of this process into a file."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    for standard in (1, 2):
        os.dup2(file, standard)
    os.close(file)
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO, format="%(levelname)s %(name)s: %(message)s", force=True
    )
