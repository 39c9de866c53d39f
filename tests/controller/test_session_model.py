"""Random sessions of three clients against a small model that goes by the protocol's table of transitions.

The model knows who holds the lease until when, who holds the clock, and what the robot is doing. What is up to
the arm, when it comes to rest and whether a drive was overloaded, it takes from the robot; everything else it
foretells, every reply included. Time passes by itself, or by the clients' steps, in which others send commands.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test
from tests.examples import share

from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import Admitted, admit
from tvist_controller.host import Host
from tvist_controller.motion.setpoints import TIMEOUT
from tvist_lab.replay import replay
from tvist_protocol import commands as c
from tvist_protocol.codec import encode
from tvist_protocol.io import SetRegisters
from tvist_protocol.modes import SafetyMode
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep, StepSetpoint
from tvist_protocol.transitions import Activity, after

from .robots import Q1, Kept, setup
from .test_modes import COMMANDS, STOPS

CLIENTS = st.sampled_from(["anna", "bert", "cora"])
LEASES = st.sampled_from([0.1, 0.4, 30.0, 30.0])
TOKENS = st.sampled_from([*("lease",) * 5, "clock", "old", "nobody's"])
"""Whose token a command carries."""
STEPPERS = st.sampled_from([*("clock",) * 3, *("lease",) * 2, "old", "nobody's"])
ACTIONS = st.sampled_from([
    "take", "release", "hand_over", "keep_alive", "take_clock", "take_clock", "release_clock", "come",
    "leave", "single_step", "stop", "servo_start", "setpoint", "registers",
])  # fmt: skip
"""Methods for what clients may do at any time, also while one of them steps."""
START = tuple(Q1.tolist())
MOTION = {name: kind for name, (kind, _) in COMMANDS.items()}
NUMBERED = {"move_j", "servo_j", "speed_j", "speed_l"}
"""Commands that are answered by the number of a motion."""
INTERFERING = [
    "pause", "pause", "resume", "servo_stop", "stop", "power_off", "servo_j", "speed_j", "stop_j", "stop_l",
]  # fmt: skip
PUT = {"RUNNING": Activity.REST, "IDLE": Activity.IDLE, "POWER_OFF": Activity.POWER_OFF}
ENDS = {"motion_done", "motion_stopped"}
BARRED = {"collision", "limit_position", "singular"}
"""Codes of what may end a guided motion."""
TOLD = {"lease_lost", "stream_stopped", "protective_stop"}


@dataclass
class Right:
    """The model's knowledge of the lease or the clock."""

    client: str
    token: str | None
    """None after a hand-over: nobody has been told it."""
    session: str | None
    seconds: float
    ends: float


def refused(right, token):
    """Return the code with which a token is refused; None for the right's own."""
    if right is None:
        return "no_control"
    return None if token == right.token else "stale_token"


class Sessions(RuleBasedStateMachine):
    def __init__(self, clock):
        super().__init__()
        self.setup, self.sink = setup(clock=clock), Kept()
        self.realtime = clock == "realtime"
        self.robot = Controller(self.setup)
        self.host = Host(self.robot, self.sink)
        self.lease: Right | None = None
        self.clock: Right | None = None
        self.activity = Activity.REST
        self.reduced = self.spoilt = self.in_step = False
        self.heard = 0.0
        self.sequence = self.sent = self.refused = self.seen = 0
        self.fed = 0
        """Set-points that the robot took."""
        self.present: set[str] = set()
        self.old = ["anna#0", "anna#clock0"]
        self.running: set[int] = set()
        self.told: list[str] = []
        """Kinds of events that the next tick must tell of."""

    def request(self, command, attend=None):
        """Send a command as over a network, with its session if there is one."""
        before = self.robot.tick_number
        admitted = admit(encode(command), *self.host.standing)
        session = self.session(getattr(command, "client", None))
        if isinstance(admitted, Admitted):
            reply = self.host.carry_out(admitted._replace(session=session), attend=attend)
        else:  # before it reaches the robot, which would refuse it alike
            reply = admitted
            assert self.robot.receive(command, session=session) == reply
        self.sent += 1
        self.refused += isinstance(reply, Refused)
        if not isinstance(command, SimulationStep):
            assert self.robot.tick_number == before, "nothing but a step lets time pass"
        return reply

    def send(self, kind, whose, **fields):
        """Send a command that needs control and renews the lease; return None if its token is refused."""
        token = self.token(whose)
        if (code := refused(self.lease, token)) is None:
            self.renew()
        reply = self.request(kind(token=token, **fields))
        if code is None:
            return reply
        assert (reply.code, reply.where) == (code, "token")
        return None

    def renew(self):
        self.lease.ends = self.robot.now + self.lease.seconds

    def session(self, client):
        return f"session of {client}" if client in self.present else None

    def token(self, whose):
        right = {"clock": self.clock, "lease": self.lease}.get(whose)
        if right is not None and right.token is not None:
            return right.token
        return self.old[-1] if whose == "old" else "nobody#1"

    def forget(self, name):
        right = getattr(self, name)
        if right is not None and right.token is not None:
            self.old.append(right.token)
        setattr(self, name, None)

    def lose_lease(self):
        self.forget("lease")
        self.told.append("lease_lost")
        self.happen("interruption")

    def go(self, target):
        if self.activity is Activity.STREAMING and target is not Activity.STREAMING:
            self.told.append("stream_stopped")
        self.activity = target

    def happen(self, trigger):
        """Apply a trigger, which may change nothing."""
        self.go(after(self.activity, trigger) or self.activity)

    def take(self, client, _, seconds=30.0):
        self.taken("lease", c.TakeControl(client=client, lease_s=seconds), seconds)

    def take_clock(self, client, _):
        if self.realtime:  # the clock needs no client, and none may take it
            reply = self.request(c.TakeClock(client=client))
            assert (reply.code, reply.where) == ("wrong_mode", "type")
        else:
            self.taken("clock", c.TakeClock(client=client), np.inf)

    def taken(self, name, command, seconds):
        right, reply = getattr(self, name), self.request(command)
        if right is not None and right.client != command.client:
            assert (reply.code, repr(right.client) in reply.why) == ("no_control", True)
            return
        assert isinstance(reply, Accepted)
        assert reply.lease_s == (None if name == "clock" else seconds)
        assert reply.token not in {*self.old, self.token("lease"), self.token("clock")}
        self.forget(name)
        ends = self.robot.now + seconds
        setattr(self, name, Right(command.client, reply.token, self.session(command.client), seconds, ends))

    def keep_alive(self, _, whose):
        assert self.send(c.KeepAlive, whose) in {None, Done()}

    def release(self, _, whose):
        if self.send(c.ReleaseControl, whose) is not None:
            self.forget("lease")
            self.happen("interruption")

    def release_clock(self, _, whose):
        token = self.token(whose)
        code = refused(self.clock, token)
        assert getattr(self.request(c.ReleaseClock(token=token)), "code", None) == code
        if code is None:
            self.forget("clock")

    def hand_over(self, client, whose):
        if self.send(c.HandOver, whose, client=client) is not None:
            seconds = self.lease.seconds
            self.forget("lease")
            self.lease = Right(client, None, self.session(client), seconds, self.robot.now + seconds)

    def come(self, client, _):
        self.present.add(client)

    def leave(self, client, _):
        session = self.session(client)
        self.host.client_gone(client, f"session of {client}")
        self.present.discard(client)
        held = {
            name
            for name in ("lease", "clock")
            if (right := getattr(self, name))
            and session
            and (right.client, right.session) == (client, session)
        }
        if "lease" in held:
            self.lose_lease()
        if "clock" in held:
            self.forget("clock")

    def stop(self, *_):
        assert self.request(c.Stop()) == Done()
        self.happen("stop")

    def registers(self, *_):
        assert self.request(SetRegisters(bank="input_int", values=(1,))) == Done()

    def servo_start(self, _, whose):
        self.command("servo_start", whose, 0.0)

    def here(self, offset=0.0):
        return tuple((self.robot.cycle.sample.reference + offset * np.eye(6)[0]).tolist())

    def setpoint(self, _, whose, offset=0.0):
        token = self.token(whose)
        taken = self.activity is Activity.STREAMING and refused(self.lease, token) is None
        self.host.setpoint(encode(c.Setpoint(token=token, sequence=self.sequence, q=self.here(offset))))
        self.sequence += taken
        self.feed(taken)

    def feed(self, taken):
        self.fed += taken
        if taken:
            self.heard = self.robot.now
            self.renew()

    def single_step(self, _, whose):
        if self.in_step:  # within a step of a host without a queue: in a callback of its caller's
            token = self.token(whose)
            reply = self.request(SimulationStep(token=token, ticks=1))
            assert reply.code == (self.refused_step(token, None, 0) or ("busy",))[0]
        else:
            self.step(whose, None, 1, 0, {})

    def refused_step(self, token, motion_token, count):
        """Return code and field with which a step is refused; None if time passes."""
        if (code := refused(self.lease if self.clock is None else self.clock, token)) is not None:
            clocked = self.clock is not None and refused(self.lease, token) is None
            return "no_control" if clocked else code, "token"
        if motion_token is not None:
            if (code := refused(self.lease, motion_token)) is not None:
                return code, "motion_token"
        elif count and self.clock is not None:
            return "missing_field", "motion_token"
        if self.realtime:
            return "wrong_mode", "type"
        return ("wrong_mode", "setpoints") if count and self.activity is not Activity.STREAMING else None

    @rule(
        whose=STEPPERS,
        motion=st.one_of(st.none(), TOKENS),
        ticks=st.sampled_from([1, 2, 5, 9]),
        count=st.sampled_from([0, 0, 0, 1, 4]),
        within=st.dictionaries(st.integers(0, 8), st.tuples(ACTIONS, CLIENTS, TOKENS | STEPPERS), max_size=3),
    )
    def step(self, whose, motion, ticks, count, within):
        token, count = self.token(whose), min(count, ticks)
        motion_token = None if motion is None else self.token(motion)
        setpoints = tuple(StepSetpoint(sequence=self.sequence + n, q=self.here()) for n in range(count))
        command = SimulationStep(
            token=token, ticks=ticks, setpoints=setpoints or None, motion_token=motion_token
        )
        refusal = self.refused_step(token, motion_token, count)
        before, passed, ended = self.robot.tick_number, 0, False
        if self.clock is None and refusal in {None, ("wrong_mode", "type")}:
            self.renew()

        def attend():
            nonlocal passed, ended
            if passed:
                self.ticked()
            if passed in within:
                self.act(*within[passed])
            ended = refused(self.lease if self.clock is None else self.clock, token) is not None
            if not ended:
                feeds = self.activity is Activity.STREAMING and not refused(self.lease, motion_token or token)
                self.feed(passed < count and feeds)
                passed += 1
            return True

        self.in_step = True
        reply = self.request(command, attend)
        self.in_step = False
        assert self.robot.tick_number == before + passed
        if refusal is not None:
            assert (reply.code, reply.where, passed) == (*refusal, 0)
            return
        assert reply == Done(tick=before + passed)
        assert ended or passed == ticks
        self.sequence += count
        if not ended:
            self.ticked()

    # Hypothesis chooses among rules alike, whatever they do: so there are more of those that lead somewhere.

    @rule(action=ACTIONS, client=CLIENTS, whose=TOKENS | STEPPERS)
    def act(self, action, client, whose):
        getattr(self, action)(client, whose)
        self.look()

    @precondition(lambda self: self.lease is None or self.lease.token is None)
    @rule(seconds=LEASES, present=st.booleans())
    def gain_control(self, seconds, present):
        """Take control, which most actions need."""
        client = "anna" if self.lease is None else self.lease.client
        (self.come if present else self.leave)(client, None)
        self.take(client, None, seconds)

    @precondition(lambda self: self.activity.moving and self.lease is not None)
    @rule(how=st.sampled_from(["release", "leave", "stop"]))
    def give_up(self, how):
        """End control or stop during a motion."""
        self.act(how, self.lease.client, "lease")

    @rule(command=st.sampled_from(sorted(MOTION)), whose=TOKENS, offset=st.sampled_from([0.0, 0.02, 0.4]))
    def command(self, command, whose, offset):
        fields = {
            "move_j": {"q": (offset, *START[1:])},
            "servo_start": {"velocity": 0.5},
            "servo_j": {"q": (offset, *START[1:])},
            "speed_j": {"qd": (offset, 0.0, 0.0, 0.0, 0.0, 0.0)},
            "speed_l": {"xd": (0.0, 0.0, 0.0, 0.0, 0.0, offset)},
        }.get(command, {})
        if (reply := self.send(MOTION[command], whose, **fields)) is None:
            return
        if (target := after(self.activity, command)) is not None:
            assert isinstance(reply, Accepted if command in NUMBERED else Done), reply
            self.go(target)
            if command == "servo_start":
                self.heard, self.sequence = self.robot.now, 0
        elif command in STOPS:
            assert reply == Done()
        else:
            assert isinstance(reply, Refused)
            assert reply.code == ("busy" if reply.code == "busy" and self.activity.moving else "wrong_mode")

    @precondition(lambda self: not self.activity.moving)
    @rule(command=st.sampled_from(["move_j", "servo_start"]), ticks=st.sampled_from([1, 40, 150]))
    def set_off(self, command, ticks):
        """Start a motion, whatever that requires."""
        if self.lease is None or self.lease.token is None:
            self.gain_control(30.0, present=False)
        if self.activity is not Activity.REST:
            self.reset("lease", "RUNNING")
        self.command(command, "lease", 0.4)
        if command == "servo_start":
            self.stream("lease", 0.001, 10)
        else:
            self.wait(ticks)

    @precondition(lambda self: self.activity.moving)
    @rule(command=st.sampled_from(INTERFERING), whose=TOKENS)
    def interfere(self, command, whose):
        self.command(command, whose, 0.0)

    @precondition(lambda self: self.activity in {Activity.STREAMING, Activity.ENDING, Activity.REST})
    @rule(whose=TOKENS, offset=st.sampled_from([0.0, 0.001, 0.3]), count=st.integers(1, 40))
    def stream(self, whose, offset, count):
        for _ in range(count):
            self.setpoint(None, whose, offset)
            self.wait(1)

    @rule(whose=TOKENS, fault=st.sampled_from(["protective_stop", "nan", "reduced", "normal"]))
    def inject(self, whose, fault):
        if self.send(SimulationInject, whose, fault=fault) is None:
            return
        if fault == "protective_stop" and after(self.activity, fault) is not None:
            self.told.append("protective_stop")
            self.happen(fault)
        self.spoilt |= fault == "nan"
        self.reduced = {"reduced": True, "normal": False}.get(fault, self.reduced)

    @precondition(lambda self: self.activity is not Activity.REST)
    @rule(whose=TOKENS, mode=st.sampled_from(["RUNNING", "IDLE", "POWER_OFF", None]))
    def reset(self, whose, mode):
        if self.send(SimulationReset, whose, mode=mode, q=START if mode else None) is None:
            return
        self.spoilt = False
        if mode is not None:
            self.go(PUT[mode])
        elif self.activity.safety_mode(reduced=False) is SafetyMode.PROTECTIVE_STOP:
            self.go(Activity.PROTECTIVE_STOP)
        else:
            self.go(Activity.REST if self.activity.moving else self.activity)

    @rule(ticks=st.sampled_from([1, 5, 60, 130, 400]))
    def wait(self, ticks):
        """Let time pass; if that needs a step, send it as a client that may step."""
        if self.realtime:
            for _ in range(ticks):
                self.tick()
            return
        if self.clock is None and self.token("lease") == "nobody#1":
            self.take_clock("anna", None)
        self.step("clock" if self.clock else "lease", None, ticks, 0, {})

    @precondition(
        lambda self: self.activity.moving and (self.realtime or self.activity is not Activity.STREAMING)
    )
    @rule()
    def wait_for_rest(self):
        for _ in range(300):
            self.wait(10)
            if not self.activity.moving or self.activity in {Activity.PAUSED, Activity.GUIDED}:
                return
        raise AssertionError(f"{self.activity} for 6 s")

    def tick(self):
        """Apply what time itself causes if it passes by itself."""
        now = self.robot.now
        if self.lease is not None and now >= self.lease.ends:
            self.lose_lease()
        if self.activity is Activity.STREAMING and now - self.heard >= TIMEOUT:
            self.happen("interruption")
        self.host.tick()
        self.ticked()

    def ticked(self):
        """Check what a tick must report and do."""
        events, self.seen = self.sink.events[self.seen :], len(self.sink.events)
        codes, kinds = {event.code for event in events}, [event.kind for event in events]
        assert ("plant_failure" in codes) == self.spoilt
        if self.spoilt:
            self.spoilt = False
            self.told.append("protective_stop")
            self.happen("plant_failure")
        elif "limit_torque" in codes:
            self.told.append("protective_stop")
            self.happen("protective_stop")
        elif codes & BARRED:
            assert self.activity is Activity.GUIDED
            self.happen("interruption")
        if self.robot.motion.activity is not self.activity:
            assert self.robot.cycle.mode.at_rest
            self.happen("at_rest")
        assert self.robot.motion.activity is self.activity
        assert sorted(kind for kind in kinds if kind in TOLD) == sorted(self.told)
        self.told.clear()
        for event in events:
            if event.kind == "motion_started":
                self.running.add(event.id)
            elif event.kind in ENDS:
                self.running.remove(event.id)
        assert len(self.running) == (self.activity in {Activity.MOVING, Activity.PAUSED, Activity.GUIDED})
        state = self.sink.states[-1]
        assert state.robot_mode == self.activity.robot_mode
        assert state.safety_mode == self.activity.safety_mode(reduced=self.reduced)
        assert np.isfinite([*state.target_q, *state.actual_q, *state.actual_moment]).all()
        self.look()

    def look(self):
        """Check that each right has the holder of the model, and that the counts are right."""
        for mine, held in zip((self.lease, self.clock), self.host.standing, strict=True):
            assert (held and held.client) == (mine and mine.client)
            assert mine is None or mine.token in {None, held.token}
        counters = self.robot.counters
        assert counters.setpoints_received - counters.setpoints_refused == self.fed
        assert len(self.sink.states) == self.robot.tick_number
        if not self.in_step:  # which is counted by its end
            assert (counters.commands, counters.refused) == (self.sent, self.refused)

    def teardown(self):
        """Check that the robot stops and rests, and that its input suffices for an equal run."""
        self.stop()
        if self.activity.moving:
            self.wait_for_rest()
        assert not self.activity.moving
        if not self.realtime:
            again = replay(self.setup, self.sink.entries, self.sink.states)
            assert again.first_difference is None
            assert [state.actual_q for state in again.states] == [q.actual_q for q in self.sink.states]


@pytest.mark.parametrize("clock", ["realtime", "lockstep"])
@pytest.mark.parametrize(
    "full", [False, pytest.param(True, marks=[pytest.mark.nightly, pytest.mark.timeout(3600)])]
)
def test_random_sessions_match_the_model(clock, full):
    """The clocks lockstep and free are one to the controller."""
    runs = settings(
        max_examples=share(100 if full else 50),
        stateful_step_count=40 if full else 25,
        deadline=None,
        derandomize=not full,
    )
    run_state_machine_as_test(partial(Sessions, clock), settings=runs)
