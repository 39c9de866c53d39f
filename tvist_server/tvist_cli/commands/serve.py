"""`tvist serve`: run a robot."""

import asyncio
import os
import time
from typing import Any

from tvist_cli.failure import Failure, told
from tvist_cli.output import say


def serve(
    *,
    name: str | None = None,
    robot: str | None = None,
    listen: list[str] | None = None,
    security: str | None = None,
    insecure: bool = False,
    payload: float | None = None,
    shaper: str | None = None,
    calibration: str | None = None,
    clock: str | None = None,
    speed: float | None = None,
    start: str | None = None,
    seed: int | None = None,
    record: str | None = None,
    truth: bool = False,
    config: str | None = None,
) -> None:
    """Run a robot on the network until Control+C.

    Args:
        name: Name on the network [ur5e].
        robot: Robot that comes with the package, or path of a robot file [ur5e].
        listen: Zenoh endpoint, repeatable [tcp/127.0.0.1:7447].
        security: Folder made by tvist keys; the endpoint is then tls/ADDRESS:PORT, and who has no role sees nothing.
        insecure: Listen beyond this machine without: anybody there may move the robot.
        payload: Mass of the paper's disc on the flange in kg [5].
        shaper: none, zv, mzv, zvd, ei, ei2 or ei3 [zv].
        calibration: Calibration that comes with the package, or path of one; none for a robot to be identified.
        clock: realtime, or lockstep: a client lets time pass [realtime].
        speed: Of the robot's time against the clock's [1].
        start: Q1, Q2, Q3, or joint angles in rad with commas [Q1].
        seed: Of sensor noise and gear errors [0].
        record: MCAP file to record into.
        truth: Tell what no robot can know, on tvist/NAME/truth and in the recording.
        config: TOML file with any of these; the command line goes before it.
    """
    given: dict[str, Any] = {
        "name": name, "robot": robot, "listen": listen, "security": security,
        "insecure": insecure or None, "payload": payload, "shaper": shaper,
        "calibration": calibration, "clock": clock, "speed": speed, "start": start, "seed": seed,
        "record": record, "truth": truth or None,
    }  # fmt: skip
    began = time.monotonic()
    from tvist_plant.plant import is_compiled

    if not is_compiled():
        say("compiling the arm's equations, once: this takes some seconds")
    from tvist_server.config import ConfigError, from_mapping, read_toml
    from tvist_server.gateways.base import GatewayError
    from tvist_server.recording import RecordingError
    from tvist_server.server import Server

    with told(ConfigError, code=2):
        content = {} if config is None else read_toml(config)
        content |= {key: value for key, value in given.items() if value is not None}
        checked = from_mapping(content, "configuration" if config is None else f"configuration {config}")
        with told(GatewayError, RecordingError):
            server = Server(checked)

    def ready() -> None:
        took = time.monotonic() - began
        setup = server.controller.setup
        say(
            f"{setup.name} ({setup.description.robot.model}, {setup.payload.mass:g} kg, shaper {setup.shaper}) "
            f"listens on {', '.join(checked.listen)}, clock {setup.clock}; ready after {took:.1f} s. Control+C ends it."
        )

    for endpoint in checked.listen if checked.insecure else ():
        say(f"anybody who reaches {endpoint} can move this robot")
    asyncio.run(server.run(ready))
    if server.failure is not None:
        raise Failure(server.failure)
    if server.recorder is not None:
        if server.recorder.error is not None:
            raise Failure(server.recorder.error)
        note = f", {server.recorder.dropped} messages dropped" if server.recorder.dropped else ""
        say(f"recorded into {checked.record}{note}")
    if not server.left:
        # Zenoh would wait for ten seconds, for a client that has stopped reading. All that is ours is closed.
        os._exit(0)
