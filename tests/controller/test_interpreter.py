"""Statements that clients add to a program while it waits in `interpreter_mode`."""

import pytest

from tvist_protocol.programs import MAX_SCRIPT, Interpreter, ProgramInterpret, ProgramSkip, ProgramStop
from tvist_protocol.replies import Accepted, Done, Refused

from .scripts import URSIM, a_robot, failure, finish, playing, said, start

NEAR = [angle + 0.2 for angle in URSIM]


def waiting(*before, mode="interpreter_mode()", after=()):
    """A robot whose program waits for statements."""
    robot = a_robot()
    start(robot, *before, mode, *after)
    robot.tick(2)
    return robot


@pytest.fixture
def robot():
    return waiting()


def add(robot, text, ticks=3):
    reply = robot.send(ProgramInterpret, text=text)
    robot.tick(ticks)
    return reply


def state(robot):
    return robot.controller.io().interpreter


def said_at_rest(robot):
    """Return the texts written when the arm rests and the next statement has had its turn."""
    robot.until_rest()
    robot.tick(3)
    return said(robot)


def test_statements_are_numbered_and_executed_in_order():
    robot = waiting("a = 5")
    replies = [robot.send(ProgramInterpret, text=f"textmsg({text})") for text in ("a", "a + 1", '"c"')]
    assert replies == [Accepted(id=1), Accepted(id=2), Accepted(id=3)]
    assert state(robot) == Interpreter(interpreted=3, executed=0, cleared=0, waiting=3)
    robot.tick()
    assert said(robot) == ["5", "6", "c"]
    assert state(robot) == Interpreter(interpreted=3, executed=3, cleared=0, waiting=0)
    assert playing(robot)


def test_a_statement_waits_for_the_motion_before_it(robot):
    add(robot, f"movej({NEAR}, a=2, v=1)")
    add(robot, 'textmsg("there")')
    assert said(robot) == []
    assert state(robot).waiting == 1
    assert said_at_rest(robot) == ["there"]
    assert robot.states[-1].reference_q == pytest.approx(NEAR)


def test_the_program_continues_after_end_interpreter():
    robot = waiting(after=['textmsg("after")'])
    add(robot, "end_interpreter()")
    assert said(robot) == ["after"]
    assert not playing(robot)
    refused = robot.send(ProgramInterpret, text="sync()")
    assert (refused.code, "interpreter_mode" in refused.why) == ("wrong_mode", True)


@pytest.mark.parametrize(
    ("text", "code", "where"),
    [
        ("textmsg(nothing)", "script_error", "text:1:9"),
        ("movej(", "script_error", "text:1:7"),
        ("sec f():\nend", "script_error", "text:1:5"),
    ],
)
def test_an_invalid_statement_changes_nothing(robot, text, code, where):
    refused = add(robot, text)
    assert isinstance(refused, Refused)
    assert (refused.code, refused.where) == (code, where)
    assert add(robot, "textmsg(1)") == Accepted(id=1)
    assert said(robot) == ["1"]


def test_clear_interpreter_forgets_definitions_of_statements_only():
    robot = waiting("c = 0")
    add(robot, "def f():\n  return 7\nend")
    add(robot, "c = f() d = 1")
    add(robot, "clear_interpreter()")
    assert state(robot) == Interpreter(interpreted=3, executed=3, cleared=3, waiting=0)
    assert add(robot, "textmsg(f())").code == "script_error"
    assert add(robot, "textmsg(d)").code == "script_error"
    add(robot, "textmsg(c)")
    add(robot, "def f():\n  return 8\nend")
    add(robot, "textmsg(f())")
    assert said(robot) == ["7", "8"]


def test_skipping_waiting_statements_does_not_stop_the_present_move(robot):
    add(robot, f"movej({NEAR}, a=2, v=1)")
    add(robot, 'textmsg("there")')
    assert robot.send(ProgramSkip, what="statements") == Done()
    assert state(robot).waiting == 0
    assert said_at_rest(robot) == []
    assert robot.states[-1].reference_q == pytest.approx(NEAR)
    assert playing(robot)


@pytest.mark.parametrize("move", ["movej", "movel"])
def test_a_skipped_move_stops_and_the_next_statement_follows(robot, move):
    add(robot, f"{move}({NEAR}, a=1, v=0.3)", 200)
    add(robot, 'textmsg("on")')
    assert robot.send(ProgramSkip, what="move") == Done()
    assert said_at_rest(robot) == ["on"]
    assert robot.states[-1].reference_q != pytest.approx(NEAR)
    assert playing(robot)


@pytest.mark.parametrize(("mode", "kept"), [("clearQueueOnEnter=False", ["later"]), ("", [])])
def test_remaining_statements_are_kept_if_the_program_asks_for_it(mode, kept):
    robot = waiting(after=[f"interpreter_mode({mode})"])
    robot.send(ProgramInterpret, text="end_interpreter()")
    robot.send(ProgramInterpret, text='textmsg("later")')
    robot.tick(3)
    assert said(robot) == kept


def test_only_the_main_program_can_wait_for_statements():
    robot = waiting("def again():", "interpreter_mode()", "end")
    refused = add(robot, "interpreter_mode()")
    assert (refused.code, "in a statement" in refused.why) == ("script_error", True)
    add(robot, "again()")
    assert "in a statement" in failure(robot).why
    robot = a_robot()
    start(robot, "thread t():", "interpreter_mode()", "end", "join run t()")
    robot.tick(3)
    assert "in a thread" in failure(robot).why


def test_statements_sent_too_early_are_dropped_with_a_warning():
    robot = a_robot()
    start(robot, "sleep(0.1)", "interpreter_mode()")
    add(robot, 'textmsg("early")')
    add(robot, 'textmsg("early")')
    robot.tick(60)
    add(robot, 'textmsg("late")')
    assert said(robot) == ["late"]
    (warning,) = robot.warnings()
    assert "statements 1 to 2" in warning


def test_a_move_can_be_skipped_before_it_starts(robot):
    """A line is planned for some ticks after the call."""
    before = robot.states[-1].reference_q
    add(robot, f"movel({NEAR}, a=1, v=0.3)", 2)
    assert robot.send(ProgramSkip, what="move") == Done()
    add(robot, 'textmsg("on")')
    robot.tick(100)
    assert said(robot) == ["on"]
    assert robot.states[-1].reference_q == before
    add(robot, f"movel({NEAR}, a=1, v=0.3)", 20)
    robot.until_rest()
    assert robot.states[-1].reference_q == pytest.approx(NEAR)


def test_the_total_length_of_statements_is_limited(robot):
    text = "# " + "x" * (MAX_SCRIPT // 2 - 50) + "\na = 1"
    replies = [robot.send(ProgramInterpret, text=text) for _ in range(3)]
    assert [getattr(reply, "code", None) for reply in replies] == [None, None, "busy"]
    assert robot.send(ProgramInterpret, text=text + "\nclear_interpreter()") == Accepted(id=3)
    assert robot.send(ProgramInterpret, text=text) == Accepted(id=4)
    robot.tick(5)
    assert state(robot).cleared == 3


def test_statements_end_with_the_program(robot):
    add(robot, "sleep(10)")
    add(robot, "textmsg(1)")
    robot.send(ProgramStop)
    robot.tick(3)
    assert state(robot).waiting == 0
    assert robot.send(ProgramInterpret, text="sync()").code == "wrong_mode"
    start(robot, "interpreter_mode()")
    robot.tick(2)
    assert state(robot) == Interpreter()
    assert add(robot, "end_interpreter()") == Accepted(id=1)
    finish(robot)
