"""The controller's program at UR's interfaces: paths, messages to clients, and control while it runs."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_protocol.programs import ProgramLabel, ProgramRun
from tvist_protocol.replies import Done, Refused
from tvist_protocol.stream import Event

from .conftest import FakeControl, io
from .decoders import message
from .hosts import hear, host, told


@pytest.fixture
def programs(robot):
    return host(robot).programs


def started(name, **fields):
    return Event(tick=5, kind="program_started", program=name, **fields)


def stopped(name, **fields):
    return Event(tick=6, kind="program_stopped", program=name, **fields)


def test_clients_get_key_messages_when_programs_start_and_stop(programs, robot):
    for name in ("paper.urp", "there.script", "rtde_control"):
        programs.event(started(name))
        programs.event(stopped(name))
    said = [(one.kind, one.values["title"], one.values["text"]) for one in told(robot)]
    names = ("paper", "there", "rtde_control")
    assert said == [(7, f"PROGRAM_XXX_{end}", name) for name in names for end in ("STARTED", "STOPPED")]
    stamp = round(1e6 * robot.latest.timestamp)
    assert {(one.time, one.source) for one in told(robot)} == {(stamp, 254)}


def test_a_label_is_sent_once_when_it_is_reached(programs, robot):
    for number, name in ((1, "Robot Program"), (1, "Robot Program"), (2, "Waypoint_1")):
        label = ProgramLabel(number=number, name=name)
        programs.io(io(program="f", program_state="PLAYING", program_label=label))
    programs.io(io(program="f"))
    assert [(one.kind, one.values) for one in told(robot)] == [
        (1, {"number": 1, "text": "Robot Program"}),
        (1, {"number": 2, "text": "Waypoint_1"}),
    ]


def test_a_warning_with_a_line_becomes_a_runtime_exception(programs, robot):
    why = "movej: no posture reaches the pose"
    programs.event(Event(tick=5, kind="warning", why=why, line=3, column=5, program="prog"))
    programs.event(Event(tick=5, kind="warning", why="something else"))
    (exception,) = told(robot)
    assert (exception.kind, exception.values) == (10, {"line": 3, "column": 5, "text": why})


def test_texts_and_popups_of_programs_are_sent_to_all_clients(programs, robot):
    programs.event(Event(tick=5, kind="text", why="half way", program="prog"))
    shown = {"title": "Robot", "why": "Put the part in", "level": "warning", "blocking": True}
    programs.event(Event(tick=5, kind="popup", **shown))
    programs.event(Event(tick=5, kind="popup", **(shown | {"level": "error", "blocking": False})))
    text, *popups = told(robot)
    assert (text.kind, text.values["text"]) == (0, "half way")
    assert [popup.values["flags"] for popup in popups] == [[True, False, True], [False, True, False]]
    words = {(popup.values["title"], popup.values["text"]) for popup in popups}
    assert words == {("Robot", "Put the part in")}


def run(programs, control, text="def f():\nend\n", *, secondary=False):
    heard = []
    hear(programs.run(text, control, secondary=secondary), heard)
    return heard


def test_control_lasts_while_the_script_runs(programs, control):
    assert run(programs, control) == [None]
    assert control.commands == [ProgramRun(token="the-token", text="def f():\nend\n")]
    programs.io(io(program="f", program_state="PLAYING", program_line=1))
    assert control.left == 0
    programs.io(io(program="f"))
    assert control.left == 1


def test_a_replacing_script_keeps_its_own_control(programs):
    first, second = FakeControl(), FakeControl()
    run(programs, first)
    programs.io(io(program="f", program_state="PLAYING", program_line=1))
    programs.event(started("f"))
    run(programs, second)
    programs.io(io(program="f", program_state="PLAYING", program_line=1))
    programs.event(stopped("f"))
    programs.event(started("f"))
    assert (first.left, second.left) == (1, 0)


def test_control_lasts_until_no_secondary_script_runs(programs):
    main, first, second = FakeControl(), FakeControl(), FakeControl()
    run(programs, main)
    programs.io(io(program="f", program_state="PLAYING", program_line=1))
    run(programs, first, secondary=True)
    programs.event(started("aside", secondary=True))
    run(programs, second, secondary=True)
    programs.event(stopped("aside", secondary=True))
    assert (first.left, second.left) == (1, 0)  # the second one begins with the next tick
    programs.event(started("aside", secondary=True))
    programs.io(io(program="f"))
    assert (main.left, second.left) == (1, 0)
    programs.event(stopped("aside", secondary=True))
    assert (main.left, first.left, second.left) == (1, 1, 1)


def test_a_refused_script_releases_control(programs, robot, control):
    control.refuse("busy")
    (refused,) = run(programs, control)
    assert refused.code == "busy"
    assert control.left == 1
    assert not robot.told


def test_control_lasts_while_the_program_plays(programs, control):
    for request in (programs.load("Q2.urp", control), programs.play(control), programs.pause(control)):
        hear(request, [])
    assert control.left == 0
    other = FakeControl()
    hear(programs.play(other), [])
    assert (control.left, other.left) == (1, 0)
    programs.io(io(program="Q2.urp"))
    assert (control.left, other.left) == (1, 1)


STEPS = st.lists(
    st.sampled_from(["load", "run", "play", "pause", "stop", "ended", "answer", "keep", "refuse", "allow"]),
    max_size=40,
)


@examples(40)
@given(STEPS)
def test_each_program_request_is_answered_once(steps):
    class Bare:
        latest = None
        tell = staticmethod(message)

    programs = host(Bare()).programs
    control, answers, asked = FakeControl(), [], 0
    for step in steps:
        if step == "load":
            hear(programs.load("paper.urp", control), [])
        elif step == "run":
            asked += 1
            hear(programs.run("def f():\nend\n", control, secondary=False), answers)
        elif step in {"play", "pause", "stop"}:
            asked += 1
            hear(getattr(programs, step)(control), answers)
        elif step == "ended":
            programs.io(io(program="paper.urp"))
        elif step == "keep":
            control.wait()
        elif step == "answer":
            control.answer()
        else:
            control.reply = Refused(code="no_control", where="", why="") if step == "refuse" else Done()
    control.answer()
    assert len(answers) == asked
    control.reply = Done()
    hear(programs.stop(control), answers)
    assert programs.state == "STOPPED"
