"""The limit of connections: silent clients are displaced, and some connections are reserved."""

import asyncio
import contextlib

from tvist_server.gateways.ur.connection import (
    LOCAL_PLACES,
    MAX_CONNECTIONS,
    UNREAD_FOR,
    ConnectionLimit,
)

from . import rtde_client
from .served_controller import PATIENCE, connect, connect_and_greet, lines, package, rtde, until


async def is_cut_off(reader):
    """Return True when the robot has closed a connection; fail if it stays open."""
    with contextlib.suppress(ConnectionError):
        await asyncio.wait_for(reader.read(), PATIENCE)
    return True


async def dashboard(served):
    """Connect a dashboard client that has sent a line."""
    reader, writer = await connect_and_greet(served)
    assert await lines(reader, writer, "robotmode") == ["Robotmode: RUNNING"]
    return reader, writer


async def readers(served, count):
    """Connect clients that only read."""
    before = len(served.interfaces._connections)
    found = [(await connect(served, "realtime"))[0] for _ in range(count)]
    await until(lambda: len(served.interfaces._connections) == before + count)
    return found


async def test_an_rtde_client_that_does_not_read_is_disconnected_after_10_s(later, served, caplog):
    reading, (_, sleeping) = (await rtde(served))[0], await rtde(served)
    port = sleeping.get_extra_info("sockname")[1]
    (stuck,) = [one for one in served.interfaces._connections if f":{port} " in one.peer]
    await served.tick()
    sleeping.transport.pause_reading()
    stuck._transport.write(bytes(20_000_000))  # more than the system holds for it
    later(UNREAD_FOR - 1.0)
    await served.tick(3)
    assert len(served.interfaces._connections) == 2
    later(2.0)
    await served.tick()
    await until(lambda: len(served.interfaces._connections) == 1)
    assert f":{port} of port" in caplog.text
    assert "has not read for 10 s" in caplog.text
    assert [await package(reading) for _ in range(5)] == [b"U"] * 5


async def test_a_new_client_displaces_the_one_silent_for_longest(later, served, caplog):
    old, _ = await dashboard(served)
    at_work, _ = await rtde(served)
    later(60.0)
    recent, writer = await dashboard(served)
    later(10.0)
    await readers(served, 228)
    await connect(served, "realtime")  # of 256 places 231 are taken
    assert await is_cut_off(old)
    assert "silent for 70 s, was closed to make room for the client 127.0.0.1" in caplog.text
    await served.tick()
    assert await package(at_work) == b"U"
    assert await lines(recent, writer, "robotmode") == ["Robotmode: RUNNING"]


async def test_served_clients_are_never_displaced(later, served, caplog):
    at_work, writer = await rtde(served)
    later(86_400.0)
    others = await readers(served, MAX_CONNECTIONS - 1)
    assert await is_cut_off((await connect(served, "primary"))[0])
    assert "was refused: 256 of 256 connections are in use" in caplog.text
    await served.tick()
    assert await package(at_work) == b"U"
    writer.write(rtde_client.package("P"))
    assert await package(at_work) == b"P"
    reader, _ = await connect(served, "primary")
    assert len(await reader.readexactly(5)) == 5
    assert await is_cut_off(at_work)  # paused, it is like any other that says nothing
    await served.tick()
    for other in others:
        assert len(await other.readexactly(1220)) == 1220


class LastingClient:
    """A client that may not be displaced."""

    dispensable = False


def test_some_connections_are_reserved_for_this_machine():
    said = []
    limit = ConnectionLimit(lambda: 100.0, said.append)
    while len(limit.taken) < MAX_CONNECTIONS - LOCAL_PLACES:
        limit.taken.add(LastingClient())
    assert not limit.make_room("far", local=False)
    assert "8 are kept for this machine" in said[0]
    for _ in range(LOCAL_PLACES):
        assert limit.make_room("near", local=True)
        limit.taken.add(LastingClient())
    assert not limit.make_room("near", local=True)
