"""What the tests of UR's interfaces share: a control that records, and snapshots of a real controller."""

import asyncio
import contextlib
from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import msgspec
import pytest
from tests.controller import robots
from tests.controller.robots import UR5E

from tvist_controller.instruments.snapshot import Instruments
from tvist_protocol import commands as c
from tvist_protocol.io import Io
from tvist_protocol.programs import ProgramLoad
from tvist_protocol.replies import Done, Refused
from tvist_server.gateways.ur.deferred import Deferred
from tvist_server.gateways.ur.interfaces import UrInterfaces

from .served_controller import EVERYWHERE, ServedController, until

TOKEN = "the-token"


class FakeControl:
    """Stands in for a connection's access to the controller.

    It records commands in `commands` and answers them at once with `reply`. After `refuse(code, why)` it refuses
    them; after `wait()` it answers only at `answer()`. It has no program `nothing.urp`.
    """

    peer = "the client 10.0.0.2:50000 of port 30001"
    host = "10.0.0.2"

    def __init__(self):
        self.commands = []
        self.reply = Done()
        self.held_by_other = False
        self.left = 0
        self._waiting = None

    def change(self, command):
        return self.ask(command(TOKEN))

    def ask(self, command):
        self.commands.append(command)
        later = Deferred()
        if isinstance(command, ProgramLoad) and command.name == "nothing.urp":
            later.set(Refused(code="out_of_range", where="name", why="there is no nothing.urp"))
        elif self._waiting is None:
            later.set(self.reply)
        else:
            self._waiting.append(later)
        return later

    def asked(self, reply):
        later = Deferred()
        later.set(reply)
        return later

    def refuse(self, code="no_control", why="another client has control: 'a'", where="", limit=None):
        self.reply = Refused(code=code, where=where, why=why, limit=limit)

    def wait(self):
        self._waiting = self._waiting or []

    def answer(self, reply=None, *, keep=False):
        """Answer all waiting commands; with `keep`, commands that these answers cause wait again."""
        waiting, self._waiting = self._waiting or [], [] if keep else None
        for later in waiting:
            later.set(reply or self.reply)

    def lasting(self):
        return self

    def deliver(self, answer):
        answer()

    def leave(self):
        """Count the end of an access."""
        self.left += 1

    def of(self, kind):
        return [command for command in self.commands if isinstance(command, kind)]


@cache
def controller_at_rest():
    return robots.Robot(clock="lockstep").controller


def io(**changes) -> Io:
    """Return terminals that are all off, with the paper's payload declared and some changes."""
    return msgspec.structs.replace(controller_at_rest().io(), **changes)


class Robot(robots.Robot):
    """A controller in lockstep whose instruments read every tick."""

    def __init__(self, description=UR5E, *, io_changes=None, **changes):
        super().__init__(description, clock="lockstep", **changes)
        self.instruments = Instruments(description)
        self.io = io(**({"payload": self.controller.declared} | (io_changes or {})))

    def tick(self, count=1):
        """Tick, and return the last tick's snapshot."""
        for _ in range(count):
            snapshot = self.instruments.snapshot(super().tick(), self.io)
        return snapshot


@pytest.fixture
def control() -> FakeControl:
    return FakeControl()


@pytest.fixture
def sent() -> list[bytes]:
    """Bytes that a session has sent: pass `sent.append` as its `send`."""
    return []


@pytest.fixture(scope="session")
def ur5e() -> Callable[..., Robot]:
    return Robot


@pytest.fixture(scope="session")
def snapshots():
    """A hundred snapshots of consecutive ticks of a moving robot."""
    robot = Robot()
    robot.send(c.MoveJ, q=tuple(UR5E.poses["Q3"]))
    return [robot.tick() for _ in range(100)]


@pytest.fixture
def snapshot(snapshots):
    return snapshots[-1]


@pytest.fixture
def robot(snapshots) -> SimpleNamespace:
    """State that all interfaces of a robot share, without programs."""
    told, reported = [], []
    return SimpleNamespace(
        description=UR5E,
        name="ur5e",
        serial="20245500001",
        latest=snapshots[-1],
        tell=told.append,
        told=told,
        report=reported.append,
        report_refusal=reported.append,
        reported=reported,
    )


@pytest.fixture
async def later(monkeypatch):
    """Stop the loop's clock; return a function that advances it [s]."""
    loop = asyncio.get_running_loop()
    passed = [loop.time()]
    monkeypatch.setattr(loop, "time", lambda: sum(passed))
    return passed.append


@pytest.fixture
async def make_served():
    """Return a function that makes a controller with interfaces, given their ports and options."""
    made = []

    def make(ports=EVERYWHERE, **options):
        made.append(served := ServedController())
        served.interfaces = UrInterfaces(served, UR5E, "ur5e", "127.0.0.1", ports, **options)
        return served

    yield make
    for served in made:
        for writer in served.writers:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
        await served.interfaces.shut()
        await until(lambda served=served: not served.interfaces._connections)
        served.interfaces.close()


@pytest.fixture
async def served(make_served):
    """A controller after its first tick, with open interfaces."""
    served = make_served()
    await served.tick()
    await served.interfaces.open()
    return served
