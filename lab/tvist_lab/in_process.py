"""A robot in this process, as fast as it computes, with the same client as a robot on the network."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from msgspec.structs import replace

from tvist_client.robot import Robot
from tvist_client.transports.loopback import LoopbackTransport
from tvist_controller.api.line import Setup
from tvist_controller.api.robot import LoopbackHost
from tvist_server.config import ServeConfig


def free_setup(config: ServeConfig | None = None, **changes: object) -> Setup:
    """Return a setup with a free clock and published truth, by default of the default robot.

    Args:
        config: Configuration to start from, with its own truth; since nothing in this process follows the wall clock,
            `realtime` becomes `free`.
        changes: Fields of `ServeConfig` to change.

    Raises:
        StartError: A change names no field, or has an invalid value.
    """
    from tvist_server.config import from_mapping

    if config is None:
        return from_mapping({"clock": "free", "truth": True, **changes}, "setup").setup()
    checked = from_mapping(changes, "setup")
    timeless: dict[str, object] = {"clock": "free"} if config.clock == "realtime" else {}
    return replace(config, **(timeless | {name: getattr(checked, name) for name in changes})).setup()


@asynccontextmanager
async def robot_in_process(setup: Setup) -> AsyncIterator[Robot]:
    """Run a robot in this process, and yield a client of it."""
    async with Robot.over(LoopbackTransport(LoopbackHost(setup))) as robot:
        yield robot
