"""Functions shared by the commands that serve a robot."""

import asyncio
import os
import time
from collections.abc import Sequence

from tvist_cli.compiling import compile_if_new, compile_shown
from tvist_cli.failure import Failure, check_range
from tvist_cli.main import BEGAN
from tvist_cli.output import say
from tvist_controller.setup import Setup
from tvist_server.config import ServeConfig
from tvist_server.server import RecordingResult, Server
from tvist_server.shutdown import Shutdown
from tvist_server.workers import Workers


def serve_robots(config: ServeConfig) -> None:
    """Serve robots until a signal ends this process."""
    ending = Shutdown()
    if config.workers > 1:
        _several(config, ending)
        return
    # From here on, a signal must raise an exception, so that the server is closed.
    with ending.at_once():
        server = Server(config, prepare=compile_if_new)
    setups = [robot.setup for robot in server.robots]

    def ready() -> None:
        if server.granted:
            say(f"on time: {'; '.join(server.granted)}")
        _say_ready(setups, config)

    say_who_can_reach(server, config, len(setups))
    asyncio.run(server.run(ready, ending))
    ending.close()
    if server.failure is not None:
        raise Failure(server.failure)
    errors = say_recorded(server.recordings)
    if errors:
        raise Failure("; ".join(errors))
    leave(server, 0)


def compile_all(processes: int | None = None) -> None:
    """Compile all kernels in advance, in this number of processes."""
    check_range("compile", processes, 1)
    compile_shown(processes)
    say(f"everything is compiled, after {time.monotonic() - BEGAN:.0f} s")


def _several(config: ServeConfig, ending: Shutdown) -> None:
    with ending.at_once():
        workers = Workers(config, compile_if_new)
    say_who_can_reach(workers, config, len(workers.setups))
    try:
        workers.run(lambda: _say_ready(workers.setups, config), ending)
    finally:
        ending.close()
        errors = say_recorded(workers.recordings)
    if errors:
        raise Failure("; ".join(errors))


def _say_ready(setups: Sequence[Setup], config: ServeConfig) -> None:
    took = time.monotonic() - BEGAN
    spread = f" in {config.workers} processes" if config.workers > 1 else ""
    say(
        f"{introduction(setups, config.profile_in_force)} {config.place}{spread}, "
        f"clock {config.clock}; ready after {took:.1f} s. Press Control+C to stop."
    )


def introduction(setups: Sequence[Setup], profile: str | None) -> str:
    """Return the first message of a server: one robot with its settings, or the names of several robots."""
    first = setups[0]
    how = f"shaper {first.shaper}" + ("" if profile is None else f", profile {profile}")
    if len(setups) == 1:
        model = first.description.robot.model
        return f"{first.name} ({model}, {first.payload.mass:g} kg, {how}) listens"
    names = [setup.name for setup in setups]
    listed = ", ".join(names) if len(names) < 8 else f"{', '.join(names[:3])} … {names[-1]}"
    return f"a server of {len(names)} robots ({listed}; {how}) listens"


def say_who_can_reach(server: Server | Workers, config: ServeConfig, robots: int) -> None:
    """Print the addresses of UR's interfaces, and those at which anyone can move the robots."""
    for address, ports in server.ur:
        listed = ", ".join(f"{interface} {port}" for interface, port in ports.items())
        say(f"UR's interfaces are open on {address}: {listed}")
    if server.page is not None:
        say(f"figures for Prometheus are on {server.page}")
    whom = "this robot" if robots == 1 else "these robots"
    for endpoint in config.endpoints if config.insecure else ():
        say(f"anyone who can reach {endpoint} can move {whom}")


def say_recorded(recordings: Sequence[RecordingResult]) -> list[str]:
    """Print where each robot was recorded; return the errors that ended recordings."""
    for recording in recordings:
        if recording.error is None:
            note = f", {recording.dropped} messages dropped" if recording.dropped else ""
            say(f"recorded into {recording.place}{note}")
    return [recording.error for recording in recordings if recording.error is not None]


def leave(server: Server, code: int) -> None:
    """If the network would keep the process running, end it with an exit code; all else is already closed."""
    # Zenoh would wait ten seconds for a client that has stopped reading.
    if not server.left:
        os._exit(code)
