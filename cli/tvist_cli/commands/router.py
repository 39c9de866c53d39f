"""`tvist router`: run a router for a fleet."""

import asyncio

from tvist_cli.failure import Misuse, failing_on
from tvist_cli.output import say


def router(
    *,
    listen: list[str] | None = None,
    connect: list[str] | None = None,
    rate: list[str] | None = None,
    robot: list[str] | None = None,
    security: str | None = None,
    insecure: bool = False,
) -> None:
    """Run a Zenoh router until Control+C: robots started with --connect and their clients reach each other through it.

    Args:
        listen: Listen on this Zenoh endpoint, repeatable [tcp/127.0.0.1:7447].
        connect: Connect to another router at this endpoint, such as that of another hall, repeatable.
        rate: Pass on at most this many states of each robot per second, repeatable: 10, or 10@INTERFACE for
            one network interface [all]. Commands, events and telemetry are not reduced.
        robot: Apply --rate to this robot, repeatable: [NAMESPACE/]NAME, or [NAMESPACE/]NAME*COUNT for NAME-1
            to NAME-COUNT; the others are not reduced. Without this option, all robots share the rate of one.
        security: Use this folder made by tvist keys, with the roles of robots, clients and routers. The
            endpoint is then tls/ADDRESS:PORT.
        insecure: Accept remote connections without TLS; anyone can move the robots, and act as one.
    """
    from tvist_client.transports.session import close_session
    from tvist_server.gateways.router import DEFAULT_ENDPOINT, Rate, robots_of, start_router
    from tvist_server.shutdown import Shutdown

    with failing_on(ValueError, exit_code=2):
        rates = [Rate.read(text) for text in rate or []]
        robots = [place for text in robot or [] for place in robots_of(text)]
    if robots and not rates:
        raise Misuse("robot needs --rate HZ, the rate of these robots: give it, or leave --robot out")
    endpoints, ending = listen or [DEFAULT_ENDPOINT], Shutdown()
    with ending.at_once(), failing_on(ValueError, exit_code=2):
        session = start_router(endpoints, connect or [], rates, robots, security=security, insecure=insecure)

    async def run() -> None:
        ended, loop = asyncio.Event(), asyncio.get_running_loop()
        ending.on_request(lambda: loop.call_soon_threadsafe(ended.set))
        await ended.wait()

    try:
        say(f"a router listens on {', '.join(endpoints)}. Press Control+C to stop.")
        asyncio.run(run())
    finally:
        close_session(session)
    ending.close()
