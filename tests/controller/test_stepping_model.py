"""Random sequences of three clients' commands where a client lets time pass, against a small model of the two rights.

Commands come between steps and within them, as they do where others send while one steps. The model foretells every
reply and every tick, and the journal replays to the last bit.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule, run_state_machine_as_test
from tests.examples import share

from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import Admitted, admit
from tvist_controller.host import Host
from tvist_lab.replay import replay
from tvist_protocol import commands as c
from tvist_protocol.codec import encode
from tvist_protocol.io import SetRegisters
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.simulation import SimulationStep, StepSetpoint

from .robots import Kept, setup

CLIENTS = ("anna", "bert", "cora")
ACTIONS = (
    *(
        "take_control",
        "release_control",
        "take_clock",
        "take_clock",
        "release_clock",
        "leave",
        "come",
        "step",
    ),
    *("stop", "servo_start", "setpoint", "registers"),
)
TOKENS = st.sampled_from(["clock", "clock", "clock", "lease", "lease", "old", "nobody's"])


@dataclass(frozen=True)
class Right:
    """What the model knows of a lease, or of a hold of the clock."""

    client: str
    token: str
    session: str | None


class Steps(RuleBasedStateMachine):
    """A robot in lockstep."""

    @initialize(clock=st.sampled_from(["lockstep", "free"]))
    def begin(self, clock):
        self.setup = setup(clock=clock)
        self.sink = Kept()
        self.robot = Controller(self.setup)
        self.host = Host(self.robot, self.sink)
        self.lease: Right | None = None
        self.clock: Right | None = None
        self.old = ["anna#0", "anna#clock0"]
        self.there: set[str] = set()
        self.streaming = False
        self.sequence = 0
        self.in_step = False
        self.fed = 0
        """Set-points that the robot took."""

    def session(self, client):
        return f"session of {client}" if client in self.there else None

    def token(self, whose):
        right = {"clock": self.clock, "lease": self.lease}.get(whose)
        if right is not None:
            return right.token
        return self.old[-1] if whose == "old" else "nobody#1"

    def refused_step(self, token, motion_token, count):
        """Code and field with which a step is refused; None where time passes."""
        if self.clock is None:
            code = self.refused(self.lease, token)
        elif token == self.clock.token:
            code = None
        else:
            code = "no_control" if self.lease and token == self.lease.token else "stale_token"
        if code is not None:
            return code, "token"
        if motion_token is not None:
            code = self.refused(self.lease, motion_token)
            if code is not None:
                return code, "motion_token"
        elif count and self.clock is not None:
            return "missing_field", "motion_token"
        return ("wrong_mode", "setpoints") if count and not self.robot.motion.streaming else None

    @staticmethod
    def refused(right, token):
        if right is None:
            return "no_control"
        return None if token == right.token else "stale_token"

    def may_step(self, token):
        right = self.lease if self.clock is None else self.clock
        return right is not None and right.token == token

    def send(self, command, attend=None):
        """What a client sends over a network: its session is known where it is there."""
        before = self.robot.tick_number
        admitted = admit(encode(command), self.host.standing.lease, self.host.standing.clock)
        if isinstance(admitted, Admitted):
            if isinstance(command, c.TakeControl | c.TakeClock):
                admitted = admitted._replace(session=self.session(command.client))
            reply = self.host.carry_out(admitted, attend=attend)
        else:
            reply = admitted
        if not isinstance(command, SimulationStep):
            assert self.robot.tick_number == before, "nothing but a step lets time pass"
        return reply

    def look(self):
        """Each right has at most one holder, the one that the model says."""
        lease, hold = self.robot.session.lease, self.robot.session.clock
        assert (lease and lease.client) == (self.lease and self.lease.client)
        assert (hold and hold.client) == (self.clock and self.clock.client)
        assert (hold and hold.token) == (self.clock and self.clock.token)
        assert self.host.standing.clock is hold
        assert len(self.sink.states) == self.robot.tick_number
        counters = self.robot.counters
        assert counters.setpoints_received - counters.setpoints_refused == self.fed

    @rule(action=st.sampled_from(ACTIONS), client=st.sampled_from(CLIENTS), whose=TOKENS)
    def between(self, action, client, whose):
        self.act(action, client, whose)
        self.look()

    def act(self, action, client, whose):
        getattr(self, f"do_{action}")(client, whose)

    def do_take_control(self, client, _):
        self.lease = self.taken(c.TakeControl(client=client), self.lease)

    def do_take_clock(self, client, _):
        self.clock = self.taken(c.TakeClock(client=client), self.clock)

    def taken(self, command, right):
        reply = self.send(command)
        if right is not None and right.client != command.client:
            assert isinstance(reply, Refused)
            assert reply.code == "no_control"
            assert repr(right.client) in reply.why
            return right
        assert isinstance(reply, Accepted)
        assert reply.token not in {
            *self.old,
            self.lease and self.lease.token,
            self.clock and self.clock.token,
        }
        if right is not None:
            self.old.append(right.token)
        return Right(command.client, reply.token, self.session(command.client))

    def do_release_control(self, _, whose):
        token = self.token(whose)
        code = self.refused(self.lease, token)
        assert getattr(self.send(c.ReleaseControl(token=token)), "code", None) == code
        if code is None:
            self.old.append(token)
            self.lease = None

    def do_release_clock(self, _, whose):
        token = self.token(whose)
        code = self.refused(self.clock, token)
        assert getattr(self.send(c.ReleaseClock(token=token)), "code", None) == code
        if code is None:
            self.old.append(token)
            self.clock = None

    def do_come(self, client, _):
        self.there.add(client)

    def do_leave(self, client, _):
        session = self.session(client)
        self.there.discard(client)
        if session is None:
            return
        self.host.client_gone(client, session)
        for name in ("lease", "clock"):
            right = getattr(self, name)
            if right is not None and (right.client, right.session) == (client, session):
                self.old.append(right.token)
                setattr(self, name, None)

    def do_stop(self, *_):
        assert self.send(c.Stop()) == Done()

    def do_registers(self, *_):
        assert self.send(SetRegisters(bank="input_int", values=(1,))) == Done()

    def do_servo_start(self, _, whose):
        if isinstance(self.send(c.ServoStart(token=self.token(whose))), Done):
            self.sequence = 0

    def do_setpoint(self, _, whose):
        token = self.token(whose)
        taken = self.lease is not None and token == self.lease.token and self.robot.motion.streaming
        refused = self.robot.counters.setpoints_refused
        self.host.setpoint(encode(c.Setpoint(token=token, sequence=self.sequence, q=self.here())))
        assert (self.robot.counters.setpoints_refused == refused) == taken
        self.sequence += taken
        self.fed += taken

    def do_step(self, _, whose):
        if self.in_step:  # within a step of a host without a queue: in a callback of its caller's
            token = self.token(whose)
            reply = self.send(SimulationStep(token=token, ticks=1))
            assert reply.code == (self.refused_step(token, None, 0) or ("busy",))[0]
        else:
            self.step(whose, None, 1, 0, {})

    @rule(
        whose=TOKENS,
        motion=st.one_of(st.none(), TOKENS),
        ticks=st.sampled_from([1, 2, 5, 9]),
        count=st.sampled_from([0, 0, 0, 1, 4]),
        within=st.dictionaries(
            st.integers(0, 8),
            st.tuples(st.sampled_from(ACTIONS), st.sampled_from(CLIENTS), TOKENS),
            max_size=3,
        ),
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

        def attend():
            nonlocal passed, ended
            if passed in within:
                self.act(*within[passed])
            ended = not self.may_step(token)
            feeds = self.lease is not None and self.lease.token == (motion_token or token)
            self.fed += not ended and passed < count and feeds and self.robot.motion.streaming
            passed += not ended
            return True

        self.in_step = True
        reply = self.send(command, attend)
        self.in_step = False
        if refusal is not None:
            assert isinstance(reply, Refused)
            assert (reply.code, reply.where) == refusal
            assert self.robot.tick_number == before
        else:
            assert reply == Done(tick=before + passed)
            assert self.robot.tick_number == before + passed
            assert ended or passed == ticks
            self.sequence += count
        self.look()

    def here(self):
        return tuple(self.robot.cycle.sample.reference.tolist())

    def teardown(self):
        """What reached the robot, with its tick, is all that an equal run needs."""
        if not hasattr(self, "sink"):
            return
        again = replay(self.setup, self.sink.entries, self.sink.states)
        assert again.first_difference is None
        assert np.array_equal(
            [state.actual_q for state in again.states], [state.actual_q for state in self.sink.states]
        )


@pytest.mark.parametrize(
    "runs", [60, pytest.param(400, marks=[pytest.mark.nightly, pytest.mark.timeout(3600)])]
)
def test_time_passes_by_the_steps_of_who_may_and_by_nothing_else(runs):
    run_state_machine_as_test(
        Steps,
        settings=settings(
            max_examples=share(runs), stateful_step_count=30, deadline=None, derandomize=runs == 60
        ),
    )
