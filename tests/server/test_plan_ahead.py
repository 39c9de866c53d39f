"""Plans made beside the controller's thread have the same results in the same order."""

import threading
from collections import deque

import pytest
from tests.controller.robots import Q2, Q3, Kept, Robot, setup

from tvist_controller.controller import Controller
from tvist_controller.dispatch.planner import Planner
from tvist_controller.host import Host
from tvist_protocol import commands as c
from tvist_protocol.channels import tag
from tvist_protocol.codec import encode
from tvist_protocol.programs import ProgramLoad, ProgramStop
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.values import Payload
from tvist_server.intake import RobotIntake
from tvist_server.plan_ahead import MAX_WAITING, PlanAhead
from tvist_server.program_folder import ProgramFolder

WAIT = 20.0
LIGHT = {"mass": 2.0, "com": (0.0, 0.0, 0.04), "inertia": (0.002, 0.0, 0.0, 0.002, 0.0, 0.002)}


class Served:
    """A robot whose jobs run when the test says."""

    def __init__(self, folder=None, **changes):
        start = setup(clock="realtime", **changes)
        self.sink = Kept()
        self.host = Host(Controller(start), self.sink)
        self.jobs, self.came = deque(), threading.Condition()
        self.ahead = PlanAhead(self.host, Planner(start), self.post, ProgramFolder(folder).complete)
        self.ahead.start()
        self.intake = RobotIntake(self.host, self.post, self.ahead.submit)
        self.replies = []
        self.token = self.ask(c.TakeControl(client="anna", lease_s=3600.0)).token

    def post(self, job, client=None):  # noqa: ARG002  no job here is a step
        with self.came:
            self.jobs.append(job)
            self.came.notify()

    def send(self, command):
        self.intake.request(encode(command), self.replies.append)

    def of(self, kind, **fields):
        return kind(token=self.token, **fields)

    def serve(self, replies):
        while len(self.replies) < replies:
            self.do_next()

    def do_next(self):
        with self.came:
            assert self.came.wait_for(lambda: self.jobs, WAIT), "no job came"
            job = self.jobs.popleft()
        job()

    def empty(self, ticks=0):
        """Run jobs, and ticks between them, until nothing waits any more."""
        while self.ahead._count or self.jobs:
            with self.came:
                job = self.jobs.popleft() if self.came.wait_for(lambda: self.jobs, 0.01) else None
            if job is not None:
                job()
                self.tick(ticks)

    def ask(self, command):
        wanted = len(self.replies) + 1
        self.send(command)
        self.serve(wanted)
        return self.replies[-1]

    def tick(self, ticks=1):
        for _ in range(ticks):
            self.host.tick()

    def close(self):
        self.ahead.end()
        self.ahead.close()


@pytest.fixture
def served():
    served = Served()
    yield served
    served.close()


def test_a_plan_made_ahead_equals_one_made_in_the_tick(served):
    commands = [
        (c.SetShaper, {"name": "auto"}),
        (c.MoveJ, {"q": tuple(Q2.tolist())}),
        (c.SetPayload, LIGHT),
        (c.SetShaper, {"name": "ei3"}),
        (c.Stop, {}),
    ]
    alone = Robot()
    for kind, fields in commands:
        assert type(served.ask(served.of(kind, **fields))) is type(alone.send(kind, **fields))
        served.tick(40)
        alone.tick(40)
    assert [state.target_q for state in served.sink.states] == [state.target_q for state in alone.states]


def test_a_program_of_the_folder_is_journaled_with_its_text(tmp_path):
    (tmp_path / "wait.script").write_text("sync()\n")
    (tmp_path / "bad.urp").write_bytes(b"\xff")
    served = Served(tmp_path)
    names = ("wait.urp", "bad.urp", "nothing.urp", "Q1.urp")
    replies = [served.ask(ProgramLoad(name=name)) for name in names]
    served.close()
    assert [type(reply) for reply in replies] == [Done, Refused, Refused, Done]
    assert [reply.where for reply in replies[1:3]] == ["name", "name"]
    loads = [entry.message for entry in served.sink.entries if entry.message["type"] == tag(ProgramLoad)]
    assert {load["name"]: load.get("text") for load in loads} == {"wait.urp": "sync()\n", "Q1.urp": None}


def test_an_outdated_plan_is_made_again(served):
    """The other payload is set while the plan waits."""
    move = served.of(c.MoveJ, q=tuple(Q3.tolist()))
    served.send(move)
    served.do_next()  # tells what the plan depends on
    with served.came:
        assert served.came.wait_for(lambda: served.jobs, WAIT), "it is planned"
    served.host.controller.receive(served.of(c.SetPayload, **LIGHT))
    served.tick()
    served.serve(len(served.replies) + 1)
    assert isinstance(served.replies[-1], Accepted)
    alone = Robot()
    alone.send(c.SetPayload, **LIGHT)
    alone.tick()
    alone.send(c.MoveJ, q=move.q)
    served.tick(300)
    alone.tick(300)
    assert [state.target_q for state in served.sink.states] == [state.target_q for state in alone.states]
    assert served.host.controller.declared == Payload(**LIGHT)


def test_commands_of_one_client_keep_their_order(served):
    sent = [
        served.of(c.SetShaper, name="zvd"),
        served.of(c.KeepAlive),
        served.of(c.SetPayload, **LIGHT),
        served.of(c.SetSpeed, fraction=0.5),
        served.of(c.MoveJ, q=tuple(Q2.tolist())),
        served.of(c.KeepAlive),
        served.of(c.Stop),
        c.Stop(),
    ]
    for command in sent:
        served.send(command)
    served.serve(1 + len(sent))
    served.empty()
    assert {type(reply) for reply in served.replies[1:]} == {Done, Accepted}
    journaled = [entry.message["type"] for entry in served.sink.entries]
    in_turn = [tag(type(command)) for command in sent]
    waits = [kind for kind in in_turn if kind not in {"stop", "keep_alive"}]
    assert [kind for kind in journaled if kind not in {"stop", "keep_alive"}] == ["take_control", *waits]
    assert journaled.index("keep_alive") < journaled.index("set_payload"), "a lease is renewed at once"
    assert journaled[-2:] == ["stop", "stop"], "once more in their turn"
    served.tick(30)
    assert [event.kind for event in served.sink.events if event.id] == ["motion_started", "motion_stopped"]
    assert served.sink.states[-1].target_qd == [0.0] * 6


@pytest.mark.parametrize(("stop", "waiting"), [(c.Stop(), 0), (c.Stop(), 12), (ProgramStop(), 12)])
def test_a_stop_also_ends_motions_that_wait_to_be_planned(served, waiting, stop):
    """This also holds if the arm moves when both are sent, so that the motion is planned later."""
    served.ask(served.of(c.MoveJ, q=(*Q2[:5].tolist(), 0.05)))
    served.tick(40)
    for _ in range(waiting):
        served.send(served.of(c.SetShaper, name="zv"))
    served.send(served.of(c.MoveJ, q=tuple(Q3.tolist())))
    served.send(stop)
    served.empty(ticks=3)
    served.tick(60)
    last, before = served.sink.states[-1], served.sink.states[-2]
    assert (last.target_q, max(map(abs, last.target_qd))) == (before.target_q, 0.0)


@pytest.mark.parametrize("stop", [c.Stop(), ProgramStop()])
def test_a_stop_does_not_wait_for_commands_that_are_planned(served, stop):
    served.ask(served.of(c.MoveJ, q=tuple(Q2.tolist())))
    served.tick(100)
    for _ in range(MAX_WAITING):
        served.send(served.of(c.SetShaper, name="auto"))
    replies = []
    served.intake.request(encode(stop), replies.append)
    served.empty()
    assert replies == [Done()]
    kinds = [entry.message["type"] for entry in served.sink.entries]
    assert kinds.index(tag(type(stop))) < len(kinds) - 5, "most of the others were still to be planned"


def test_commands_beyond_the_queue_are_refused_as_busy(served):
    for _ in range(3 * MAX_WAITING):
        served.send(served.of(c.SetShaper, name="zv"))
    served.serve(1 + 3 * MAX_WAITING)
    busy = [reply for reply in served.replies[1:] if isinstance(reply, Refused)]
    assert {reply.code for reply in busy} == {"busy"}
    assert 0 < len(busy) <= 2 * MAX_WAITING
    assert served.ask(served.of(c.KeepAlive)) == Done()


def test_messages_without_control_do_not_reach_the_controller(served):
    before, jobs = len(served.sink.entries), len(served.jobs)
    strangers = [
        c.MoveJ(token="x", q=tuple(Q2.tolist())),
        c.TakeControl(client="bert"),
        c.Stop(token="x"),
        c.SetShaper(token="x", name="auto"),
    ]
    for command in strangers:
        served.send(command)
    served.intake.request(b"\xc1", served.replies.append)
    served.intake.setpoint(encode(c.Setpoint(token="x", sequence=0, q=tuple(Q2.tolist()))))
    assert [type(reply) for reply in served.replies[1:]] == [Refused] * 5
    assert (len(served.sink.entries), len(served.jobs)) == (before, jobs)
    assert (served.intake.commands_refused, served.intake.setpoints_refused) == (5, 1)


def test_control_granted_to_a_disconnected_client_ends_at_once(served):
    served.ask(served.of(c.ReleaseControl))
    served.intake.client_seen("bert", "1f")
    served.send(c.TakeControl(client="bert"))
    served.intake.client_gone("bert", "1f")
    served.serve(len(served.replies) + 1)
    served.empty()
    assert served.host.standing.lease is None


def test_a_second_session_of_a_client_neither_gets_nor_keeps_control(served):
    served.ask(served.of(c.ReleaseControl))
    served.intake.client_seen("bert", "1f")
    assert isinstance(served.ask(c.TakeControl(client="bert")), Accepted)
    served.intake.client_seen("bert", "2f")
    assert served.ask(c.TakeControl(client="bert")).code == "no_control"
    served.intake.session_gone("1f")
    served.empty()
    assert served.host.standing.lease is None
    assert isinstance(served.ask(c.TakeControl(client="bert")), Accepted), "one of that name is left"


def test_a_command_that_raises_is_in_the_journal(served, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError

    monkeypatch.setattr(served.host.controller, "receive", broken)
    served.send(served.of(c.KeepAlive))
    with pytest.raises(ZeroDivisionError):
        served.jobs.popleft()()
    assert served.sink.entries[-1].message["type"] == "keep_alive"


def test_a_failed_plan_is_refused_and_the_next_command_is_planned(served, monkeypatch, caplog):
    planner = served.ahead._planner
    with monkeypatch.context() as patch:
        patch.setattr(planner, "plan", lambda *_: 1 / 0)
        assert served.ask(served.of(c.SetShaper, name="zvd")).code == "wrong_mode"
    assert "ZeroDivisionError" in caplog.text
    assert served.ask(served.of(c.SetShaper, name="zvd")) == Done()


def test_a_robot_whose_programs_cannot_be_compiled_still_moves(monkeypatch, caplog):
    monkeypatch.setattr(Planner, "rehearse_scripts", lambda _: 1 / 0)
    served = Served()
    assert isinstance(served.ask(served.of(c.MoveJ, q=tuple(Q2.tolist()))), Accepted)
    served.close()
    assert "programs cannot be compiled" in caplog.text
