"""A real robot for the client's tests, whose messages a test may note, answer otherwise, or keep back."""

import asyncio
import queue
import threading
from contextlib import ExitStack, closing, suppress
from functools import cache

import msgspec
import pytest
from blockbuster import blockbuster_ctx
from tests.controller.robots import Q1
from tests.places import free_endpoint

from tvist_client import LoopbackTransport, Robot
from tvist_controller.loopback import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_protocol.codec import decode, decode_command, encode
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Info
from tvist_protocol.stream import Telemetry
from tvist_server.gateways.base import Starting
from tvist_server.gateways.network import Network

NEAR = (0.05, *Q1[1:].tolist())  # a posture close to the one in which the robot starts
setup_of = cache(lambda clock: free_setup(clock=clock, calibration="none", shaper="none"))


class Host(LoopbackHost):
    """A robot in this process; what its clients send is in `commands`, and in `notes` for who waits for it.

    Attributes:
        told: Optional fields of `info` that it tells instead of its own.
        promised: What its telemetry says of its load; None if it sends none.
        silent: Types of command that are not answered.
        answers: Type of command to what is answered instead of carrying it out: a reply, bytes, or what makes one.
    """

    def __init__(self, clock="free"):
        super().__init__(setup_of(clock))
        self.clock = clock
        self.commands, self.setpoints, self.notes = [], [], queue.Queue()
        self.told, self.silent, self.answers = {}, set(), {}
        self.promised = {"due_per_second": 10.0}  # which any machine achieves

    def request(self, client, data):
        kind = msgspec.msgpack.decode(data)["type"]
        with suppress(ProtocolError):  # a wrong one is refused
            self.commands.append(decode_command(data))
        self.notes.put(kind)
        if kind in self.silent:
            return None
        if kind not in self.answers:
            return super().request(client, data)
        answer = self.answers[kind]
        answer = answer() if callable(answer) else answer
        return answer if isinstance(answer, bytes) else encode(answer)

    def put_setpoint(self, client, data):
        self.setpoints.append(msgspec.msgpack.decode(data)["sequence"])
        super().put_setpoint(client, data)

    def info(self):
        return encode(msgspec.structs.replace(decode(Info, super().info()), **self.told))

    def tick(self):
        self._host.tick()
        if self.promised is not None and self.controller.tick_number % 20 == 0:
            self.publish(self.telemetry())

    def telemetry(self):
        tick = self.controller.tick_number
        zero = dict.fromkeys(set(Telemetry.__struct_fields__) - {"load", "due_ticks", "overloaded"}, 0)
        return Telemetry(**{**zero, "tick": tick, "due_ticks": 60 * tick, **self.promised})

    @property
    def holder(self):
        lease = self.controller.session.lease
        return None if lease is None else lease.client


class Served:
    """A robot behind a Zenoh gateway, with one thread that owns it."""

    def __init__(self, clock, endpoint, *, ready=True):
        self.robot = Host(clock)
        self._jobs, self._unanswered = queue.SimpleQueue(), []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._network = Network([endpoint])
        self.starting = Starting()
        self._network.expect(["ur5e"], self.starting)
        if ready:
            self.get_ready()

    def get_ready(self):
        robot = self.robot
        gateway = self._network.gateway("ur5e", self, lockstep=robot.clock != "realtime", truth=True)
        for topic in ("state", "event", "truth", "telemetry"):
            robot.subscribe(topic, lambda data, topic=topic: gateway.publish(topic, None, data))
        self._thread.start()

    def request(self, data, reply):
        def answer():
            answered = self.robot.request("", data)
            if answered is not None:
                reply(lambda: answered)
            else:
                self._unanswered.append(reply)  # what nobody holds Zenoh ends

        self.post(answer)

    def info(self, reply):
        self.post(lambda: reply(self.robot.info))

    def setpoint(self, data):
        self.post(lambda: self.robot.put_setpoint("", data))

    def client_seen(self, name, _session=""):
        self.post(lambda: self.robot.notes.put(f"seen {name}"))

    def client_gone(self, name, _session=""):
        self.post(lambda: self.robot.notes.put(f"gone {name}"))

    def session_gone(self, session):
        pass

    def post(self, job):
        self._jobs.put(job)

    def close(self):
        self._ended.set()
        self.post(lambda: None)
        if self._thread.is_alive():
            self._thread.join()
        self._network.close()

    def _run(self):
        realtime = self.robot.clock == "realtime"
        while not self._ended.is_set():
            if not realtime:
                self._jobs.get()()
                continue
            while not self._jobs.empty():
                self._jobs.get()()
            self.robot.tick()
            self._ended.wait(0.002)


@pytest.fixture(autouse=True)
def _no_blocking_calls_on_the_loop(request):
    """A robot in this process computes on the loop, and reads files there; a client of the network does neither."""
    with ExitStack() as stack:
        if "host" not in request.fixturenames:
            stack.enter_context(blockbuster_ctx())
        yield


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def realtime(endpoint):
    with closing(Served("realtime", endpoint)) as served:
        yield served


@pytest.fixture
def lockstep(endpoint):
    with closing(Served("lockstep", endpoint)) as served:
        yield served


@pytest.fixture
def starting(endpoint):
    """A robot that is starting until the test says that it is ready."""
    with closing(Served("lockstep", endpoint, ready=False)) as served:
        yield served


@pytest.fixture
def host():
    return Host()


@pytest.fixture
async def robot(host):
    """A client of the robot in this process."""
    async with Robot.over(LoopbackTransport(host)) as robot:
        yield robot


@pytest.fixture
def note():
    """Wait, on the loop, for what a served robot is to note; gives everything it noted until then."""

    async def wait_for(served, wanted):
        seen = []
        while wanted not in seen:
            seen.append(await asyncio.to_thread(served.robot.notes.get, timeout=60.0))
        return seen

    return wait_for
