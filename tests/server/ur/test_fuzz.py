"""Random bytes, split anywhere, break no interface and do not disturb its other clients.

The controller is real. Its replies come late, as from another thread, so that some clients leave before theirs.
"""

import gc
import struct
import tracemalloc
from collections import defaultdict
from random import Random
from statistics import median

import pytest
from tests.controller.robots import UR5E

from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.motion.activity_control import HISTORY
from tvist_server.gateways.ur.dashboard import COMMANDS, DashboardSession
from tvist_server.gateways.ur.lease import ConnectionControl, HostLease
from tvist_server.gateways.ur.primary.session import PrimarySession
from tvist_server.gateways.ur.realtime import RealtimeSession
from tvist_server.gateways.ur.robot import UrRobot
from tvist_server.gateways.ur.rtde.package_encoder import PackageEncoder
from tvist_server.gateways.ur.rtde.session import RtdeSession

from . import rtde_client
from .decoders import split
from .hosts import external
from .served_controller import ControllerThread

INTERFACES = {
    "rtde": RtdeSession,
    "primary": PrimarySession,
    "realtime": RealtimeSession,
    "dashboard": DashboardSession,
}
CLIENTS = 4  # number of clients that send random bytes, from two hosts
LIVES = 60  # mean number of packages that a client sends before it leaves
READ = ["timestamp", "actual_q"]


class ServedWithoutSockets(ControllerThread):
    """A robot whose interfaces have no sockets; `tick` lets time pass, `answer` gives the due replies."""

    def __init__(self):
        super().__init__(late=True)
        self.instruments = Instruments(UR5E)
        self.encoders = defaultdict(PackageEncoder)
        self.robot = UrRobot(UR5E, "ur5e", self.tell, external(), lambda _: None, lambda _: None)
        self.leases = {host: HostLease(self, host, self.post) for host in ("127.0.0.1", "127.0.0.2")}
        self.clients = []
        self.latest_io = self.latest = None

    def tell(self, message):
        for client in self.clients:
            if isinstance(client.session, PrimarySession):
                client.take(message)

    def state(self, state):
        self.latest = state

    def io(self, io):
        self.latest_io = io
        self.robot.programs.io(io)

    def event(self, event):
        self.robot.programs.event(event)
        for client in self.clients:
            client.session.event(event)

    def tick(self):
        self.answer()
        self.host.tick()
        snapshot = self.robot.latest = self.instruments.snapshot(self.latest, self.latest_io)
        for client in self.clients:
            client.sampled = client.session.sample(snapshot)
        return snapshot


class Client:
    """A connection; `heard` checks and returns what it was sent since the last call."""

    def __init__(self, served, interface, host="127.0.0.1"):
        self.served, self.interface = served, interface
        self.stream, self.sampled, self.rest = bytearray(), b"", b""
        self.control = ConnectionControl(served.leases[host])
        encoder = (served.encoders,) if interface == "rtde" else ()
        self.session = INTERFACES[interface](served.robot, self.control, self.take, *encoder)
        served.clients.append(self)
        self.session.opened()

    def take(self, data):
        self.stream += data

    def heard(self):
        data = bytes(self.stream)
        self.stream.clear()
        if self.interface == "rtde":
            rtde_client.packages(data)
        elif self.interface == "primary":
            split(data)
        elif self.interface == "dashboard":
            assert not data or data.endswith(b"\n")
            data.decode()
        return data

    def go(self):
        self.served.clients.remove(self)
        self.session.closed()


NAMES = [*rtde_client.OUTPUT_TYPES, *rtde_client.INPUT_TYPES]
INPUTS = [*rtde_client.INPUT_TYPES]
NUMBERS = [struct.pack(">d", number) for number in (float("nan"), float("inf"), -1e308, 0.0, 0.5, 1e-320)]


def recipe(random):
    kind = random.random()
    if kind < 0.01:
        return ["payload"] * 10_000 if random.random() < 0.5 else ["x"] * 10_000
    names = [random.choice(INPUTS if random.random() < 0.7 else NAMES) for _ in range(random.randrange(12))]
    if kind < 0.1:
        names.append(random.choice(["", "ü", "nonsense", "\0", "actual_q "]))
    return names


def rtde(random):
    kind = random.randrange(10)
    if kind == 0:
        size = random.choice([0, 1, 2, 3, 4, 65535, random.randrange(200)])
        return struct.pack(">HB", size, random.randrange(256)) + random.randbytes(random.randrange(90))
    if kind == 1:
        return rtde_client.version(random.randrange(4))
    if kind == 2:
        payload = random.choice([*NUMBERS, struct.pack(">d", 125.0)]) + ",".join(recipe(random)).encode()
        return rtde_client.package("O", payload[:65532])
    if kind == 3:
        return rtde_client.package("I", ",".join(recipe(random)).encode()[:65532])
    if kind < 8:
        values = b"".join(random.choice(NUMBERS) for _ in range(random.randrange(8)))
        if random.random() < 0.5:
            values = random.randbytes(random.randrange(100))
        return rtde_client.package("U", bytes([random.randrange(5)]) + values)
    return rtde_client.package(random.choice("SPvMVOIx"), random.randbytes(random.randrange(40)))


ORDERS = [
    "power on", "power off", "set robotmode run", "set unlock protective stop", "stop program", "set sim",
]  # fmt: skip
SCRIPTS = [
    "def f():\n", "sec g():\n", " if x:\n", "end\n", "end", "  movej(q)\n", '"', "#", "\r\n", "\n", "\0", "ü",
]  # fmt: skip


def script(random):
    kind = random.random()
    if kind < 0.3:
        return random.choice(ORDERS).encode() + b"\n"
    if kind < 0.7:
        return "".join(random.choices(SCRIPTS, k=random.randrange(8))).encode()
    return b"def f():\n" + b"ab\n" * 2_000 if kind < 0.71 else random.randbytes(random.randrange(200))


def line(random):
    kind = random.random()
    if kind < 0.8:
        said = random.choice(COMMANDS).keyword
        said = random.choice([said, said.upper(), said + " ", said + "x"])
        argument = random.choice(["", " paper.urp", " Q1.urp", " /a/wait_program.urp", " ü\0", " MANUAL"])
        return (said + argument).encode() + random.choice([b"\n", b"\r\n"])
    said = b"a" * 10_000 if kind < 0.81 else random.randbytes(random.randrange(80))
    return said + random.choice([b"", b"\n", b"\n\n\n"])


SENT = {"rtde": rtde, "primary": script, "realtime": script, "dashboard": line}


def watch(served, reader, asker):
    """Tick, and check that two well-behaved clients get their sample and their answer."""
    snapshot = served.tick()
    found = rtde_client.decoded(reader.sampled, READ)
    assert found == {"timestamp": snapshot.timestamp, "actual_q": snapshot.actual_q}
    assert not reader.heard()
    asker.session.receive(b"version\n")
    assert asker.heard().startswith(b"5.22")


def attack(served, interface, random, packages):
    """Let clients connect, send packages that are cut anywhere, and leave."""
    hosts = [*served.leases]
    clients = [Client(served, interface, random.choice(hosts)) for _ in range(CLIENTS)]
    reader, asker = Client(served, "rtde"), Client(served, "dashboard")
    listener = Client(served, "primary")
    for sent in (rtde_client.version(), rtde_client.outputs(READ), rtde_client.package("S")):
        reader.session.receive(sent)
    reader.heard()
    asker.heard()
    for number in range(packages):
        which = random.randrange(CLIENTS)
        client = clients[which]
        client.rest += SENT[interface](random)
        if random.random() < 0.7:
            cut = random.randrange(len(client.rest) + 1)
            if not client.session.over:
                client.session.receive(client.rest[:cut])
            client.rest = client.rest[cut:]
        client.heard()
        if random.random() < 0.3:
            served.answer()
        if random.random() < 1 / LIVES:
            client.go()
            clients[which] = Client(served, interface, random.choice(hosts))
        if number % 20 == 0:
            watch(served, reader, asker)
            listener.heard()
    for client in (*clients, reader, listener, asker):
        client.go()
    last = Client(served, "dashboard")
    last.session.receive(b"stop\n")
    last.go()
    served.answer()
    served.kinds.clear()  # its own list, which would count as memory that is lost


@pytest.mark.parametrize(
    "packages", [160, pytest.param(10_000, marks=[pytest.mark.nightly, pytest.mark.timeout(3600)])]
)
@pytest.mark.parametrize("interface", INTERFACES)
def test_random_bytes_break_no_interface_and_disturb_no_other_client(interface, packages):
    served, random = ServedWithoutSockets(), Random(packages)
    served.host.tick()
    served.tick()
    memory, long = [], packages > 1000
    if long:
        tracemalloc.start(1)
        for _ in range(HISTORY):  # past postures are kept, which would count as memory that is lost
            served.host.tick()
    try:
        for _ in range(8 if long else 2):
            attack(served, interface, random, packages // (8 if long else 2))
            if long:
                gc.collect()
                memory.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert served.holder() is None
    assert not served.robot.inputs._owners
    assert not served.clients
    assert all(not lease._users for lease in served.leases.values())
    if long:  # in bytes; one sample alone may be larger by chance
        assert median(memory[4:]) - median(memory[:4]) < 100_000
