"""`tvist serve`: run a robot."""

import asyncio
import gc
import time
from collections.abc import Sequence
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import say
from tvist_cli.robot_options import configuration, with_robot_options
from tvist_cli.serving import (
    BEGAN,
    compile_if_new,
    compile_shown,
    introduction,
    leave,
    say_recorded,
    say_who_can_reach,
)
from tvist_controller.setup import Setup
from tvist_server.config import ServeConfig
from tvist_server.ending import Ending
from tvist_server.gateways.base import GatewayError
from tvist_server.kernels import KernelsError
from tvist_server.option_values import StartError
from tvist_server.recording import RecorderError
from tvist_server.server import Server
from tvist_server.workers import Workers, WorkersError


@with_robot_options()
def serve(
    *,
    compile_only: Annotated[
        list[int] | None, Parameter(name="--compile", consume_multiple=(0, 1), allow_repeating=False)
    ] = None,
    config: str | None = None,
    **given: Any,
) -> None:
    """Run one or more robots on the network until Control+C, SIGTERM, SIGQUIT or the terminal closes.

    The first start after an installation or an update compiles what a robot computes at every tick and in its plans for
    this processor. Machine code is kept in the user's cache folder, or in the folder that NUMBA_CACHE_DIR names.

    Args:
        compile_only: Only compile, so that no start has to, in as many processes as the number says [one on each
            processor]; serve nothing.
        config: TOML file with any of the other options; options on the command line take precedence.
        given: Fields of `ServeConfig`.
    """
    if compile_only is not None:
        if given or config is not None:
            raise Failure("--compile serves nothing: leave the other options out", code=2)
        _compile(*compile_only)
        return
    gc.freeze()
    gc.enable()
    checked = configuration(given, config)
    with told(StartError, code=2):
        ending = Ending()
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


def _compile(processes: int | None = None) -> None:
    """Compile ahead, in this number of processes."""
    if processes is not None and processes < 1:
        raise Failure(f"compile is {processes}: must be at least 1", code=2)
    with told(KernelsError):
        compile_shown(processes)
    say(f"everything is compiled, after {time.monotonic() - BEGAN:.0f} s")


def _several(config: ServeConfig, ending: Ending) -> None:
    """Serve the robots in several processes."""
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


def _say_ready(setups: Sequence[Setup], config: ServeConfig) -> None:
    took = time.monotonic() - BEGAN
    spread = f" in {config.workers} processes" if config.workers > 1 else ""
    say(
        f"{introduction(setups, config.profile_in_force)} {config.place}{spread}, "
        f"clock {config.clock}; ready after {took:.1f} s. Press Control+C to stop."
    )
