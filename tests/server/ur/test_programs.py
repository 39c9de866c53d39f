"""The controller's program at UR's interfaces: paths, key messages, exceptions, and who holds control for it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramStop
from tvist_protocol.replies import Done, Refused
from tvist_protocol.stream import Event

from .conftest import FakeControl, io
from .decoders import message
from .hosts import host, told

STARTED, STOPPED, EXCEPTION = (7, "PROGRAM_XXX_STARTED"), (7, "PROGRAM_XXX_STOPPED"), (10, None)


class Answers:
    """Hears whether it was done."""

    def __init__(self):
        self.heard = []

    def __call__(self, done):
        self.heard.append(done)


@pytest.fixture
def answers():
    return Answers()


@pytest.fixture
def programs(robot):
    return host(robot).programs


def load(programs, path, control):
    heard = []
    programs.load(path, control, heard.append)
    return heard == [True]


def titles(robot):
    return [(one.kind, one.values.get("title")) for one in told(robot)]


def test_what_is_asked_for_reaches_the_controller_as_a_command(programs, control, answers):
    assert load(programs, "/ursim/programs/paper.urp", control)
    programs.play(control, answers)
    programs.pause(control, answers)
    programs.play(control, answers)
    programs.stop(control, answers)
    kinds = [type(command) for command in control.commands]
    assert kinds == [ProgramLoad, ProgramPlay, ProgramPause, ProgramPlay, ProgramStop]
    assert control.of(ProgramLoad)[0].name == "paper.urp"
    assert answers.heard == [True] * 4


def test_clients_are_told_once_that_it_has_started_and_that_it_has_stopped(programs, robot, control, answers):
    load(programs, "paper.urp", control)
    programs.io(io(program="paper.urp"))
    programs.play(control, answers)
    programs.io(io(program="paper.urp", program_state="PLAYING", program_line=1))
    programs.pause(control, answers)
    programs.io(io(program="paper.urp", program_state="PAUSED", program_line=1))
    assert programs.paused
    programs.play(control, answers)
    assert programs.playing
    programs.io(io(program="paper.urp"))
    assert titles(robot) == [STARTED, STOPPED]
    assert [one.values["text"] for one in told(robot)] == ["paper", "paper"]


def test_what_other_clients_load_and_play_is_told_too(programs, robot):
    programs.io(io(program="Q2.urp", program_state="PLAYING", program_line=1))
    assert (programs.path, programs.playing) == ("/programs/Q2.urp", True)
    programs.io(io(program="Q2.urp"))
    assert titles(robot) == [STARTED, STOPPED]


def test_one_that_ends_because_another_is_loaded_is_told_to_have_stopped_under_its_own_name(programs, robot):
    programs.io(io(program="Q2.urp", program_state="PLAYING", program_line=1))
    programs.io(io(program="Q3.urp"))
    programs.io(io(program="Q1.urp", program_state="PLAYING", program_line=1))
    assert titles(robot) == [STARTED, STOPPED, STARTED]
    assert [one.values["text"] for one in told(robot)] == ["Q2", "Q2", "Q1"]


def test_folders_do_not_matter(programs, control):
    assert load(programs, "/ursim/programs/wait_program.urp", control)
    assert (programs.path, programs.name) == ("/ursim/programs/wait_program.urp", "wait_program.urp")
    programs.io(io(program="wait_program.urp"))
    assert programs.path == "/ursim/programs/wait_program.urp"
    assert load(programs, "Q1.urp", control)
    assert programs.path == "/programs/Q1.urp"
    assert not programs.has("/programs/")
    assert not programs.has("")
    assert not programs.has("paper")
    assert programs.name == "Q1.urp"


def test_a_file_that_is_not_there_and_a_load_that_is_refused_are_told_apart(robot, control):
    from tvist_server.gateways.ur.dashboard.session import DashboardSession

    said = []
    dashboard = DashboardSession(host(robot), control, said.append)
    control.refuse("busy")
    dashboard.receive(b"load nothing.urp\nload Q1.urp\n")
    assert said == [b"File not found: nothing.urp\n", b"Error while loading program: Q1.urp\n"]


def test_a_line_that_cannot_be_carried_out_is_a_runtime_exception(programs, robot):
    programs.io(io(program="paper.urp", program_state="PLAYING", program_line=3))
    why = "move to Q3 was refused: because"
    programs.event(Event(tick=5, kind="warning", code="collision", why=why, line=3))
    programs.event(Event(tick=5, kind="warning", why="something else"))
    programs.io(io(program="paper.urp"))
    assert titles(robot) == [STARTED, EXCEPTION, STOPPED]
    exception = told(robot)[1].values
    assert (exception["line"], exception["column"], exception["text"]) == (3, 1, why)


def test_without_control_nothing_is_asked_for_but_a_stop(programs, control, answers):
    load(programs, "wait_program.urp", control)
    control.held_by_other = True
    programs.play(control, answers)
    programs.pause(control, answers)
    programs.stop(control, answers)
    assert answers.heard == [False, False, True]
    assert [type(command) for command in control.commands] == [ProgramLoad, ProgramStop]


def test_what_the_controller_refuses_has_failed(programs, robot, control, answers):
    load(programs, "wait_program.urp", control)
    control.refuse("wrong_mode")
    programs.play(control, answers)
    programs.pause(control, answers)
    programs.stop(control, answers)
    assert not load(programs, "Q1.urp", control)
    assert answers.heard == [False] * 3
    assert (programs.name, programs.state) == ("wait_program.urp", "STOPPED")
    assert not robot.told
    assert control.left == 1


def test_control_is_held_as_long_as_the_program_plays(programs, control, answers):
    load(programs, "Q2.urp", control)
    programs.play(control, answers)
    programs.pause(control, answers)
    assert control.left == 0
    other = FakeControl()
    programs.play(other, answers)
    assert (control.left, other.left) == (1, 0)
    programs.io(io(program="Q2.urp"))
    assert (control.left, other.left) == (1, 1)


STEPS = st.lists(
    st.sampled_from(["load", "play", "pause", "stop", "ended", "answer", "keep", "refuse", "allow"]),
    max_size=40,
)


@given(STEPS)
def test_whatever_happens_each_request_is_answered_once_and_starts_and_stops_alternate(steps):
    packages = []

    class Bare:
        latest = None
        tell = staticmethod(packages.append)

    programs = host(Bare()).programs
    control, answers, asked = FakeControl(), Answers(), 0
    for step in steps:
        if step == "load":
            programs.load("paper.urp", control, lambda _: None)
        elif step in {"play", "pause", "stop"}:
            asked += 1
            getattr(programs, step)(control, answers)
        elif step == "ended":
            programs.io(io(program="paper.urp"))
        elif step == "keep":
            control.wait()
        elif step == "answer":
            control.answer()
        else:
            control.reply = Refused(code="no_control", where="", why="") if step == "refuse" else Done()
    control.answer()
    assert len(answers.heard) == asked
    control.reply = Done()
    programs.stop(control, answers)
    said = [one.values["title"] for one in map(message, packages) if one.kind == 7]
    assert said[::2] == ["PROGRAM_XXX_STARTED"] * len(said[::2])
    assert said[1::2] == ["PROGRAM_XXX_STOPPED"] * len(said[1::2])
    assert len(said) % 2 == 0
