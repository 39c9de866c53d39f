"""Sockets of programs on a real network: allowed hosts, data, disconnections and limits of buffers."""

import asyncio
import contextlib

import pytest
from tests.server.ur.served_controller import until

from tvist_controller.programs.sockets import Close, Expire, Open, Send, Taken, Wait
from tvist_server.allowed_hosts import AllowedHosts
from tvist_server.gateways.sockets import MAX_UNREAD, MAX_UNSENT, ProgramSockets

HERE = "127.0.0.1"


class Side:
    """A robot's sockets and a machine that they connect to."""

    def __init__(self, sockets, server, heard, warned):
        self.sockets, self.heard, self.warned = sockets, heard, warned
        self.port = server.sockets[0].getsockname()[1]
        self.accepted = asyncio.Queue()

    async def connect(self, number=1, address=HERE, origin=HERE):
        self.sockets.carry_out([Open(number, origin, address, self.port)])
        await until(lambda: any(news.number == number for news in self.heard))
        return self.heard[-1].change

    def received(self):
        return b"".join(news.data for news in self.heard if news.change == "received")

    def changes(self):
        return [news.change for news in self.heard]


@pytest.fixture
async def side():
    heard, warned, writers = [], [], []
    sockets = ProgramSockets(heard.append, warned.append, AllowedHosts(()))

    async def accept(reader, writer):
        writers.append(writer)
        await side.accepted.put((reader, writer))

    server = await asyncio.start_server(accept, HERE, 0)
    side = Side(sockets, server, heard, warned)
    await sockets.open()
    yield side
    await sockets.shut()
    sockets.close()
    server.close()
    for writer in writers:
        writer.transport.abort()
    await asyncio.sleep(0)


async def test_a_socket_carries_data_both_ways_and_reports_its_end_once(side):
    assert await side.connect() == "opened"
    reader, writer = await side.accepted.get()
    side.sockets.carry_out([Send(1, b"hello")])
    assert await reader.readexactly(5) == b"hello"
    writer.write(b"well")
    await until(lambda: side.received() == b"well")
    writer.write(b"bye")
    writer.close()
    await until(lambda: "closed" in side.changes())
    side.sockets.carry_out([Send(1, b"too late"), Close(1)])
    await asyncio.sleep(0)
    assert side.received() == b"wellbye"
    assert side.changes().count("closed") == 1


async def test_a_closed_socket_delivers_sent_data_and_reports_nothing_more(side):
    await side.connect()
    reader, writer = await side.accepted.get()
    side.sockets.carry_out([Send(1, b"last words"), Close(1)])
    assert await reader.read() == b"last words"
    writer.write(b"late")
    with contextlib.suppress(ConnectionError):
        await writer.drain()
    assert side.changes() == ["opened"]


async def test_a_socket_closed_while_connecting_is_never_opened(side):
    side.sockets.carry_out([Open(1, HERE, HERE, side.port), Close(1)])
    assert await side.connect(2) == "opened"
    assert [news.number for news in side.heard] == [2]


@pytest.mark.parametrize("port", [1, None])
async def test_a_failed_connection_is_reported(side, port):
    side.port = port or side.port
    assert await side.connect(address="no.such.host.invalid" if port is None else HERE) == "failed"


@pytest.mark.parametrize(
    ("origin", "address", "allowed", "well"),
    [
        ("127.0.0.2", "localhost", (), True),
        ("192.168.1.5", "127.0.0.1", (), False),
        ("192.168.1.5", "localhost", ("localhost",), True),
    ],
)
async def test_a_program_connects_only_to_its_sender_and_allowed_hosts(side, origin, address, allowed, well):
    side.sockets._allowed = AllowedHosts(allowed)
    assert await side.connect(address=address, origin=origin) == ("opened" if well else "failed")
    assert bool(side.warned) is not well
    assert well or f"--ur-allow {address}" in side.warned[0]


REACHED = """
h 192.168.1.5 192.168.1.5, h 127.0.0.1 ::1, h 192.168.1.5 ::ffff:192.168.1.5, h 0.0.0.0 127.0.0.1,
h fe80::1 fe80::1%eth0, h 10.1.2.3, gripper 172.16.0.1, gripper 127.0.0.1 127.0.0.1, h ::1 ::ffff:127.20.3.4
"""
"""Names, addresses, and the machine that sent the program, if one did."""
NOT_REACHED = (
    "h 192.168.1.6 192.168.1.5, h 0.0.0.0 192.168.1.5, h 172.16.0.1, gripper 127.0.0.1, h ::1 ::ffff:10.0.0.2"
)


def test_allowed_hosts_by_name_network_and_sender():
    allowed = AllowedHosts(["10.0.0.0/8", "gripper"])
    for places, well in ((REACHED, True), (NOT_REACHED, False)):
        for place in places.split(","):
            name, address, origin = [*place.split(), None][:3]
            assert allowed.allows(name, address, origin) is well, place


async def test_a_flooding_sender_is_paused_until_the_program_reads(side):
    await side.connect()
    _, writer = await side.accepted.get()
    size = 64 * MAX_UNREAD
    writer.write(bytes(size))
    await until(lambda: len(side.received()) > MAX_UNREAD)
    for _ in range(2000):
        await asyncio.sleep(0)
    held = len(side.received())
    assert held < size // 4
    taken = 0
    async with asyncio.timeout(60):
        while taken < size:
            more = len(side.received()) - taken
            side.sockets.carry_out([Taken(1, more)] if more else [])
            taken += more
            await asyncio.sleep(0)
    assert side.received() == bytes(size)


async def test_a_peer_that_does_not_read_is_disconnected(side):
    await side.connect()
    _, writer = await side.accepted.get()
    writer.transport.pause_reading()
    for _ in range(400):
        side.sockets.carry_out([Send(1, bytes(MAX_UNSENT // 8))])
        await asyncio.sleep(0)
    await until(lambda: "closed" in side.changes())


async def test_received_data_is_reported_before_a_timeout(side):
    await side.connect()
    _, writer = await side.accepted.get()
    side.sockets.carry_out([Wait(7, 1)])
    writer.write(b"x")  # is with the system now, but the network's thread has not read it yet
    side.sockets.carry_out([Expire(7, 1, 0.0)])
    await until(lambda: "expired" in side.changes())
    assert side.changes() == ["opened", "received", "expired"]


@pytest.mark.parametrize("text", ["300.1.1.1", "10.0.0.0/40", "1.2.3", "a b", "gripper:50002", ""])
def test_an_invalid_allowed_host_is_refused(text):
    with pytest.raises(ValueError, match=r"ur_allow has .*must be an IP address, a network"):
        AllowedHosts(["gripper.lab", text])
