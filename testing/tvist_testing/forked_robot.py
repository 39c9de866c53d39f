"""One robot in a process of its own, which the test's process commands over a socket.

From the test: `state` to publish the present state, `close` to complete the recording and end, `leave` to end. To the
test: one line of JSON with the robot's endpoint, or with the reason why there is none; and after `close` or `leave` one
with the number of clients of UR's interfaces, without which it goes on: ur_rtde aborts its process when a robot goes
that it is connected to. At the end of the socket, which is that of the test's process, the robot ends in any case.
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
from typing import Any

from tvist_controller.sources.own_plants import load_plant
from tvist_plant.variants import Variant
from tvist_server.config import from_mapping
from tvist_server.ending import Ending
from tvist_server.gateways.base import GatewayError
from tvist_server.robot import ServedRobot
from tvist_server.server import Server
from tvist_server.ur_ports import UrPorts
from tvist_testing.preparation import Preparation
from tvist_testing.wanted import WantedRobot

LOOK = 0.05
"""Time between two looks at whether the last client has gone [s]."""
COMPLETING = 20.0
"""Longest wait for the end of the recording [s]."""
ATTEMPTS = 50
"""Number of ports or addresses to try, since another process may take one just before the robot listens there."""


def serve(wanted: WantedRobot, connection: socket.socket) -> int:
    """Serve a robot until the test's process wants it to end; return the exit code of this process.

    Args:
        wanted: The robot.
        connection: Socket to the test's process.
    """
    _log_into(wanted.log)
    ending = Ending()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the test's process is to hear it, and then ends this one
    preparation = Preparation(wanted)
    try:
        server, place = _listening(wanted, preparation)
        preparation.on(server.robots[0])
    except Exception as error:  # noqa: BLE001  whatever it is, the test should say it
        _tell(connection, {"error": str(error) or type(error).__name__})
        return 1
    listening = threading.Thread(target=_obey, args=(connection, server, ending), daemon=True)

    def ready() -> None:
        _tell(connection, {**place, "pid": os.getpid()})
        listening.start()

    asyncio.run(server.run(ready, ending))
    if server.failure is not None:
        logging.getLogger(__name__).error("%s", server.failure)
    return 0 if server.failure is None else 1


def _listening(wanted: WantedRobot, preparation: Preparation) -> tuple[Server, dict[str, Any]]:
    """Return a server on ports that nobody else uses, and where it listens."""
    for attempt in range(ATTEMPTS):
        address = _own_address() if wanted.ur else "127.0.0.1"
        endpoint = f"tcp/{address}:{_free_port(address)}"
        options: dict[str, Any] = {**wanted.options, "listen": (endpoint,)}
        if (plant := options.get("plant")) is not None:
            maker = load_plant(plant).maker
            options["truth"] = isinstance(maker, Variant) or hasattr(maker, "truth")
        if options.get("hidden") is not None:
            options["truth"] = False
        place: dict[str, Any] = {"endpoint": endpoint}
        if wanted.ur:
            usual = address != "127.0.0.1"
            ports = {} if usual else {name: _free_port(address) for name in UrPorts.__struct_fields__}
            options |= {"ur": True, "ur_address": address, "ur_ports": ports}
        config = from_mapping(options, "robot")
        try:
            server = Server(config, preparation.observe)
        except GatewayError:
            if attempt == ATTEMPTS - 1:
                raise
            continue
        if wanted.ur:
            host, open_ports = config.interfaces(0)
            place |= {"host": host, "ports": open_ports}
        return server, place
    raise AssertionError


def _own_address() -> str:
    """Return an address of this machine on which UR's own ports are free, as far as the system has such addresses."""
    if sys.platform != "linux":  # elsewhere only 127.0.0.1 is there
        return "127.0.0.1"
    return f"127.{1 + secrets.randbelow(254)}.{secrets.randbelow(256)}.{1 + secrets.randbelow(254)}"


def _free_port(address: str) -> int:
    with socket.socket() as probe:
        probe.bind((address, 0))
        return int(probe.getsockname()[1])


def _obey(connection: socket.socket, server: Server, ending: Ending) -> None:
    robot = server.robots[0]
    with contextlib.suppress(OSError), connection.makefile("rb") as orders:
        for order in orders:
            if order == b"state\n":
                robot.driven.post(robot.repeat)
                continue
            if order == b"close\n" and server.ur_clients:
                _complete_recording(robot)
            _tell(connection, {"clients": server.ur_clients})
            _see_off(connection, server)
            break
    ending.request()


def _complete_recording(robot: ServedRobot) -> None:
    """End the recording between two ticks, while the robot goes on."""
    done = threading.Event()

    def complete() -> None:
        robot.close_recording()
        done.set()

    robot.driven.post(complete)
    done.wait(COMPLETING)


def _see_off(connection: socket.socket, server: Server) -> None:
    """Wait until the last client of UR's interfaces has gone, or the test's process has ended."""
    while server.ur_clients and not select.select([connection], [], [], LOOK)[0]:
        pass


def _tell(connection: socket.socket, message: dict[str, Any]) -> None:
    connection.sendall(json.dumps(message).encode() + b"\n")


def _log_into(path: str) -> None:
    """Let everything that this process says go into a file."""
    file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    for standard in (1, 2):
        os.dup2(file, standard)
    os.close(file)
    logging.basicConfig(
        stream=sys.stderr, level=logging.INFO, format="%(levelname)s %(name)s: %(message)s", force=True
    )
