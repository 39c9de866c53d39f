"""`tvist serve`: run a robot."""

import asyncio
import os
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.misuse import lower
from tvist_cli.output import say

if TYPE_CHECKING:
    from tvist_controller.setup import Setup


def serve(
    *,
    name: str | None = None,
    robot: str | None = None,
    robots: str | None = None,
    listen: list[str] | None = None,
    security: str | None = None,
    insecure: bool = False,
    payload: float | None = None,
    overload: bool = False,
    shaper: str | None = None,
    calibration: str | None = None,
    clock: str | None = None,
    speed: float | None = None,
    realtime_priority: bool = False,
    start: str | None = None,
    state: str | None = None,
    seed: int | None = None,
    record: str | None = None,
    dump: str | None = None,
    truth: bool = False,
    quiet: bool = False,
    ur: bool = False,
    ur_address: str | None = None,
    ur_port: list[str] | None = None,
    config: str | None = None,
) -> None:
    """Run a robot on the network, or several, until Control+C, SIGTERM, SIGQUIT or the end of the terminal.

    Args:
        name: Name on the network [ur5e].
        robot: Robot that comes with the package, or path of a robot file [ur5e].
        robots: Several instead, ROBOT[*COUNT] with commas: ur5e*2,other.toml serves ur5e-1, ur5e-2 and other.
        listen: Zenoh endpoint, repeatable [tcp/127.0.0.1:7447].
        security: Folder made by tvist keys; the endpoint is then tls/ADDRESS:PORT, and who has no role sees nothing.
        insecure: Listen beyond this machine without: anybody there may move the robot.
        payload: Mass of the paper's disc on the flange in kg, declared and carried [5].
        overload: Start even where that is above the robot's rating: the drives may give out, and the robot then makes
            a protective stop.
        shaper: Any that tvist shapers lists, such as none, zv or ei3; or auto, short or auto-target; or FILE.py:NAME,
            which runs that file and adds the shaper of your own to those that clients can choose [zv].
        calibration: Calibration that comes with the package, or path of one; none for a robot to be identified.
        clock: realtime, or lockstep: a client lets time pass [realtime].
        speed: Of the robot's time against the clock's [1].
        realtime_priority: Put the ticks before all else on this machine (SCHED_FIFO), where the system permits it.
        start: Q1, Q2, Q3, or joint angles in rad with commas [Q1].
        state: TOML or JSON file with the state to start in: any of q, payload (what is carried), mode, shaper, seed.
        seed: Of sensor noise and gear errors [0]; of several robots the first one's, the next has the next.
        record: MCAP file to record into; of several robots each has its own, FILE-NAME.mcap.
        dump: Folder for the last second before the simulated arm failed [the system's for temporary files].
        truth: Tell what no robot can know, on tvist/NAME/truth and in the recording.
        quiet: Sensors without noise and angles in an encoder's steps, for clients that wait until nothing changes.
        ur: Open UR's own interfaces, too: RTDE, real-time client, dashboard, primary and secondary.
        ur_address: IP address they listen at; of several robots each has the next one [127.0.0.1].
        ur_port: Move one, repeatable: rtde=31004; dashboard=off keeps it shut. Others: primary, secondary, realtime,
            and primary_read_only, secondary_read_only, realtime_read_only.
        config: TOML file with any of these; the command line goes before it.
    """
    given: dict[str, Any] = {
        "name": name, "robot": robot, "robots": robots, "listen": listen, "security": security,
        "insecure": insecure or None, "payload": payload, "overload": overload or None, "shaper": lower(shaper),
        "calibration": calibration, "clock": lower(clock), "speed": speed,
        "realtime_priority": realtime_priority or None, "start": start, "state": state, "seed": seed,
        "record": record, "dump": dump, "truth": truth or None, "quiet": quiet or None,
        "ur": (ur or ur_address is not None or ur_port is not None) or None, "ur_address": ur_address,
        "ur_ports": None if ur_port is None else dict(map(_ur_port, ur_port)),
    }  # fmt: skip
    began = time.monotonic()
    from tvist_plant.flexible_arm import is_compiled

    if not is_compiled():
        say("compiling the arm's equations, once: this takes some seconds")
    from tvist_server.config import ConfigError, from_mapping, read_toml
    from tvist_server.ending import Ending
    from tvist_server.gateways.base import GatewayError
    from tvist_server.recording import RecordingError
    from tvist_server.server import Server

    with told(ConfigError, code=2):
        content = {} if config is None else read_toml(config)
        content |= {key: value for key, value in given.items() if value is not None}
        checked = from_mapping(content, "configuration" if config is None else f"configuration {config}")
        ending = Ending()
        # Now there is something to clean up, which an exception sees to.
        with told(GatewayError, RecordingError), ending.at_once():
            server = Server(checked)

    def ready() -> None:
        took = time.monotonic() - began
        say(
            f"{_introduction([robot.setup for robot in server.robots])} on {', '.join(checked.listen)}, "
            f"clock {checked.clock}; ready after {took:.1f} s. Control+C ends it."
        )

    for address, ports in server.ur:
        listed = ", ".join(f"{door} {port}" for door, port in ports.items())
        say(f"UR's interfaces are open on {address}: {listed}")
    whom = "this robot" if len(server.robots) == 1 else "these robots"
    for endpoint in checked.listen if checked.insecure else ():
        say(f"anybody who reaches {endpoint} can move {whom}")
    asyncio.run(server.run(ready, ending))
    ending.close()
    if server.failure is not None:
        raise Failure(server.failure)
    recorders = [robot.recorder for robot in server.robots if robot.recorder is not None]
    for recorder in recorders:
        if recorder.error is None:
            note = f", {recorder.dropped} messages dropped" if recorder.dropped else ""
            say(f"recorded into {recorder.place or f'a file that is no longer {recorder.path}'}{note}")
    errors = [recorder.error for recorder in recorders if recorder.error is not None]
    if errors:
        raise Failure("; ".join(errors))
    if not server.left:
        # Zenoh would wait for ten seconds, for a client that has stopped reading. All that is ours is closed.
        os._exit(0)


def _ur_port(text: str) -> tuple[str, int]:
    """Door and port of DOOR=PORT; whether there is such a door the configuration says."""
    door, equals, port = text.partition("=")
    if not equals or not (port == "off" or (port.isascii() and port.isdigit() and len(port) < 9)):
        raise Failure(f"ur-port is {text!r}: must be DOOR=PORT such as rtde=31004, or DOOR=off", code=2)
    return door, 0 if port == "off" else int(port)


def _introduction(setups: Sequence["Setup"]) -> str:
    """Who listens: the robot with how it is set up, or the names of several."""
    first = setups[0]
    if len(setups) == 1:
        model = first.description.robot.model
        return f"{first.name} ({model}, {first.payload.mass:g} kg, shaper {first.shaper}) listens"
    names = [setup.name for setup in setups]
    listed = ", ".join(names) if len(names) < 8 else f"{', '.join(names[:3])} … {names[-1]}"
    return f"a server of {len(names)} robots ({listed}; shaper {first.shaper}) listens"
