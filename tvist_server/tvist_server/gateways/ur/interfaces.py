"""The interfaces of one robot: a listening socket for each, and the connected clients."""

import asyncio
import contextlib
import logging
import socket
import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Collection, Coroutine, Iterable, Mapping, Sequence
from functools import partial
from weakref import WeakValueDictionary

from tvist_controller.instruments.report import Report, Topic
from tvist_controller.instruments.snapshot import Instruments, Snapshot
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD
from tvist_protocol.io import Io
from tvist_protocol.stream import Event
from tvist_server.gateways.base import CommandIntake, Gateway, Message
from tvist_server.gateways.console import Throttle
from tvist_server.gateways.ur.base import PortSession, Send
from tvist_server.gateways.ur.connection import ClientConnection, ConnectionLimit, listen
from tvist_server.gateways.ur.dashboard import DashboardSession
from tvist_server.gateways.ur.deferred import Deferred
from tvist_server.gateways.ur.external_control import ExternalControl
from tvist_server.gateways.ur.gripper import AskGripper, GripperSession
from tvist_server.gateways.ur.interpreter import InterpreterSession
from tvist_server.gateways.ur.lease import ALIVE, ConnectionControl, HostLease
from tvist_server.gateways.ur.primary.session import PrimarySession
from tvist_server.gateways.ur.program_request import program_of
from tvist_server.gateways.ur.realtime import RealtimeSession
from tvist_server.gateways.ur.robot import UrRobot
from tvist_server.gateways.ur.rtde.package_encoder import PackageEncoder
from tvist_server.gateways.ur.rtde.session import RtdeSession
from tvist_server.program_folder import ProgramFolder
from tvist_server.ur_ports import InterfaceName

log = logging.getLogger(__name__)

FIRST = 1000  # longest wait for the first tick [ticks]
MAX_PENDING = 250  # largest number of states queued for the interfaces' thread: half a second
LEAD = 20
"""Longest queue of states in lockstep; a longer one would delay answers, which come after its states."""
MOST_LINES = 10  # largest number of lines of each kind on the console per `WINDOW`
PAUSE = 0.02  # time between two checks for room in lockstep [s]
UNREAD = 10
"""Number of states handed over together while no client is connected; for temperatures and energies only."""
_SESSIONS: Mapping[InterfaceName, Callable[[UrRobot, ConnectionControl, Send], PortSession]] = {
    "dashboard": DashboardSession,
    "interpreter": InterpreterSession,
    "primary": PrimarySession,
    "primary_read_only": partial(PrimarySession, read_only=True),
    "secondary": partial(PrimarySession, informed=False),
    "secondary_read_only": partial(PrimarySession, informed=False, read_only=True),
    "realtime": RealtimeSession,
    "realtime_read_only": partial(RealtimeSession, read_only=True),
}
"""Sessions of the interfaces that need only robot, control and connection."""


class UrInterfaces(Gateway):
    """A robot's UR interfaces. The constructor binds the sockets (GatewayError if it cannot); `open` admits clients."""

    wanted_topics: Collection[Topic] = frozenset[Topic]({"state", "event", "io"})

    def __init__(
        self,
        intake: CommandIntake,
        description: RobotDescription,
        name: str,
        address: str,
        ports: Mapping[InterfaceName, int],  # an interface without a port stays closed
        *,
        lockstep: bool = False,  # whether a client advances time, so that no state may be lost
        gripper: AskGripper | None = None,  # carries out a request; None: no gripper
        programs: ProgramFolder | None = None,  # programs that clients load by name
        reserved: Sequence[str] = (),  # RTDE inputs that no client may own, as if a fieldbus owned them
    ) -> None:
        self.address = address
        self._intake, self._gripper = intake, gripper
        subjects = ("scripts", "refusals", "clients")
        self._throttles = {what: Throttle(MOST_LINES, f"lines about {what}") for what in subjects}
        external = ExternalControl(programs or ProgramFolder(), self._fetch, self._read_aside)
        scripts, refusals = partial(self._log, "scripts"), partial(self._log, "refusals")
        self.robot = UrRobot(description, name, self._tell, external, scripts, refusals)
        self.robot.inputs.take(reserved, self)
        self._instruments = Instruments(description)
        self._encoders = defaultdict[int, PackageEncoder](PackageEncoder)
        self._io: Io | None = None
        self._early = deque[Report](maxlen=FIRST)
        """States from before `open`: temperatures and energies are integrated from the first tick."""
        self._connections: set[ClientConnection] = set()
        """Connections that have a place while the interfaces are open."""
        self._leases = WeakValueDictionary[str, HostLease]()
        """Lease of each host; it lives as long as one of the host's connections."""
        self._adopted: HostLease | None = None  # lease that this process holds in the name of a host
        self._lockstep = lockstep
        self._news = deque[Report | Message]()  # messages for the interfaces' thread
        self._woken = False  # whether that thread has been woken and has not run yet
        self._unread: Report | None = None  # last tick, if only its temperatures and energies were computed
        self._room = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._servers: list[asyncio.Server] = []
        self._tasks = set[asyncio.Task[None]]()
        self._sockets: dict[InterfaceName, socket.socket] = {}
        try:
            for interface, port in ports.items():
                if interface == "gripper" and gripper is None:
                    continue
                self._sockets[interface] = listen(address, port, interface)
        except BaseException:
            self._close_sockets()
            raise

    @property
    def ports(self) -> dict[InterfaceName, int]:
        return {interface: bound.getsockname()[1] for interface, bound in self._sockets.items()}

    @property
    def clients(self) -> int:
        return len(self._connections)

    async def open(self) -> None:
        """Admit clients after the first tick; the running event loop serves them."""
        for _ in range(0 if self._lockstep else FIRST):  # earlier clients would find no controller
            if self._early:
                break
            await asyncio.sleep(PERIOD)
        # One event loop serves all clients: another process would be a millisecond late and decode everything
        # twice, and a thread per client would compete with the tick.
        self._loop = asyncio.get_running_loop()
        limit = ConnectionLimit(self._loop.time, partial(self._log, "clients"))
        self._connections = limit.taken
        if self._io is not None:
            self.robot.programs.io(self._io)
        while self._early:
            self._handle_tick(self._early.popleft())
        self._handle_queue()
        for interface, bound in self._sockets.items():
            session = partial(self._session, interface)
            connection = partial(ClientConnection, session, self._lease, limit, lossless=self._lockstep)
            self._servers.append(await self._loop.create_server(connection, sock=bound))
        self._run(self._keep_alive())

    def publish(self, topic: Topic, message: Message, payload: bytes) -> None:  # noqa: ARG002  not MessagePack here
        """Pass a message to the interfaces' thread; `report` passes states."""
        if self._loop is None:
            if isinstance(message, Io):
                self._io = message
        elif isinstance(message, Io | Event):
            self._news.append(message)
            self._wake()

    def report(self, report: Report) -> None:
        """Pass a tick to the interfaces' thread, which builds the tick's state only if there are clients."""
        if self._loop is None:  # the interfaces are not open
            self._early.append(report)
        elif not self._has_room():
            self.dropped += 1
        else:
            self._news.append(report)
            if self._connections or len(self._news) >= UNREAD:
                self._wake()

    def _has_room(self) -> bool:
        """Return whether one more state may be queued; in lockstep, wait until there is room."""
        most = LEAD if self._lockstep else MAX_PENDING
        while len(self._news) >= most:
            if not self._lockstep or self._loop is None:
                return False
            self._room.clear()
            self._room.wait(PAUSE)
        return True

    def _wake(self) -> None:
        """Wake the interfaces' thread, unless it is about to run."""
        if not self._woken:
            self._woken = True
            self._soon(self._handle_queue)

    async def shut(self) -> None:
        for task in self._tasks:
            task.cancel()
        for server in self._servers:
            server.close()
        for connection in tuple(self._connections):
            connection.close()
        await asyncio.sleep(0)  # lets the connections end
        self._loop = None
        self._room.set()  # releases a thread that waits to pass on a state
        self._write(line for throttle in self._throttles.values() for line in throttle.rest())

    def close(self) -> None:
        self._loop = None
        self._close_sockets()

    # The following methods run in the interfaces' thread.

    def _handle_queue(self) -> None:
        """Handle messages queued now. Later ones wake this thread again, so clients are served between."""
        self._woken = False
        for _ in range(len(self._news)):
            message = self._news.popleft()
            if self._lockstep:
                self._room.set()
            if isinstance(message, Report):
                self._handle_tick(message)
            elif isinstance(message, Io):
                self._io = message
                self.robot.programs.io(message)
            elif isinstance(message, Event):
                self.robot.programs.event(message)
                for connection in tuple(self._connections):
                    connection.event(message)
        if self._unread is not None:
            self._take_snapshot(self._unread)

    def _handle_tick(self, report: Report) -> None:
        if self._io is None:
            return
        if self._connections:
            snapshot = self._take_snapshot(report)
            # All samples are made before the first is sent, so that the readers' process wakes up only once.
            for connection, data in [(one, one.sample(snapshot)) for one in tuple(self._connections)]:
                if data:
                    connection.put(data)
            return
        self._unread, measured = report, report.sample.measured
        self._instruments.follow(report.tick, report.modes[0], measured.moment.tolist(), measured.qd.tolist())

    def _take_snapshot(self, report: Report) -> Snapshot:
        assert self._io is not None
        self._unread = None
        self.robot.latest = self._instruments.snapshot(report.state, self._io)
        return self.robot.latest

    def _tell(self, message: bytes) -> None:
        for connection in tuple(self._connections):
            if isinstance(connection.session, PrimarySession) and connection.session.informed:
                connection.tell(message)

    def adopt(self, host: str, token: str) -> None:
        """Let the clients of a host use a lease that this process holds in its name; call before `open`."""
        self._adopted = self._lease(host)
        self._adopted.adopt(token, self)

    def _session(self, interface: InterfaceName, control: ConnectionControl, send: Send) -> PortSession:
        self._handle_queue()  # the client must see the robot's present state
        match interface:
            case "gripper":
                assert self._gripper is not None
                return GripperSession(self.robot, control, send, self._gripper, self._soon)
            case "rtde":
                return RtdeSession(self.robot, control, send, self._encoders)
        return _SESSIONS[interface](self.robot, control, send)

    def _lease(self, host: str) -> HostLease:
        lease = self._leases.get(host)
        if lease is None:
            lease = self._leases[host] = HostLease(self._intake, host, self._soon)
        return lease

    def _soon(self, action: Callable[[], None]) -> None:
        loop = self._loop
        if loop is not None:
            with contextlib.suppress(RuntimeError):  # the loop is closed at shutdown
                loop.call_soon_threadsafe(action)

    def _read_aside(self, read: Callable[[], str | None]) -> Deferred[str | None]:
        """Read a file in a daemon thread, which shutdown does not wait for."""
        later = Deferred[str | None]()

        def reading() -> None:
            text = None
            try:
                text = read()
            except Exception:
                log.exception("a program could not be read")
            self._soon(lambda: later.set(text))

        threading.Thread(target=reading, name="tvist-ur-file", daemon=True).start()
        return later

    def _fetch(self, host: str) -> Deferred[str | None]:
        later = Deferred[str | None]()

        async def fetching() -> None:
            later.set(await program_of(host))

        self._run(fetching())
        return later

    def _run(self, work: Coroutine[object, object, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _keep_alive(self) -> None:
        while True:
            await asyncio.sleep(ALIVE)
            for lease in self._leases.values():
                lease.keep_alive()
            now = time.monotonic()
            self._write(line for throttle in self._throttles.values() for line in throttle.due(now))

    def _log(self, what: str, line: str) -> None:
        """Write a line about a robot or client to the server's console."""
        self._write(self._throttles[what].take(line, time.monotonic()))

    def _write(self, lines: Iterable[str]) -> None:
        for line in lines:
            log.warning("robot %s: %s", self.robot.name, line)

    def _close_sockets(self) -> None:
        for bound in self._sockets.values():
            bound.close()
        self._sockets.clear()
