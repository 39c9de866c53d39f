"""Helper processes for measurements; they end when their stdin closes.

    python -m benchmarks.helpers NAME ARGUMENT…

A line on stdout reports that one is ready. Some then carry out each line on stdin, and answer with a line.
"""

import ctypes
import gc
import selectors
import socket
import struct
import sys
import time
from asyncio.subprocess import PIPE, Process, create_subprocess_exec
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager

import zenoh
from zenoh.handlers import Callback

from tvist_client.transports.session import close_session, open_session
from tvist_controller.api.robot import Host, LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_plant.plant import PERIOD
from tvist_protocol import keys
from tvist_protocol.codec import decode
from tvist_protocol.stream import State
from tvist_server.gateways.network import REALTIME, open_router
from tvist_server.gateways.ur.rtde.variables import OUTPUTS
from tvist_server.rtde.codec import PackageKind, PackageReader, package
from tvist_server.schedule import Schedule

ROBOT = "bare"  # name of the robot whose states `bare_tick` publishes
SET_TIMER_SLACK = 29
"""prctl option for the largest delay of this thread's wake-ups [ns]; a served robot sets it, too."""


@asynccontextmanager
async def helper(name: str, *arguments: str) -> AsyncIterator[Process]:
    """Run a function of this module until the block ends; it is ready when the block starts."""
    command = [sys.executable, "-m", "benchmarks.helpers", name, *arguments]
    # In its own session it does not receive Control+C.
    process = await create_subprocess_exec(*command, stdin=PIPE, stdout=PIPE, start_new_session=True)
    assert process.stdout is not None
    try:
        if not await process.stdout.readline():
            raise RuntimeError(f"{name} has ended before it was ready")
        yield process
        await process.communicate(b"")
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


async def asked(process: Process, words: str) -> float:
    """Send a line to a helper, and return the figure that it answers."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(f"{words}\n".encode())
    return float(await process.stdout.readline())


def observers(endpoint: str, robot: str, count: str) -> None:
    """Read every state of a robot, or of all (`*`), with a separate connection for each observer."""
    sessions = [open_session(endpoint) for _ in range(int(count))]

    def read(sample: zenoh.Sample) -> None:
        decode(State, sample.payload.to_bytes())

    for session in sessions:
        session.declare_subscriber(f"{keys.PREFIX}/{robot}/state", Callback(read, indirect=False))
        list(session.get(f"{keys.PREFIX}/{robot}/info"))  # the answer comes after the subscription is active
    print("ready", flush=True)
    sys.stdin.read()
    for session in sessions:
        close_session(session)


def recipe(number: int) -> list[str]:
    """Return 22 variables, about as many as real clients request; all recipes differ, but share some."""
    pool = [name for name in OUTPUTS if name.startswith(("target", "actual", "joint", "robot", "safety"))]
    return ["timestamp", *(pool[(7 * number + 3 * k + k // 11) % len(pool)] for k in range(21))]


def rtde_clients(address: str, port: str, count: str, recipes: str, bare: str = "") -> None:
    """Read packages of RTDE from a robot at 500 Hz, or as many bytes from `bare_send`."""
    clients = []
    for number in range(int(count)):
        names = recipe(number % int(recipes))
        client = socket.create_connection((address, int(port)), 10.0)
        if bare:
            size = len(package(PackageKind.DATA, bytes(1 + sum(OUTPUTS[name].size for name in names))))
            client.sendall(struct.pack(">I", size))
        else:
            _set_up(client, names)
        clients.append(client)
    selector = selectors.DefaultSelector()
    selector.register(sys.stdin, selectors.EVENT_READ)
    for client in clients:
        selector.register(client, selectors.EVENT_READ, client)
        assert client.recv(65536), "the connection was closed"
    print("ready", flush=True)
    while True:
        for key, _ in selector.select():
            if key.data is None:
                return
            assert key.data.recv(65536), "the connection was closed"


def _set_up(client: socket.socket, names: list[str]) -> None:
    reader = PackageReader()
    for kind, payload in (
        (PackageKind.REQUEST_PROTOCOL_VERSION, struct.pack(">H", 2)),
        (PackageKind.SETUP_OUTPUTS, struct.pack(">d", 500.0) + ",".join(names).encode()),
        (PackageKind.START, b""),
    ):
        client.sendall(package(kind, payload))
        answers: dict[int, bytes] = {}
        while kind not in answers:
            answers |= dict(reader.feed(client.recv(65536)))
        assert b"NOT_FOUND" not in answers[kind], f"a variable is not known: {answers[kind]!r}"


def bare_send(address: str, port: str) -> None:
    """Send each client a package every 2 ms by one `send()`, the minimal cost of RTDE's packages."""
    listening, selector = socket.create_server((address, int(port))), selectors.DefaultSelector()
    selector.register(listening, selectors.EVENT_READ)
    selector.register(sys.stdin, selectors.EVENT_READ)
    packages: dict[socket.socket, bytes] = {}
    print("ready", flush=True)
    due = time.monotonic()
    while True:
        for key, _ in selector.select(max(0.0, due - time.monotonic())):
            if key.fileobj is sys.stdin:
                return
            client, _ = listening.accept()
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            packages[client] = bytes(*struct.unpack(">I", client.recv(4)))
        if time.monotonic() >= due:
            due += PERIOD
            for client, data in list(packages.items()):
                try:
                    client.send(data)
                except OSError:  # the client is gone
                    del packages[client]


def bare_tick(endpoint: str) -> None:
    """Compute the line (`paced_line`) or publish the bytes of a state (`bare_put`) every 2 ms for some seconds.

    The answer is the processor time of all threads for each tick [µs].
    """
    session = open_router([endpoint], [], REALTIME, None)
    publisher = session.declare_publisher(keys.key(ROBOT, "state"))
    robot, states = LoopbackHost(free_setup(truth=False, shaper="zv")), list[bytes]()
    robot.subscribe("state", states.append)()
    robot.subscribe("state", len)
    parts: Mapping[str, Callable[[], object]] = {
        "paced_line": Host(robot.controller, robot).tick,
        "bare_put": lambda: publisher.put(states[0]),
    }
    for part in parts.values():
        _paced(part, 1.0)
    gc.collect()
    gc.freeze()
    print("ready", flush=True)
    for name, seconds in map(str.split, sys.stdin):
        print(_paced(parts[name], float(seconds)), flush=True)
    session.close()  # type: ignore[no-untyped-call]


def _paced(part: Callable[[], object], seconds: float) -> float:
    ticks, began = round(seconds / PERIOD), time.process_time()
    due = time.monotonic()
    for _ in range(ticks):
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
        part()
    return 1e6 * (time.process_time() - began) / ticks


def bare_thread() -> None:
    """Only sleep to the deadlines of a robot's ticks for some seconds.

    The answer is the share of missed ticks, counted as in a served robot [%].
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(SET_TIMER_SLACK, 1, 0, 0, 0)
    gc.freeze()
    print("ready", flush=True)
    for line in sys.stdin:
        schedule = Schedule(1, PERIOD, time.monotonic())
        ticks, due, missed = round(float(line) / PERIOD), 0, 0
        while due < ticks:
            if (wait := schedule.due - time.monotonic()) > 0.0:
                time.sleep(wait)
            late = schedule.begin(time.monotonic())[2]
            due += max(1, late)
            missed += late
        print(100.0 * missed / due, flush=True)


if __name__ == "__main__":
    globals()[sys.argv[1]](*sys.argv[2:])
