"""A small robot for the client's tests: speaks the protocol, moves nothing, does what a test tells it."""

import asyncio
import math
import queue
import threading
from contextlib import ExitStack, contextmanager

import pytest
from blockbuster import blockbuster_ctx
from tests.places import free_endpoint

from tvist_client import LoopbackTransport, Robot
from tvist_protocol.codec import decode, decode_command, encode
from tvist_protocol.commands import Setpoint
from tvist_protocol.info import Info, Limits
from tvist_protocol.replies import Accepted, Done, Posture, Refused, ToolPose
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_protocol.values import Payload
from tvist_server.gateways.network import Network
from tvist_server.gateways.starting import Starting

JOINTS = 6
MOVE_TICKS = 120
JOINT_FIELDS = (
    *("reference_q", "target_q", "target_qd", "target_qdd", "target_moment"),
    *("actual_q", "actual_qd", "actual_moment"),
)
PAYLOAD = Payload(mass=5.0, com=(0.0, 0.0, 0.1), inertia=(0.0,) * 6)
LIMITS = Limits(
    position=[(-6.3, 6.3)] * 6,
    velocity=[3.0] * 6,
    acceleration=[10.0] * 6,
    jerk=[100.0] * 6,
    torque=[100.0] * 6,
    payload=5.0,
)


class FakeRobot:
    """A robot in process, with the interface of a loopback host.

    A motion takes `MOVE_TICKS` ticks and jumps to its target at the end. Its `motion_started` is put before its
    `accepted` is given: an event that overtakes.
    """

    def __init__(self, clock="free"):
        self.clock = clock
        self.protocol, self.rate_hz = 1, 500.0
        self.tick = 0
        self.q = [0.0] * JOINTS
        self.token = None
        self.holder = None
        self.motions = 0
        self.motion = None
        self.modes = (7, 1)
        """Robot mode and safety mode."""
        self.promised = {"due_per_second": 10.0}
        """What its telemetry says of its load; ten ticks a second any machine achieves."""
        self.told = {}
        """Optional fields of `info`."""
        self.streaming = False
        self.setpoints = []
        self.commands = []
        self.notes = queue.Queue()
        """What arrived, in order: commands by type, `seen`/`gone` with the client's name."""
        self.silent = set()
        """Types of command that are not answered."""
        self.answers = {}
        """Type of command to bytes that are answered instead."""
        self._callbacks = []

    def subscribe(self, topic, callback):
        self._callbacks.append((topic, callback))
        return lambda: self._callbacks.remove((topic, callback))

    def put(self, topic, message):
        data = message if isinstance(message, bytes) else encode(message)
        for wanted, callback in tuple(self._callbacks):
            if wanted == topic:
                callback(data)

    def info(self):
        return encode(
            Info(
                name="ur5e",
                protocol=self.protocol,
                version="0",
                model="UR5e",
                joints=[f"j{i}" for i in range(JOINTS)],
                rate_hz=self.rate_hz,
                clock=self.clock,
                limits=LIMITS,
                payload=PAYLOAD,
                calibration=None,
                shaper="zv",
                modes=1,
                estimator="fixed",
                calibrations=[],
                shapers=["none", "zv"],
                control=self.holder,
                tick=self.tick,
                **self.told,
            )
        )

    def put_setpoint(self, _client, data):
        setpoint = decode(Setpoint, data)
        self.setpoints.append((self.tick, setpoint.sequence, setpoint.q))
        self.notes.put(f"setpoint {setpoint.sequence}")

    def request(self, _client, data):
        command = decode_command(data)
        kind = type(command).__struct_config__.tag
        self.commands.append(command)
        self.notes.put(kind)
        if kind in self.silent:
            return None
        return self.answers.get(kind) or encode(self._carry_out(command))

    def _carry_out(self, command):
        if getattr(command, "token", None) not in {None, self.token}:
            return Refused(code="stale_token", where="token", why="not the token of the present lease")
        name = "_" + type(command).__struct_config__.tag.replace(".", "_")
        return getattr(self, name, lambda _: Done())(command)

    def _take_control(self, command):
        if self.holder not in {None, command.client}:
            return Refused(code="no_control", where="", why=f"control is held by {self.holder!r}")
        self.holder, self.token = command.client, f"{command.client}#1"
        return Accepted(token=self.token, lease_s=command.lease_s)

    def _release_control(self, _):
        self.holder = self.token = None
        return Done()

    def _move_j(self, command):
        if max(map(abs, command.q)) > 6.3:
            return Refused(code="limit_position", where="q[0]", why="too far", limit=6.3)
        self.motions += 1
        self.put("event", Event(tick=self.tick + 1, kind="motion_started", id=self.motions))
        self.motion = (self.motions, self.tick + MOVE_TICKS, command.q)
        return Accepted(id=self.motions)

    def _move_l(self, _):
        self.motions += 1
        self.put("event", Event(tick=self.tick + 1, kind="motion_started", id=self.motions))
        self.motion = (self.motions, self.tick + MOVE_TICKS, self.q)
        return Accepted(id=self.motions)

    _move_c = _move_path = _move_l

    def _servo_j(self, _):
        if self.motion is None:
            self._move_l(_)
        self.motion = (self.motions, math.inf, None)
        return Accepted(id=self.motions)

    _speed_j = _speed_l = _force_mode = _freedrive = _servo_j

    def _inverse_kinematics(self, _):
        return Posture(q=(0.5,) * JOINTS)

    def _forward_kinematics(self, _):
        return ToolPose(pose=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6))

    def _servo_start(self, _):
        self.streaming = True
        return Done()

    def _servo_stop(self, _):
        if not self.streaming:
            return Refused(code="wrong_mode", where="", why="no stream is running")
        self.end_stream("servo_stop")
        return Done()

    def _simulation_reset(self, _):
        return Done(tick=self.tick)

    def _simulation_step(self, command):
        setpoints = iter(command.setpoints or ())
        for _ in range(command.ticks):
            setpoint = next(setpoints, None)
            if setpoint is not None:
                self.setpoints.append((self.tick, setpoint.sequence, setpoint.q))
            self.pass_tick()
        return Done(tick=self.tick)

    def _stop(self, _):
        if self.motion:
            why = "a stop was commanded"
            self.put("event", Event(tick=self.tick + 1, kind="motion_stopped", id=self.motion[0], why=why))
            self.motion = None
        return Done()

    _stop_j = _stop_l = _end_force_mode = _stop

    def _zero_ftsensor(self, _):
        return Done()

    def end_stream(self, why):
        self.streaming = False
        self.put("event", Event(tick=self.tick + 1, kind="stream_stopped", why=why))

    def pass_tick(self):
        self.tick += 1
        if self.motion and self.tick >= self.motion[1]:
            self.q = list(self.motion[2])
            self.put("event", Event(tick=self.tick, kind="motion_done", id=self.motion[0]))
            self.motion = None
        self.put("state", self.state())
        self.put("truth", self.truth())
        if self.promised is not None and self.tick % 20 == 0:
            self.put("telemetry", self.telemetry())

    def telemetry(self):
        zero = dict.fromkeys(set(Telemetry.__struct_fields__) - {"load", "due_ticks", "overloaded"}, 0)
        return Telemetry(**{**zero, "tick": self.tick, "due_ticks": 60 * self.tick, **self.promised})

    def state(self, tick=None):
        return State(
            tick=self.tick if tick is None else tick,
            timestamp=self.tick * 0.002,
            robot_mode=self.modes[0],
            safety_mode=self.modes[1],
            runtime_state=2 if self.motion or self.streaming else 1,
            setpoint_sequence=self.setpoints[-1][1] if self.setpoints else None,
            missed_ticks=0,
            speed_scaling=1.0,
            shaper_delay=0.0,
            estimated_f_d=[10.0],
            estimated_zeta=[0.1],
            actual_tool_accelerometer=[0.0, 0.0, 9.81],
            actual_TCP_pose=[0.0] * 6,
            actual_TCP_speed=[0.0] * 6,
            **{name: list(self.q) for name in JOINT_FIELDS},
        )

    def truth(self):
        names = set(Truth.__struct_fields__) - {"tick", "timestamp"}
        return Truth(tick=self.tick, timestamp=0.0, **{name: [0.0] for name in names})


class Served:
    """A `FakeRobot` behind a real Zenoh gateway, with one thread that owns it."""

    def __init__(self, robot, endpoint, *, ready=True):
        self.robot = robot
        self.endpoint = endpoint
        self._jobs = queue.SimpleQueue()
        self._unanswered = []
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
            self.robot.pass_tick()
            self._ended.wait(0.002)


@contextmanager
def serve(clock, endpoint, *, ready=True):
    served = Served(FakeRobot(clock), endpoint, ready=ready)
    try:
        yield served
    finally:
        served.close()


@pytest.fixture(autouse=True)
def _no_blocking_calls_on_the_loop():
    with blockbuster_ctx():
        yield


@pytest.fixture
def endpoint():
    return free_endpoint()


@pytest.fixture
def realtime(endpoint):
    with serve("realtime", endpoint) as served:
        yield served


@pytest.fixture
def lockstep(endpoint):
    with serve("lockstep", endpoint) as served:
        yield served


@pytest.fixture
def starting(endpoint):
    """A robot that is starting until the test says that it is ready."""
    with serve("lockstep", endpoint, ready=False) as served:
        yield served


@pytest.fixture
def fake():
    return FakeRobot()


@pytest.fixture
async def free(fake):
    async with Robot.over(LoopbackTransport(fake)) as robot:
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


@pytest.fixture
def serving(endpoint):
    """Serve at the endpoint again."""
    with ExitStack() as stack:
        yield lambda clock: stack.enter_context(serve(clock, endpoint))
