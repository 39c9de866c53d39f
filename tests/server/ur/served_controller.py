"""A controller behind its interfaces, and clients at them, all in the test's own loop."""

import asyncio
import struct
from collections import deque

from tests.controller.robots import Robot

from tvist_controller.host import Host
from tvist_controller.instruments.report import Sink
from tvist_protocol.codec import encode
from tvist_server.ur_ports import UrPorts

from . import rtde_client

EVERYWHERE = dict.fromkeys(UrPorts().open(), 0)  # a free port for each interface
PATIENCE = 60.0  # longest wait; what takes longer hangs [s]


class ControllerThread(Sink):
    """A controller that does the jobs of clients at once or, if `late`, when `answer` is called."""

    def __init__(self, *, late=False):
        self.controller = Robot().controller
        self.controller.session.release()
        self.host, self.kinds = Host(self.controller, self), []
        self._late, self._due = late, deque()

    def post(self, job):
        if self._late:
            self._due.append(job)
        else:
            job()

    def answer(self):
        while self._due:
            self._due.popleft()()

    def command(self, command, answer, origin=None):  # noqa: ARG002  as CommandIntake has it
        self.last = command

        def carry_out():
            self.kinds.append(type(command).__name__)
            answer(self.host.request(encode(command)))

        self.post(carry_out)

    def client_seen(self, name, session=""):
        """Do nothing: no test asks."""

    def client_gone(self, name, session=""):
        self.post(lambda: self.host.client_gone(name, session))

    def holder(self):
        lease = self.controller.session.lease
        return None if lease is None else lease.client


class ServedController(ControllerThread):
    """A controller behind UR interfaces, in the thread of the event loop; `tick` lets time pass."""

    def __init__(self):
        super().__init__()
        self.interfaces = None
        self.writers = []

    def report(self, report):
        self.interfaces.report(report)

    def event(self, event):
        self.interfaces.publish("event", event, b"")

    def io(self, io):
        self.interfaces.publish("io", io, b"")

    async def tick(self, count=1):
        for _ in range(count):
            self.host.tick()
            await asyncio.sleep(0)


async def connect(served, interface):
    reader, writer = await asyncio.open_connection("127.0.0.1", served.interfaces.ports[interface])
    served.writers.append(writer)
    return reader, writer


async def until(condition):
    async with asyncio.timeout(PATIENCE):
        while not condition():  # noqa: ASYNC110  what changes belongs to the loop
            await asyncio.sleep(0)


async def lines(reader, writer, *sent):
    answers = []
    for line in sent:
        writer.write(line.encode() + b"\n")
        answers.append((await reader.readline()).decode().strip())
    return answers


async def connect_and_greet(served):
    """Connect a client to the dashboard, and read the greeting."""
    reader, writer = await connect(served, "dashboard")
    await reader.readline()
    return reader, writer


async def package(reader):
    head = await asyncio.wait_for(reader.readexactly(3), PATIENCE)
    await reader.readexactly(struct.unpack(">H", head[:2])[0] - 3)
    return head[2:]


async def rtde(served, names=("timestamp",)):
    """Connect an RTDE client that receives samples."""
    reader, writer = await connect(served, "rtde")
    writer.write(rtde_client.version() + rtde_client.outputs(names) + rtde_client.package("S"))
    assert [await package(reader) for _ in range(3)] == [b"V", b"O", b"S"]
    return reader, writer
