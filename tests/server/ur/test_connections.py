"""The limit of connections: silent clients are displaced, and some connections are reserved."""

import asyncio
import struct
from dataclasses import dataclass

from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_server.gateways.ur.connection import (
    LOCAL_PLACES,
    MAX_CONNECTIONS,
    UNREAD_FOR,
    ConnectionLimit,
)

from . import rtde_client
from .desks import PATIENCE, connect, connect_and_greet, lines, until


async def is_cut_off(reader):
    """Whether there is an end to what a client reads; of a connection that stays there is none."""
    try:
        async with asyncio.timeout(PATIENCE):
            await reader.read()
    except ConnectionError:
        pass
    return True


async def package(reader):
    """Kind of the next package of RTDE."""
    head = await asyncio.wait_for(reader.readexactly(3), PATIENCE)
    await reader.readexactly(struct.unpack(">H", head[:2])[0] - 3)
    return head[2:]


async def rtde(desk):
    """A client of RTDE that is being served."""
    reader, writer = await connect(desk, "rtde")
    writer.write(rtde_client.version() + rtde_client.outputs(["timestamp"]) + rtde_client.package("S"))
    assert [await package(reader) for _ in range(3)] == [b"V", b"O", b"S"]
    return reader, writer


async def dashboard(desk):
    """A client of the dashboard that has said something."""
    reader, writer = await connect_and_greet(desk)
    assert await lines(reader, writer, "robotmode") == ["Robotmode: RUNNING"]
    return reader, writer


async def readers(desk, count):
    """So many clients that only read."""
    before = len(desk.interfaces._connections)
    found = [(await connect(desk, "realtime"))[0] for _ in range(count)]
    await until(lambda: len(desk.interfaces._connections) == before + count)
    return found


async def test_an_rtde_client_that_does_not_read_is_disconnected_after_10_s(later, desk, caplog):
    reading, (_, sleeping) = (await rtde(desk))[0], await rtde(desk)
    port = sleeping.get_extra_info("sockname")[1]
    (stuck,) = [one for one in desk.interfaces._connections if f":{port} " in one.peer]
    await desk.tick()
    sleeping.transport.pause_reading()
    stuck._transport.write(bytes(20_000_000))  # more than the system holds for it
    later(UNREAD_FOR - 1.0)
    await desk.tick(3)
    assert len(desk.interfaces._connections) == 2
    later(2.0)
    await desk.tick()
    await until(lambda: len(desk.interfaces._connections) == 1)
    assert f":{port} of port" in caplog.text
    assert "has not read for 10 s" in caplog.text
    assert [await package(reading) for _ in range(5)] == [b"U"] * 5


async def test_a_new_client_displaces_the_one_silent_for_longest(later, desk, caplog):
    old, _ = await dashboard(desk)
    served, _ = await rtde(desk)
    later(60.0)
    recent, writer = await dashboard(desk)
    later(10.0)
    await readers(desk, 228)
    await connect(desk, "realtime")  # of 256 places 231 are taken
    assert await is_cut_off(old)
    assert "silent for 70 s, was closed to make room for the client 127.0.0.1" in caplog.text
    await desk.tick()
    assert await package(served) == b"U"
    assert await lines(recent, writer, "robotmode") == ["Robotmode: RUNNING"]


async def test_served_clients_are_never_displaced(later, desk, caplog):
    served, writer = await rtde(desk)
    later(86_400.0)
    others = await readers(desk, MAX_CONNECTIONS - 1)
    assert await is_cut_off((await connect(desk, "primary"))[0])
    assert "was refused: 256 of 256 connections are in use" in caplog.text
    await desk.tick()
    assert await package(served) == b"U"
    writer.write(rtde_client.package("P"))
    assert await package(served) == b"P"
    reader, _ = await connect(desk, "primary")
    assert len(await reader.readexactly(5)) == 5
    assert await is_cut_off(served)  # paused, it is like any other that says nothing
    await desk.tick()
    for other in others:
        assert len(await other.readexactly(1220)) == 1220


@dataclass(eq=False)
class Client:
    heard: float = 0.0
    dispensable: bool = False
    peer: str = "x"
    gone: bool = False

    def disconnect(self):
        self.gone = True


def places(*clients):
    said = []
    made = ConnectionLimit(lambda: 100.0, said.append)
    made.taken.update(clients)
    return made, said


def test_some_connections_are_reserved_for_this_machine():
    house, said = places(*(Client() for _ in range(MAX_CONNECTIONS - LOCAL_PLACES)))
    assert not house.make_room("far", local=False)
    assert "8 are kept for this machine" in said[0]
    for _ in range(LOCAL_PLACES):
        assert house.make_room("near", local=True)
        house.taken.add(Client())
    assert not house.make_room("near", local=True)


@examples(20)
@given(st.lists(st.tuples(st.floats(0, 100), st.booleans()), min_size=200, max_size=MAX_CONNECTIONS))
def test_only_the_longest_silent_dispensable_client_is_displaced(clients):
    all_of_them = [Client(*client) for client in clients]
    house, said = places(*all_of_them)
    came_in = house.make_room("new", local=True)
    gone = [client for client in all_of_them if client.gone]
    candidates = [client for client in all_of_them if client.dispensable]
    if len(clients) < 0.9 * MAX_CONNECTIONS or not candidates:
        assert not gone
    else:
        (one,) = gone
        assert one.heard == min(client.heard for client in candidates)
        assert one not in house.taken
    assert came_in == (len(house.taken) < MAX_CONNECTIONS)
    assert len(said) == len(gone) + (not came_in)
