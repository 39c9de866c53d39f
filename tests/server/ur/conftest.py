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

from .desks import EVERYWHERE, Desk, until

TOKEN = "the-token"


class FakeControl:
    """Stands for the way to the controller.

    Commands are recorded in `commands` and answered at once with `reply`; `refuse(code, why)` makes them refused,
    `wait()` keeps the answers back until `answer()`. There is no program `nothing.urp`.
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
        """A reply that comes at once."""
        later = Deferred()
        later.set(reply)
        return later

    def refuse(self, code="no_control", why="another client has control: 'a'", where="", limit=None):
        self.reply = Refused(code=code, where=where, why=why, limit=limit)

    def wait(self):
        self._waiting = self._waiting or []

    def answer(self, reply=None, *, keep=False):
        """Give every answer that is due; to one that asks again in it, too, unless further ones are kept back."""
        waiting, self._waiting = self._waiting or [], [] if keep else None
        for later in waiting:
            later.set(reply or self.reply)

    def lasting(self):
        return self

    def deliver(self, answer):
        answer()

    def leave(self):
        """What lasted is over."""
        self.left += 1

    def of(self, kind):
        """The recorded commands of one kind."""
        return [command for command in self.commands if isinstance(command, kind)]


@cache
def controller_at_rest():
    return robots.Robot(clock="lockstep").controller


def io(**changes) -> Io:
    """Everything off, the paper's payload declared."""
    return msgspec.structs.replace(controller_at_rest().io(), **changes)


class Robot(robots.Robot):
    """A controller in lockstep, and instruments that read each of its ticks."""

    def __init__(self, description=UR5E, *, io_changes=None, **changes):
        super().__init__(description, clock="lockstep", **changes)
        self.instruments = Instruments(description)
        self.io = io(**({"payload": self.controller.declared} | (io_changes or {})))

    def tick(self, count=1):
        """The snapshot of the last of so many ticks; each is read."""
        for _ in range(count):
            snapshot = self.instruments.snapshot(super().tick(), self.io)
        return snapshot


@pytest.fixture
def control() -> FakeControl:
    return FakeControl()


@pytest.fixture
def sent() -> list[bytes]:
    """What a session sent: pass `sent.append` as its `send`."""
    return []


@pytest.fixture(scope="session")
def ur5e() -> Callable[..., Robot]:
    """Makes robots."""
    return Robot


@pytest.fixture(scope="session")
def snapshots():
    """A hundred snapshots of consecutive ticks of one that moves."""
    robot = Robot()
    robot.send(c.MoveJ, q=tuple(UR5E.poses["Q3"]))
    return [robot.tick() for _ in range(100)]


@pytest.fixture
def snapshot(snapshots):
    return snapshots[-1]


@pytest.fixture
def robot(snapshots) -> SimpleNamespace:
    """What all interfaces of a robot share, as far as no interface is tested."""
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
    """The loop's clock stands, and jumps by so many seconds."""
    loop = asyncio.get_running_loop()
    passed = [loop.time()]
    monkeypatch.setattr(loop, "time", lambda: sum(passed))
    return passed.append


@pytest.fixture
async def make_desk():
    """Makes a controller with interfaces, whose arguments are the ports and the options of UrInterfaces."""
    made = []

    def make(ports=EVERYWHERE, **options):
        made.append(desk := Desk())
        desk.interfaces = UrInterfaces(desk, UR5E, "ur5e", "127.0.0.1", ports, **options)
        return desk

    yield make
    for desk in made:
        for writer in desk.writers:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()
        await desk.interfaces.shut()
        await until(lambda desk=desk: not desk.interfaces._connections)
        desk.interfaces.close()


@pytest.fixture
async def desk(make_desk):
    """A robot that has made its first tick, for which its interfaces would wait."""
    desk = make_desk()
    await desk.tick()
    await desk.interfaces.open()
    return desk
