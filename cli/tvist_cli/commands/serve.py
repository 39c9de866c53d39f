"""`tvist serve`: run a robot."""

import asyncio
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.misuse import lower
from tvist_cli.output import say
from tvist_cli.serving import (
    compile_if_new,
    introduction,
    leave,
    say_recorded,
    say_who_can_reach,
    ur_ports,
)

if TYPE_CHECKING:
    from tvist_controller.setup import Setup
    from tvist_server.config import ServeConfig
    from tvist_server.ending import Ending


def serve(
    *,
    name: str | None = None,
    robot: str | None = None,
    robots: str | None = None,
    workers: int | None = None,
    listen: list[str] | None = None,
    connect: list[str] | None = None,
    namespace: str | None = None,
    metrics: str | None = None,
    security: str | None = None,
    insecure: bool = False,
    profile: str | None = None,
    payload: float | None = None,
    overload: bool = False,
    shaper: str | None = None,
    shape_servo: bool = False,
    calibration: str | None = None,
    clock: str | None = None,
    speed: float | None = None,
    realtime_priority: bool = False,
    processor: int | None = None,
    lock_memory: bool = False,
    start: str | None = None,
    state: str | None = None,
    seed: int | None = None,
    record: str | None = None,
    keep: str | None = None,
    dump: str | None = None,
    truth: bool = False,
    quiet: Annotated[bool | None, Parameter(negative="--no-quiet")] = None,
    floor: Annotated[bool | None, Parameter(negative="--no-floor")] = None,
    compensate_sag: Annotated[bool | None, Parameter(negative="--no-compensate-sag")] = None,
    programs: str | None = None,
    ur: bool = False,
    ur_address: str | None = None,
    ur_port: list[str] | None = None,
    ur_allow: list[str] | None = None,
    config: str | None = None,
) -> None:
    """Run one or more robots on the network until Control+C, SIGTERM, SIGQUIT or the terminal closes.

    Args:
        name: Name of the robot on the network [ur5e].
        robot: Name of a robot that comes with the package, or path of a robot file [ur5e].
        robots: Serve several robots, given as `ROBOT[*COUNT]` separated by commas: `ur5e*2,other.toml` serves
            ur5e-1, ur5e-2 and other. Replaces --name and --robot.
        workers: Number of processes that the robots are spread over, behind the same endpoint; each further one uses
            one more core. If one dies, all end, with exit code 1 [1].
        listen: Zenoh endpoint to listen on, repeatable [tcp/127.0.0.1:7447; none with --connect].
        connect: Endpoint of a router through which clients reach the robot, repeatable: the robot uses the first that
            answers. If none does within 10 s, the command fails; a router that is lost later is looked for again.
        namespace: Words separated by / that precede the robot's keys, such as hall-3, so that robots of one name can
            share a network. Clients give the same --namespace.
        metrics: ADDRESS:PORT to publish figures for Prometheus on, over HTTP without encryption, or PORT of 127.0.0.1.
        security: Folder made by tvist keys. The endpoint is then tls/ADDRESS:PORT, and clients without a role have no
            access. With --connect, the folder of a robot, made by tvist keys --member; the router checks clients.
        insecure: Accept remote connections without TLS and do not authenticate clients; anyone can move the robot.
        profile: Set of defaults. ursim is like UR's simulator: it starts an arm of UR's kind in URSim's posture, with a
            payload of 0 kg, shaper none, --quiet, --no-floor and --compensate-sag. real starts in the same posture and
            is otherwise like a robot: it has the robot file's payload, noise, a floor, sag and shaper zv. Options
            that you give take precedence [ursim with --ur; without it, the defaults named at each option].
        payload: Mass of the disc on the flange in kg, both carried and declared to the controller [that of the robot
            file; 5 for the ur5e].
        overload: Start even if the payload exceeds the robot's rating. The drives may not hold it; the robot then makes
            a protective stop.
        shaper: Any name that tvist shapers lists, such as none, zv, auto or elastic; or
            FILE.py:NAME, which runs that file and adds your own shaper to those that clients can choose [zv].
        shape_servo: Shape servoj, speedj and speedl of programs too, where they begin at rest. Without this option they
            bypass the shaper, since their client usually closes a loop, to which the shaper would add its delay.
        calibration: Name of a calibration that comes with the package, or path of a calibration file; none for a robot
            that is yet to be identified [the one that comes with the package for this robot].
        clock: realtime, or lockstep, in which a client steps the simulation [realtime].
        speed: Simulation speed relative to real time [1].
        realtime_priority: Run the control loop with real-time priority (SCHED_FIFO), if the system permits it.
        processor: Run the control loop on this processor, counted from 0, and all other threads of the server on others
            [any].
        lock_memory: Keep the server's memory from being swapped out, if the system permits it.
        start: Pose to start in: a name from the robot file, such as Q1, Q2 or Q3, or joint angles in rad separated by
            commas [Q1].
        state: TOML or JSON file with the state to start in: any of q, payload (the carried one), mode, shaper, seed.
        seed: Seed of sensor noise and gear errors [0]. With several robots, the second uses seed + 1, and so on.
        record: MCAP file to record into. It must not exist, unless --keep is given. With several robots, each records
            into a file of its own, FILE-NAME.mcap.
        keep: Let the recording keep the last 90s, 10min or 2h, and at most twice as much, and forget what was before
            [it keeps all]. At a start, what an earlier run has left in FILE.mcap becomes FILE.earlier-1.mcap,
            FILE.earlier-2.mcap and so on; the five latest stay.
        dump: Folder to save the last second before a failure of the simulated arm to [the system's temporary folder].
        truth: Publish what a real robot cannot measure, such as the arm's deflection, on tvist/NAME/truth and in the
            recording.
        quiet: Simulate sensors without noise and angles with an encoder's resolution, for clients that wait until
            values stop changing [off].
        floor: Refuse motions that bring the arm or its payload to the floor of the robot file [on].
        compensate_sag: Let the drives lead by the angle that gravity twists the gears, so that the measured joint
            angles at rest are the target angles [off].
        programs: Folder with programs in URScript, NAME.script or NAME.urp, that clients load by their names. With
            several robots, a robot uses the folder of its name in it, if there is one.
        ur: Open UR's own interfaces as well: RTDE, real-time client, dashboard, primary and secondary, interpreter
            mode. The profile is then ursim, if you give no other.
        ur_address: IP address on which UR's interfaces listen; each further robot uses the next address [127.0.0.1].
        ur_port: Change the port of one UR interface, repeatable: rtde=31004, or dashboard=off to close it. The others
            are primary, secondary, realtime, interpreter, primary_read_only, secondary_read_only and
            realtime_read_only.
        ur_allow: Let programs open sockets to this machine too, repeatable: an IP address, a network such as
            192.168.1.0/24, or a name as programs write it [only the machine that sent the program].
        config: TOML file with any of these options; options on the command line take precedence.
    """
    given: dict[str, Any] = {
        "name": name, "robot": robot, "robots": robots, "workers": workers, "listen": listen, "connect": connect,
        "namespace": namespace, "metrics": metrics, "security": security,
        "insecure": insecure or None, "profile": lower(profile), "payload": payload,
        "overload": overload or None, "shaper": lower(shaper), "shape_servo": shape_servo or None,
        "calibration": calibration, "clock": lower(clock), "speed": speed,
        "realtime_priority": realtime_priority or None, "processor": processor,
        "lock_memory": lock_memory or None, "start": start, "state": state, "seed": seed,
        "record": record, "keep": keep, "dump": dump, "truth": truth or None, "quiet": quiet,
        "floor": floor, "compensate_sag": compensate_sag, "programs": programs,
        "ur": (ur or ur_address is not None or ur_port is not None) or None, "ur_address": ur_address,
        "ur_ports": ur_ports(ur_port), "ur_allow": ur_allow,
    }  # fmt: skip
    began = time.monotonic()
    from tvist_server.config import ConfigError, from_mapping, read_toml
    from tvist_server.ending import Ending
    from tvist_server.gateways.base import GatewayError
    from tvist_server.recording import RecorderError
    from tvist_server.server import Server

    with told(ConfigError, code=2):
        content = {} if config is None else read_toml(config)
        content |= {key: value for key, value in given.items() if value is not None}
        checked = from_mapping(content, "configuration" if config is None else f"configuration {config}")
        ending = Ending()
        if checked.workers > 1 and checked.processor is not None:
            raise ConfigError(
                f"processor is {checked.processor}: --workers needs one for each, so leave it out"
            )
        if checked.workers > 1:
            _several(checked, ending, began)
            return
        # Now there is something to clean up, which an exception sees to.
        with told(GatewayError, RecorderError), ending.at_once():
            server = Server(checked, prepare=compile_if_new)

    setups = [robot.setup for robot in server.robots]

    def ready() -> None:
        if server.granted:
            say(f"on time: {'; '.join(server.granted)}")
        _say_ready(setups, checked, began)

    say_who_can_reach(server, checked, len(setups))
    asyncio.run(server.run(ready, ending))
    ending.close()
    if server.failure is not None:
        raise Failure(server.failure)
    errors = say_recorded(server.recordings)
    if errors:
        raise Failure("; ".join(errors))
    leave(server, 0)


def _several(config: "ServeConfig", ending: "Ending", began: float) -> None:
    """Serve the robots in several processes."""
    from tvist_server.gateways.base import GatewayError
    from tvist_server.workers import Workers, WorkersError

    with told(WorkersError, GatewayError):
        with ending.at_once():
            workers = Workers(config, compile_if_new)
        say_who_can_reach(workers, config, len(workers.setups))
        try:
            workers.run(lambda: _say_ready(workers.setups, config, began), ending)
        finally:
            ending.close()
            errors = say_recorded(workers.recordings)
    if errors:
        raise Failure("; ".join(errors))


def _say_ready(setups: "Sequence[Setup]", config: "ServeConfig", began: float) -> None:
    took = time.monotonic() - began
    spread = f" in {config.workers} processes" if config.workers > 1 else ""
    say(
        f"{introduction(setups, config.profile_in_force)} {config.place}{spread}, "
        f"clock {config.clock}; ready after {took:.1f} s. Press Control+C to stop."
    )
