"""`tvist serve`: run a robot."""

import asyncio
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, told
from tvist_cli.output import say
from tvist_cli.robot_options import configuration, with_robot_options
from tvist_cli.serving import (
    BEGAN,
    compile_if_new,
    introduction,
    leave,
    say_recorded,
    say_who_can_reach,
)
from tvist_server.config import ConfigError, ServeConfig

if TYPE_CHECKING:
    from tvist_controller.setup import Setup
    from tvist_server.ending import Ending


@with_robot_options()
def serve(*, config: str | None = None, **given: Any) -> None:
    """Run one or more robots on the network until Control+C, SIGTERM, SIGQUIT or the terminal closes.

    Args:
        config: TOML file with any of the other options; options on the command line take precedence.
        given: Fields of `ServeConfig`.
    """
    from tvist_server.ending import Ending
    from tvist_server.gateways.base import GatewayError
    from tvist_server.recording import RecorderError
    from tvist_server.server import Server

    checked = configuration(given, config)
    with told(ConfigError, code=2):
        ending = Ending()
        if checked.workers > 1 and checked.processor is not None:
            raise ConfigError(
                f"processor is {checked.processor}: --workers needs one for each, so leave it out"
            )
        if checked.workers > 1:
            _several(checked, ending)
            return
        # Now there is something to clean up, which an exception sees to.
        with told(GatewayError, RecorderError), ending.at_once():
            server = Server(checked, prepare=compile_if_new)

    setups = [robot.setup for robot in server.robots]

    def ready() -> None:
        if server.granted:
            say(f"on time: {'; '.join(server.granted)}")
        _say_ready(setups, checked)

    say_who_can_reach(server, checked, len(setups))
    asyncio.run(server.run(ready, ending))
    ending.close()
    if server.failure is not None:
        raise Failure(server.failure)
    errors = say_recorded(server.recordings)
    if errors:
        raise Failure("; ".join(errors))
    leave(server, 0)


def _several(config: ServeConfig, ending: "Ending") -> None:
    """Serve the robots in several processes."""
    from tvist_server.gateways.base import GatewayError
    from tvist_server.workers import Workers, WorkersError

    with told(WorkersError, GatewayError):
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


def _say_ready(setups: "Sequence[Setup]", config: ServeConfig) -> None:
    took = time.monotonic() - BEGAN
    spread = f" in {config.workers} processes" if config.workers > 1 else ""
    say(
        f"{introduction(setups, config.profile_in_force)} {config.place}{spread}, "
        f"clock {config.clock}; ready after {took:.1f} s. Press Control+C to stop."
    )
