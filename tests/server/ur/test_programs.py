"""Programs made of named poses, and their player."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.server.robots import Q1, Q2, Q3, UR5E

from tvist_protocol import commands as c
from tvist_protocol.replies import Accepted, Done, Refused
from tvist_protocol.stream import Event
from tvist_server.gateways.ur.programs import Programs, ProgramState

from .decoders import message
from .hosts import host, told


class Answers:
    """Hears whether it was done."""

    def __init__(self):
        self.heard = []

    def __call__(self, done):
        self.heard.append(done)


class Motions:
    """A control whose moves are accepted with rising numbers; replies can be kept back."""

    def __init__(self):
        self.held_by_other = False
        self.commands, self.waiting = [], None
        self.number = 0
        self.refusals = {}
        self.left = 0

    def lasting(self):
        return self

    def leave(self):
        self.left += 1

    def change(self, command, then):
        self.ask(command("token"), then)

    def ask(self, command, then):
        self.commands.append(command)
        if type(command) in self.refusals:
            reply = Refused(code=self.refusals[type(command)], where="", why="because")
        elif isinstance(command, c.MoveJ):
            self.number += 1
            reply = Accepted(id=self.number)
        else:
            reply = Done()
        if self.waiting is None:
            then(reply)
        else:
            self.waiting.append((then, reply))

    def flush(self):
        waiting, self.waiting = self.waiting, None
        for then, reply in waiting:
            then(reply)

    @property
    def targets(self):
        return [command.q for command in self.commands if isinstance(command, c.MoveJ)]

    def kinds(self):
        return [type(command) for command in self.commands]


@pytest.fixture
def motions():
    return Motions()


@pytest.fixture
def answers():
    return Answers()


@pytest.fixture
def programs(robot):
    return host(robot).programs


def load(programs, path, control):
    """Whether it was there, and the one before has ended."""
    heard = []
    programs.load(path, control, heard.append)
    return heard == [True]


def done(number, kind="motion_done"):
    return Event(tick=1, kind=kind, id=number)


def titles(robot):
    return [(one.kind, one.values.get("title")) for one in told(robot)]


STARTED, STOPPED, EXCEPTION = (7, "PROGRAM_XXX_STARTED"), (7, "PROGRAM_XXX_STOPPED"), (10, None)


def test_there_is_a_program_for_each_pose_and_one_through_all_of_them_and_back(programs):
    assert set(programs.known) == {"wait_program.urp", "paper.urp", "Q1.urp", "Q2.urp", "Q3.urp"}
    assert [move.q for move in programs.known["paper.urp"]] == [tuple(q) for q in (Q1, Q2, Q3, Q2, Q1)]
    assert [move.q for move in programs.known["Q2.urp"]] == [tuple(Q2)]


def test_an_arm_without_poses_can_only_wait():
    bare = SimpleNamespace(
        description=SimpleNamespace(poses={}),
        latest=None,
        tell=pytest.fail,
    )
    assert set(Programs(bare).known) == {"wait_program.urp"}


def test_a_program_plays_its_moves_in_order_and_then_stops(programs, robot, motions, answers):
    assert load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    assert answers.heard == [True]
    for number in range(1, 6):
        assert programs.playing
        assert len(motions.targets) == number
        programs.event(done(number + 100))  # not ours
        assert len(motions.targets) == number
        programs.event(done(number))
    assert motions.targets == [tuple(q) for q in (Q1, Q2, Q3, Q2, Q1)]
    assert programs.state is ProgramState.STOPPED
    assert titles(robot) == [STARTED, STOPPED]
    assert [one.values["text"] for one in told(robot)] == ["paper", "paper"]


def test_it_can_be_played_again(programs, robot, motions, answers):
    load(programs, "Q2.urp", motions)
    for number in (1, 2):
        programs.play(motions, answers)
        programs.event(done(number))
    assert answers.heard == [True, True]
    assert titles(robot) == [STARTED, STOPPED] * 2


def test_a_motion_that_ends_before_its_number_is_known_counts(programs, motions, answers):
    load(programs, "Q2.urp", motions)
    motions.waiting = []
    programs.play(motions, answers)
    programs.event(done(1))
    assert programs.playing
    assert answers.heard == []
    motions.flush()
    assert answers.heard == [True]
    assert programs.state is ProgramState.STOPPED


def test_what_was_not_loaded_cannot_play(programs, motions, answers):
    programs.play(motions, answers)
    assert not load(programs, "nothing.urp", motions)
    assert not load(programs, "paper", motions)
    assert programs.name is None
    programs.play(motions, answers)
    assert answers.heard == [False, False]
    assert not motions.commands


def test_folders_do_not_matter(programs, motions):
    assert load(programs, "/ursim/programs/wait_program.urp", motions)
    assert (programs.path, programs.name) == ("/ursim/programs/wait_program.urp", "wait_program.urp")
    assert load(programs, "Q1.urp", motions)
    assert programs.path == "/programs/Q1.urp"
    assert not load(programs, "/programs/", motions)
    assert not load(programs, "", motions)
    assert programs.name == "Q1.urp"


def test_a_program_does_not_start_where_the_arm_may_not_move(programs, robot, motions, answers, ur5e):
    load(programs, "Q2.urp", motions)
    robot.latest = ur5e(mode="IDLE").tick()
    programs.play(motions, answers)
    stopped = ur5e()
    stopped.send(c.SimulationInject, fault="protective_stop")
    robot.latest = stopped.tick(5)
    programs.play(motions, answers)
    robot.latest = None
    programs.play(motions, answers)
    assert answers.heard == [False] * 3
    assert not motions.commands


@pytest.mark.parametrize("name", ["Q2.urp", "wait_program.urp"])
def test_a_program_does_not_start_without_control(programs, robot, motions, answers, name):
    load(programs, name, motions)
    motions.held_by_other = True
    programs.play(motions, answers)
    assert answers.heard == [False]
    assert not robot.told


@pytest.mark.parametrize("code", ["no_control", "stale_token", "busy", "wrong_mode"])
def test_a_start_that_is_refused_for_the_moment_is_no_start(programs, robot, motions, answers, code):
    load(programs, "Q2.urp", motions)
    motions.refusals[c.MoveJ] = code
    programs.play(motions, answers)
    assert answers.heard == [False]
    assert programs.state is ProgramState.STOPPED
    assert not robot.told


def test_a_move_that_cannot_be_made_ends_the_program_with_an_exception_that_names_its_line(
    programs, robot, motions, answers
):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    programs.event(done(1))
    motions.refusals[c.MoveJ] = "collision"
    programs.event(done(2))
    assert titles(robot) == [STARTED, EXCEPTION, STOPPED]
    exception = told(robot)[1].values
    assert (exception["line"], exception["column"]) == (3, 1)
    assert exception["text"] == "move to Q3 was refused: because"
    assert programs.state is ProgramState.STOPPED


def test_a_first_move_that_cannot_be_made_is_a_failed_start(programs, robot, motions, answers):
    load(programs, "Q2.urp", motions)
    motions.refusals[c.MoveJ] = "collision"
    programs.play(motions, answers)
    assert answers.heard == [False]
    assert titles(robot) == [STARTED, EXCEPTION, STOPPED]


def test_a_motion_that_others_stop_ends_the_program(programs, robot, motions, answers):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    programs.event(done(1, "motion_stopped"))
    assert programs.state is ProgramState.STOPPED
    assert titles(robot) == [STARTED, STOPPED]
    assert len(motions.targets) == 1


def test_pause_and_play_hold_the_motion_and_go_on(programs, motions, answers):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    programs.pause(motions, answers)
    assert programs.paused
    programs.pause(motions, answers)
    programs.play(motions, answers)
    assert programs.playing
    programs.play(motions, answers)
    assert answers.heard == [True, True, False, True, False]
    assert motions.kinds() == [c.MoveJ, c.Pause, c.Resume]


def test_a_motion_that_ended_as_it_was_paused_leaves_the_next_to_play(programs, motions, answers):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    motions.refusals[c.Pause] = "wrong_mode"
    programs.pause(motions, answers)
    programs.event(done(1))
    assert programs.paused
    assert len(motions.targets) == 1
    programs.play(motions, answers)
    assert answers.heard == [True] * 3
    assert len(motions.targets) == 2


def test_a_program_paused_in_its_last_move_ends_when_it_goes_on(programs, robot, motions, answers):
    load(programs, "Q2.urp", motions)
    programs.play(motions, answers)
    programs.pause(motions, answers)
    programs.event(done(1))
    assert programs.paused
    programs.play(motions, answers)
    assert answers.heard == [True] * 3
    assert programs.state is ProgramState.STOPPED
    assert titles(robot) == [STARTED, STOPPED]


def test_a_pause_without_control_changes_nothing(programs, motions, answers):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    motions.refusals[c.Pause] = "no_control"
    programs.pause(motions, answers)
    assert programs.playing
    programs.event(done(1))
    assert len(motions.targets) == 2
    del motions.refusals[c.Pause]
    programs.pause(motions, answers)
    motions.refusals[c.Resume] = "no_control"
    programs.play(motions, answers)
    assert programs.paused
    assert answers.heard == [True, False, True, False]


def test_a_program_goes_on_after_a_pause_that_was_refused_too_late(programs, motions, answers):
    """The motion ends between the pause and its refusal: the next one begins all the same."""
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    motions.refusals[c.Pause] = "no_control"
    motions.waiting = []
    programs.pause(motions, answers)
    programs.event(done(1))
    motions.flush()
    assert programs.playing
    assert len(motions.targets) == 2


def test_stop_stops_the_arm_and_the_program(programs, robot, motions, answers):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    programs.stop(motions, answers)
    assert motions.kinds() == [c.MoveJ, c.Stop]
    programs.event(done(1, "motion_stopped"))
    assert titles(robot) == [STARTED, STOPPED]
    programs.stop(motions, answers)
    assert answers.heard == [True] * 3
    assert titles(robot) == [STARTED, STOPPED]


def test_a_start_that_is_stopped_before_it_is_answered_has_failed(programs, robot, motions, answers):
    load(programs, "paper.urp", motions)
    motions.waiting = []
    programs.play(motions, answers)
    stopping = Answers()
    programs.stop(motions, stopping)
    motions.flush()
    assert (answers.heard, stopping.heard) == ([False], [True])
    assert not robot.told
    assert motions.kinds() == [c.MoveJ, c.Stop]
    programs.event(done(1, "motion_stopped"))
    assert programs.state is ProgramState.STOPPED
    programs.play(motions, answers)
    assert answers.heard == [False, True]
    programs.event(done(2))
    assert len(motions.targets) == 3


def test_loading_ends_the_program_that_runs(programs, robot, motions, answers):
    load(programs, "paper.urp", motions)
    programs.play(motions, answers)
    assert load(programs, "Q1.urp", motions)
    assert (programs.state, programs.name) == (ProgramState.STOPPED, "Q1.urp")
    assert motions.kinds() == [c.MoveJ, c.Stop]
    assert [one.values["text"] for one in told(robot)] == ["paper", "paper"]


def test_waiting_plays_until_it_is_stopped(programs, robot, motions, answers):
    load(programs, "wait_program.urp", motions)
    programs.play(motions, answers)
    programs.event(done(1))
    assert programs.playing
    programs.pause(motions, answers)
    assert programs.paused
    programs.play(motions, answers)
    assert programs.playing
    programs.stop(motions, answers)
    assert answers.heard == [True] * 4
    assert titles(robot) == [STARTED, STOPPED]
    assert motions.kinds() == [c.Stop]


@pytest.mark.parametrize("kind", ["protective_stop", "lease_lost"])
@pytest.mark.parametrize("name", ["wait_program.urp", "Q2.urp"])
def test_a_program_ends_where_the_arm_may_move_no_longer(programs, robot, motions, answers, kind, name):
    load(programs, name, motions)
    programs.play(motions, answers)
    programs.event(Event(tick=1, kind=kind))
    assert programs.state is ProgramState.STOPPED
    programs.event(done(1, "motion_stopped"))
    assert titles(robot) == [STARTED, STOPPED]


def test_control_is_held_as_long_as_the_program_plays(programs, motions, answers):
    load(programs, "Q2.urp", motions)
    programs.play(motions, answers)
    programs.pause(motions, answers)
    assert motions.left == 0
    other = Motions()
    programs.play(other, answers)
    assert (motions.left, other.left) == (1, 0)
    programs.event(done(1))
    assert programs.state is ProgramState.STOPPED
    assert (motions.left, other.left) == (1, 1)


class Direct:
    """A control that is a real controller in lockstep."""

    held_by_other = False

    def lasting(self):
        return self

    def leave(self): ...

    def __init__(self, robot):
        self.robot = robot

    def change(self, command, then):
        self.ask(command(self.robot.token), then)

    def ask(self, command, then):
        then(self.robot.controller.receive(command))


def test_a_real_controller_is_taken_through_the_papers_moves(robot, ur5e, answers):
    arm = ur5e(q=tuple(Q2))
    programs, control = host(robot).programs, Direct(arm)
    load(programs, "paper.urp", control)
    robot.latest = arm.tick()
    programs.play(control, answers)
    reached = []
    for _ in range(30_000):
        robot.latest = arm.tick()
        for event in arm.events:
            programs.event(event)
            if event.kind == "motion_done":
                reached.append(robot.latest.target_q)
        if not programs.playing:
            break
    assert answers.heard == [True]
    assert [pytest.approx(tuple(q), abs=1e-6) for q in (Q1, Q2, Q3, Q2, Q1)] == reached
    assert titles(robot) == [STARTED, STOPPED]


def test_a_real_motion_is_paused_and_goes_on_to_its_target(robot, ur5e, answers):
    arm = ur5e()
    programs, control = host(robot).programs, Direct(arm)
    load(programs, "Q2.urp", control)
    robot.latest = arm.tick()
    programs.play(control, answers)
    arm.tick(200)
    programs.pause(control, answers)
    held = arm.tick(1000)
    assert held.runtime_state == 4
    assert arm.tick(100).target_q == pytest.approx(held.target_q)
    programs.play(control, answers)
    for _ in range(5000):
        end = arm.tick()
        for event in arm.events:
            programs.event(event)
    assert programs.state is ProgramState.STOPPED
    assert end.target_q == pytest.approx(list(Q2), abs=1e-6)
    assert answers.heard == [True] * 3


STEPS = st.lists(
    st.sampled_from(
        ["load", "wait", "play", "pause", "stop", "done", "stopped", "flush", "keep", "refuse", "allow"]
    ),
    max_size=40,
)


@given(STEPS)
def test_whatever_happens_each_request_is_answered_once_and_starts_and_stops_alternate(steps):
    packages = []
    latest = SimpleNamespace(robot_mode=7, safety_mode=1, timestamp=41.0)
    programs = Programs(SimpleNamespace(description=UR5E, latest=latest, tell=packages.append))
    motions, answers, asked = Motions(), Answers(), 0
    for step in steps:
        if step == "load":
            load(programs, "paper.urp", motions)
        elif step == "wait":
            load(programs, "wait_program.urp", motions)
        elif step in {"play", "pause", "stop"}:
            asked += 1
            getattr(programs, step)(motions, answers)
        elif step in {"done", "stopped"}:
            programs.event(done(motions.number, f"motion_{step}"))
        elif step == "keep" and motions.waiting is None:
            motions.waiting = []
        elif step == "flush" and motions.waiting is not None:
            motions.flush()
        elif step in {"refuse", "allow"}:
            motions.refusals = (
                dict.fromkeys((c.MoveJ, c.Pause, c.Resume), "no_control") if step == "refuse" else {}
            )
    if motions.waiting is not None:
        motions.flush()
    assert len(answers.heard) == asked
    programs.stop(motions, answers)
    said = [one.values["title"] for one in map(message, packages) if one.kind == 7]
    assert said[::2] == ["PROGRAM_XXX_STARTED"] * len(said[::2])
    assert said[1::2] == ["PROGRAM_XXX_STOPPED"] * len(said[1::2])
    assert len(said) % 2 == 0


@pytest.mark.parametrize("name", ["Q2.urp", "wait_program.urp"])
def test_no_program_survives_an_arm_without_power(programs, robot, motions, answers, ur5e, name):
    load(programs, name, motions)
    programs.play(motions, answers)
    programs.watch(robot.latest)
    assert programs.playing
    programs.watch(ur5e(mode="POWER_OFF").tick())
    assert programs.state is ProgramState.STOPPED
    assert titles(robot) == [STARTED, STOPPED]
    assert motions.left == 1
