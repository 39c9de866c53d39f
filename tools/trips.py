"""`python -m tools.trips`: through which modules a set-point, a tick, a package of RTDE and a program travel.

Everything runs in one thread and without a clock, so that a profile sees the whole way; Zenoh's and asyncio's own
frames are missing, and all that is compiled counts as one module. Runs in a checkout.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from struct import pack
from types import FrameType
from typing import Any

from numba.core.dispatcher import Dispatcher
from rich.console import Console
from rich.table import Table

from tvist_controller.instruments.snapshot import Instruments
from tvist_protocol.codec import encode
from tvist_protocol.commands import ServoStart, Setpoint, TakeControl
from tvist_protocol.io import Io
from tvist_protocol.programs import ProgramRun
from tvist_protocol.stream import State
from tvist_server.config import ServeConfig
from tvist_server.gateways.base import Gateway, Message
from tvist_server.gateways.ur.interfaces import UrInterfaces
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease
from tvist_server.gateways.ur.rtde.board import Board
from tvist_server.gateways.ur.rtde.session import RtdeSession
from tvist_server.robot import ServedRobot

COMPILED = "what is compiled"
HOUSE = Path(__file__).parents[1]
SERVO = """def servo():
  while True:
    servoj([read_input_float_register(24), -3.1, 0, -1.6, 0, 0], 0, 0, 0.002, 0.1, 300)
  end
end
"""
MOVE = "def move():\n  movel(pose_add(get_actual_tcp_pose(), p[0, 0, 0.05, 0, 0, 0]), a=1.2, v=0.25)\nend\n"
REGISTERS = ",".join(f"input_double_register_{number}" for number in range(24, 30))


@dataclass
class Trip:
    """What a profile has seen."""

    modules: dict[str, None] = field(default_factory=dict)
    """Modules, in the order in which they were entered."""
    functions: set[int] = field(default_factory=set)
    calls: int = 0
    moves: int = 0
    """Number of calls and returns that lead from one module to another."""


def travelled(way: Callable[[], object]) -> Trip:
    """Run a function, and return what it has gone through."""
    trip, here, kernels = Trip(), [""], _kernels()

    def see(frame: FrameType, event: str, _: object) -> None:
        file = frame.f_code.co_filename
        if event not in {"call", "return"} or not file.startswith(str(HOUSE)) or ".venv" in file:
            return
        module = str(Path(file).relative_to(HOUSE))
        if module == "tools/trips.py":
            return
        if (file, frame.f_code.co_name) in kernels:
            module = COMPILED
        if event == "call":
            trip.modules[module] = None
            trip.functions.add(id(frame.f_code))
            trip.calls += 1
        trip.moves += module != here[0]
        here[0] = module

    sys.setprofile(see)
    try:
        way()
    finally:
        sys.setprofile(None)
    return trip


def _kernels() -> set[tuple[str, str]]:
    """Files and names of all functions that are compiled: numba lets a profile see them as if they were not."""
    found = (vars(module).values() for name, module in sys.modules.items() if name.startswith("tvist"))
    codes = [one.py_func.__code__ for values in found for one in values if isinstance(one, Dispatcher)]
    return {(code.co_filename, code.co_name) for code in codes}


class Window(Gateway):
    """A gateway that hands states to a function."""

    def __init__(self) -> None:
        self.seen: Callable[[State], object] = lambda _: None
        self.io: Io | None = None

    def publish(self, topic: str, message: Message, payload: bytes) -> None:  # noqa: ARG002
        """Take a message."""
        if isinstance(message, Io):
            self.io = message
        elif isinstance(message, State):
            self.seen(message)

    async def open(self) -> None:
        """Nobody comes."""

    async def shut(self) -> None:
        """Nobody was there."""

    def close(self) -> None:
        """Nothing is open."""


class Bench:
    """A robot whose ticks are made here."""

    def __init__(self) -> None:
        setup = ServeConfig(profile="ursim", floor=False, clock="lockstep").setup()
        self.robot = ServedRobot(setup, None, Path("/tmp"))  # noqa: S108  nothing fails
        self.window = Window()
        self.robot.open([self.window])
        self.host = self.robot.driven.host
        self.robot.request(TakeControl(client="ur-127.0.0.1", lease_s=600.0))
        self.token = self.robot.controller.session.lease.token  # type: ignore[union-attr]
        self.tick(20)

    def tick(self, count: int = 1) -> None:
        """What the clock's thread and the courier's do."""
        for _ in range(count):
            self.robot.driven.jobs.do_waiting()
            self.host.tick()
            self.robot.hand_on()


def setpoint() -> Trip:
    """A set-point from the network's thread to the state that gateways get, in the middle of a stream."""
    bench = Bench()
    q = bench.robot.controller.setup.q
    bench.robot.request(
        ServoStart(token=bench.token, period=0.002, velocity=1.0, acceleration=2.0, jerk=100.0)
    )

    def send(number: int) -> None:
        where = (q[0] + 1e-6 * number * number, *q[1:])
        bench.robot.reception.setpoint(encode(Setpoint(token=bench.token, sequence=number, q=where)))
        bench.tick()

    for number in range(1, 60):
        send(number)
    return travelled(lambda: send(60))


def empty() -> Trip:
    """A tick in which nothing is due, without what hands its state on."""
    bench = Bench()
    return travelled(bench.robot.driven.host.tick)


def rtde() -> Trip:
    """A package with six registers from a client of RTDE, until the program that reads them has servoed in a tick."""
    bench = Bench()
    robot = bench.robot
    interfaces = UrInterfaces(robot.reception, robot.setup.description, "ur5e", "127.0.0.1", {})
    lease = HostLease(robot.reception, "127.0.0.1", lambda call: call())
    lease.adopt(bench.token, bench)
    session = RtdeSession(interfaces.robot, ConnectionControl(lease), lambda _: None, {1: Board()})
    instruments = Instruments(robot.setup.description)
    bench.tick()

    def see(state: State) -> None:
        assert bench.window.io is not None
        interfaces.robot.latest = instruments.snapshot(state, bench.window.io)

    bench.window.seen = see
    robot.repeat()
    robot.hand_on()
    for kind, content in ((86, b"\x00\x02"), (73, REGISTERS.encode())):
        session.receive(pack(">HB", len(content) + 3, kind) + content)
    robot.request(ProgramRun(token=bench.token, text=SERVO))
    bench.tick(50)
    start = robot.setup.q

    def send(number: int) -> None:
        values = (start[0] + 1e-6 * number, *start[1:])
        session.receive(pack(">HBB6d", 52, 85, 1, *values))
        bench.tick()

    for number in range(1, 40):
        send(number)
    return travelled(lambda: send(40))


def movel() -> Trip:
    """A program with a straight line, from its text to the first tick of motion."""
    bench = Bench()
    robot = bench.robot

    def run() -> None:
        robot.request(ProgramRun(token=bench.token, text=MOVE))
        while robot.controller.cycle.mode.at_rest:
            robot.driven.jobs.do_waiting()
            robot.driven.host.tick()

    return travelled(run)


TRIPS: dict[str, Callable[[], Trip]] = {
    "set-point to state": setpoint,
    "empty tick": empty,
    "RTDE package to servoj": rtde,
    "URScript movel to motion": movel,
}


def main(arguments: list[str]) -> None:
    """Print a row for each trip, and the modules of those that are named."""
    parser = argparse.ArgumentParser(prog="python -m tools.trips", description=__doc__)
    parser.add_argument("show", nargs="*", help="words of the trips whose modules to print")
    shown = parser.parse_args(arguments).show
    table = Table("trip", "packages", "modules", "functions", "calls", "moves between modules")
    listed: list[Any] = []
    for name, make in TRIPS.items():
        trip = make()
        packages = {module.split("/")[0] for module in trip.modules}
        table.add_row(
            name, *map(str, (len(packages), len(trip.modules), len(trip.functions), trip.calls, trip.moves))
        )
        if any(word in name for word in shown):
            listed += [f"\n{name}", *(f"  {module}" for module in trip.modules)]
    console = Console()
    console.print(table)
    for line in listed:
        console.print(line, highlight=False)


if __name__ == "__main__":
    main(sys.argv[1:])
