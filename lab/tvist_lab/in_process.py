"""A robot in this process, as fast as it computes, behind the same client as one on the network."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from msgspec.structs import replace

from tvist_client.robot import Robot
from tvist_client.transports.loopback import LoopbackTransport
from tvist_controller.api import LoopbackHost, Setup
from tvist_server.config import ServeConfig


def free_setup(config: ServeConfig | None = None, **changes: object) -> Setup:
    """The default robot with a free clock and its truth told, or another one.

    Args:
        config: How it would be served, clock and truth included.
        changes: Fields of `ServeConfig` to change.

    Raises:
        ConfigError: A change names no field, or has no value for it.
    """
    from tvist_server.config import from_mapping

    if config is None:
        return from_mapping({"clock": "free", "truth": True, **changes}, "setup").setup()
    checked = from_mapping(changes, "setup")
    return replace(config, **{name: getattr(checked, name) for name in changes}).setup()


@asynccontextmanager
async def robot_in_process(setup: Setup) -> AsyncIterator[Robot]:
    """A client of a robot in this process."""
    async with Robot.over(LoopbackTransport(LoopbackHost(setup))) as robot:
        yield robot
