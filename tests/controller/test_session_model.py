"""Random sessions of two clients against a small model that goes by the protocol's table of transitions.

The model knows who holds the lease until when, and what the robot is doing. What is up to the arm, when it comes to
rest and whether a drive was overloaded, it takes from the robot; everything else it foretells, every reply included.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, precondition, rule, run_state_machine_as_test
from tests.examples import share

from tvist_controller.controller import Controller
from tvist_controller.motion.setpoints import TIMEOUT
from tvist_protocol import commands as c
from tvist_protocol.modes import SafetyMode
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep
from tvist_protocol.transitions import Activity, after

from .robots import Q1, setup
from .test_modes import COMMANDS, STOPS

CLIENTS = st.sampled_from(["anna", "bert"])
SESSION = "1f"
LEASES = st.sampled_from([0.1, 0.4, 30.0, 30.0])
TOKENS = st.sampled_from(["own", "own", "own", "own", "own", "old", "none of ours"])
"""Whose token a command carries."""
MOTION = {name: kind for name, (kind, _) in COMMANDS.items()}
NUMBERED = {"move_j", "servo_j", "speed_j", "speed_l"}
"""Commands that are answered by the number of a motion."""
INTERFERING = [
    "pause", "pause", "resume", "servo_stop", "stop", "power_off", "servo_j", "speed_j", "stop_j", "stop_l",
]  # fmt: skip
PUT = {"RUNNING": Activity.REST, "IDLE": Activity.IDLE, "POWER_OFF": Activity.POWER_OFF}
ENDS = {"motion_done", "motion_stopped"}


@dataclass
class Lease:
    """What the model knows of it."""

    client: str
    token: str | None
    """None after a hand-over: nobody has been told it."""
    seconds: float
    ends: float
    watched: bool


class Sessions(RuleBasedStateMachine):
    """A robot in real time, whose time these rules let pass."""

    def __init__(self):
        super().__init__()
        self.robot = Controller(setup(clock="realtime"))
        self.lease: Lease | None = None
        self.activity = Activity.REST
        self.reduced = False
        self.spoilt = False
        self.heard = 0.0
        self.sequence = 0
        self.sent = self.refused = 0
        self.present: set[str] = set()
        self.old: list[str] = ["anna#0"]
        self.running: set[int] = set()
        self.told: list[str] = []
        """Kinds of events that the next tick must tell of."""

    def receive(self, command, session=None):
        """The reply to a command, which is counted."""
        reply = self.robot.receive(command, session=session)
        self.sent += 1
        self.refused += isinstance(reply, Refused)
        counters = self.robot.counters
        assert (counters.commands, counters.refused) == (self.sent, self.refused)
        return reply

    def token(self, whose):
        if whose == "own" and self.lease is not None and self.lease.token is not None:
            return self.lease.token
        return self.old[-1] if whose == "old" else "nobody#1"

    def refusal(self, token):
        """The code with which a command of this token is refused; a lease that it names is renewed."""
        if self.lease is None:
            return "no_control"
        if token != self.lease.token:
            return "stale_token"
        self.lease.ends = self.robot.now + self.lease.seconds
        return None

    def forget_lease(self):
        if self.lease.token is not None:
            self.old.append(self.lease.token)
        self.lease = None

    def lose_lease(self):
        self.forget_lease()
        self.told.append("lease_lost")
        self.happen("interruption")

    def go(self, target):
        if self.activity is Activity.STREAMING and target is not Activity.STREAMING:
            self.told.append("stream_stopped")
        self.activity = target

    def happen(self, trigger):
        """A trigger that leads nowhere changes nothing."""
        self.go(after(self.activity, trigger) or self.activity)

    def send(self, kind, whose, **fields):
        """Send a command that needs control; whether it was carried out."""
        token = self.token(whose)
        code = self.refusal(token)
        reply = self.receive(kind(token=token, **fields), session=self.session(fields.get("client")))
        if code is None:
            return reply
        assert isinstance(reply, Refused)
        assert (reply.code, reply.where) == (code, "token")
        return None

    def session(self, client):
        return SESSION if client in self.present else None

    # Hypothesis chooses among rules alike, whatever they do: so there are more of those that lead somewhere.

    @precondition(lambda self: self.lease is None or self.lease.token is None)
    @rule(seconds=LEASES, present=st.booleans())
    def gain_control(self, seconds, present):
        """Most of what can happen needs it."""
        client = "anna" if self.lease is None else self.lease.client
        (self.come if present else self.leave)(client)
        self.take(client, seconds)

    @precondition(lambda self: self.activity.moving and self.lease is not None)
    @rule(how=st.sampled_from(["release", "leave"]))
    def give_up(self, how):
        """In mid-motion."""
        if how == "release":
            self.release("own")
        else:
            self.leave(self.lease.client)

    @rule(data=st.data(), whose=TOKENS, client=CLIENTS, seconds=LEASES)
    def control(self, data, whose, client, seconds):
        match data.draw(st.sampled_from(["take", "keep_alive", "release", "hand_over", "come", "leave"])):
            case "take":
                self.take(client, seconds)
            case "keep_alive":
                self.keep_alive(whose)
            case "release":
                self.release(whose)
            case "hand_over":
                self.hand_over(whose, client)
            case "come":
                self.come(client)
            case "leave":
                self.leave(client)

    def take(self, client, seconds):
        reply = self.receive(c.TakeControl(client=client, lease_s=seconds), session=self.session(client))
        if self.lease is not None and self.lease.client != client:
            assert isinstance(reply, Refused)
            assert reply.code == "no_control"
            assert repr(self.lease.client) in reply.why
            return
        assert isinstance(reply, Accepted)
        assert reply.lease_s == seconds
        assert reply.token not in {*self.old, self.lease and self.lease.token}
        if self.lease is not None:
            self.forget_lease()
        self.lease = Lease(client, reply.token, seconds, self.robot.now + seconds, client in self.present)

    def keep_alive(self, whose):
        assert self.send(c.KeepAlive, whose) in {None, Done()}

    def release(self, whose):
        if self.send(c.ReleaseControl, whose) is not None:
            self.forget_lease()
            self.happen("interruption")

    def hand_over(self, whose, client):
        if self.send(c.HandOver, whose, client=client) is not None:
            seconds = self.lease.seconds
            self.forget_lease()
            self.lease = Lease(client, None, seconds, self.robot.now + seconds, client in self.present)

    def come(self, client):
        self.present.add(client)

    def leave(self, client):
        self.robot.client_gone(client, SESSION)
        self.present.discard(client)
        if self.lease is not None and self.lease.client == client and self.lease.watched:
            self.lose_lease()

    @rule(whose=TOKENS, client=CLIENTS, ticks=st.integers(1, 3))
    def ask_for_time(self, whose, client, ticks):
        """Time passes by itself here, whoever asks."""
        before = self.robot.tick_number
        replies = [self.receive(c.TakeClock(client=client), session=self.session(client))]
        stepped = self.send(SimulationStep, whose, ticks=ticks)
        replies += [] if stepped is None else [stepped]
        assert {(reply.code, reply.where) for reply in replies} == {("wrong_mode", "type")}
        released = self.receive(c.ReleaseClock(token=self.token(whose)))
        assert (released.code, self.robot.session.clock) == ("no_control", None)
        assert self.robot.tick_number == before

    @rule(command=st.sampled_from(sorted(MOTION)), whose=TOKENS, offset=st.sampled_from([0.0, 0.02, 0.4]))
    def command(self, command, whose, offset):
        fields = {
            "move_j": {"q": (offset, *Q1[1:])},
            "servo_start": {"velocity": 0.5},
            "servo_j": {"q": (offset, *Q1[1:])},
            "speed_j": {"qd": (offset, 0.0, 0.0, 0.0, 0.0, 0.0)},
            "speed_l": {"xd": (0.0, 0.0, 0.0, 0.0, 0.0, offset)},
        }.get(command, {})
        reply = self.send(MOTION[command], whose, **fields)
        if reply is None:
            return
        target = after(self.activity, command)
        if target is not None:
            assert isinstance(reply, Accepted if command in NUMBERED else Done), reply
            self.go(target)
            self.heard = self.robot.now if command == "servo_start" else self.heard
            self.sequence = 0 if command == "servo_start" else self.sequence
        elif command in STOPS:
            assert reply == Done()
        else:
            assert isinstance(reply, Refused)
            assert reply.code == ("busy" if reply.code == "busy" and self.activity.moving else "wrong_mode")

    @precondition(lambda self: not self.activity.moving)
    @rule(command=st.sampled_from(["move_j", "servo_start"]), ticks=st.sampled_from([1, 40, 150]))
    def set_off(self, command, ticks):
        """By whatever it takes."""
        if self.lease is None or self.lease.token is None:
            self.gain_control(30.0, present=False)
        if self.activity is not Activity.REST:
            self.reset("own", "RUNNING")
        self.command(command, "own", 0.4)
        if command == "servo_start":
            self.stream("own", 0.001, 10)
        else:
            self.wait(ticks)

    @precondition(lambda self: self.activity.moving)
    @rule(command=st.sampled_from(INTERFERING), whose=TOKENS)
    def interfere(self, command, whose):
        self.command(command, whose, 0.0)

    @precondition(lambda self: self.activity.moving)
    @rule()
    def stop_without_a_token(self):
        assert self.receive(c.Stop()) == Done()
        self.happen("stop")

    @precondition(lambda self: self.activity in {Activity.STREAMING, Activity.ENDING, Activity.REST})
    @rule(whose=TOKENS, offset=st.sampled_from([0.0, 0.001, 0.3]), count=st.integers(1, 40))
    def stream(self, whose, offset, count):
        for _ in range(count):
            token = self.token(whose)
            refused = self.robot.counters.setpoints_refused
            taken = (
                self.activity is Activity.STREAMING and self.lease is not None and token == self.lease.token
            )
            q = self.robot.cycle.sample.reference + offset * np.eye(6)[0]
            self.robot.receive_setpoint(c.Setpoint(token=token, sequence=self.sequence, q=tuple(q.tolist())))
            assert self.robot.counters.setpoints_refused == refused + (not taken)
            if taken:
                self.sequence += 1
                self.heard, self.lease.ends = self.robot.now, self.robot.now + self.lease.seconds
            self.tick()

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
        if self.send(SimulationReset, whose, mode=mode, q=tuple(Q1) if mode else None) is None:
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
        for _ in range(ticks):
            self.tick()

    @precondition(lambda self: self.activity.moving)
    @rule()
    def wait_for_rest(self):
        for _ in range(3000):
            self.tick()
            if not self.activity.moving or self.activity in {Activity.PAUSED, Activity.GUIDED}:
                return
        raise AssertionError(f"{self.activity} for 6 s")

    def tick(self):
        now = self.robot.now
        if self.lease is not None and now >= self.lease.ends:
            self.lose_lease()
        if self.activity is Activity.STREAMING and now - self.heard >= TIMEOUT:
            self.happen("interruption")
        state, events = self.robot.tick()
        kinds = [event.kind for event in events]
        failed = any(event.code == "plant_failure" for event in events)
        assert failed == self.spoilt
        if failed:
            self.spoilt = False
            self.told.append("protective_stop")
            self.happen("plant_failure")
        elif any(event.code == "limit_torque" for event in events):
            self.told.append("protective_stop")
            self.happen("protective_stop")
        elif any(event.code in BARRED for event in events):
            assert self.activity is Activity.GUIDED
            self.happen("interruption")
        if self.robot.motion.activity is not self.activity:
            assert self.robot.cycle.mode.at_rest
            self.happen("at_rest")
        assert self.robot.motion.activity is self.activity
        assert sorted(kind for kind in kinds if kind in TOLD) == sorted(self.told)
        self.told.clear()
        self.look(state, events)

    def look(self, state, events):
        """What holds after every tick."""
        assert state.robot_mode == self.activity.robot_mode
        assert state.safety_mode == self.activity.safety_mode(reduced=self.reduced)
        assert np.isfinite([*state.target_q, *state.actual_q, *state.actual_moment]).all()
        for event in events:
            if event.kind == "motion_started":
                self.running.add(event.id)
            elif event.kind in ENDS:
                self.running.remove(event.id)
        assert len(self.running) == (self.activity in {Activity.MOVING, Activity.PAUSED, Activity.GUIDED})
        held = self.robot.session.lease
        assert (held and held.client) == (self.lease and self.lease.client)

    def teardown(self):
        """Whatever went before: it stops, and rests."""
        self.stop_without_a_token()
        for _ in range(3000):
            if not self.activity.moving:
                return
            self.tick()
        raise AssertionError(f"{self.activity} for 6 s after a stop")


BARRED = {"collision", "limit_position", "singular"}
"""Codes of what may end a guided motion."""
TOLD = {"lease_lost", "stream_stopped", "protective_stop"}


@pytest.mark.parametrize(
    "runs", [100, pytest.param(500, marks=[pytest.mark.nightly, pytest.mark.timeout(3600)])]
)
def test_every_reply_and_every_change_is_as_the_table_says(runs):
    run_state_machine_as_test(
        Sessions,
        settings=settings(
            max_examples=share(runs), stateful_step_count=40, deadline=None, derandomize=runs == 100
        ),
    )
