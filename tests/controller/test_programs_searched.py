"""What random sequences of commands with programs (`make search`) have found, reduced."""

from itertools import pairwise

import numpy as np
import pytest

from tvist_controller.kinematics.arm import Arm
from tvist_controller.paths.poses import placement_vector
from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramPause, ProgramPlay, ProgramRun
from tvist_protocol.replies import Accepted, Done
from tvist_urscript import EVALUATIONS

from .robots import UR5E
from .scripts import URSIM, a_robot, failure, finish, playing, said, script, start

x, y, z, *turn = placement_vector(*Arm(UR5E).pose(np.array(URSIM)))
NEAR = [angle + 0.2 for angle in URSIM]
LINE = f"movel(p{[x, y + 0.1, z, *turn]}, a=1.0, v=0.2)"


@pytest.mark.parametrize("ticks", [1, 5, 9])
def test_a_client_may_move_the_arm_while_a_line_is_planned(ticks):
    """The program stops that motion first, as it does with one that goes on when a move is called."""
    robot = a_robot()
    start(robot, LINE, "textmsg(1)")
    robot.tick(ticks)
    moved = robot.send(c.MoveJ, q=tuple(NEAR))
    assert isinstance(moved, Accepted)
    finish(robot)
    assert said(robot) == ["1"]
    assert failure(robot) is None
    ended = [(event.kind, event.id) for event in robot.events if event.id is not None]
    assert ended == [("motion_started", 1), ("motion_stopped", 1), ("motion_started", 2), ("motion_done", 2)]
    _, there = Arm(UR5E).pose(np.array(robot.states[-1].reference_q))
    np.testing.assert_allclose(there, (x, y + 0.1, z), atol=1e-6)


def test_servoc_that_was_paused_and_goes_on_can_be_paused_again():
    robot = a_robot()
    start(robot, f"servoc(p{[x, y + 0.1, z, *turn]}, a=1.0, v=0.05)", "textmsg(1)")
    robot.tick(200)
    assert robot.send(ProgramPause) == Done()
    robot.until_rest()
    assert robot.send(ProgramPlay) == Done()
    robot.tick(50)
    assert playing(robot)
    assert not robot.controller.cycle.mode.at_rest
    assert robot.send(ProgramPause) == Done()
    robot.tick(100)
    assert robot.controller.cycle.mode.at_rest
    assert robot.send(ProgramPlay) == Done()
    finish(robot)
    assert said(robot) == ["1"]


@pytest.mark.parametrize("move", [f"movej({NEAR})", LINE, "speedj([0.1, 0, 0, 0, 0, 0], 1, 0.2)", "sync()"])
def test_protective_stop_pauses_the_program_at_any_next_statement_that_waits(move):
    """Also at a move in the same tick, which is carried out when the program is played again."""
    robot = a_robot()
    start(robot, "protective_stop()", move, "textmsg(1)")
    robot.tick(20)
    assert robot.controller.programs.state == "PAUSED"
    assert failure(robot) is None
    assert robot.send(c.UnlockProtectiveStop) == Done()
    assert robot.controller.programs.state == "PAUSED"
    assert robot.send(ProgramPlay) == Done()
    finish(robot)
    assert said(robot) == ["1"]
    assert ("motion_started" in robot.kinds()) == (move != "sync()")


GUIDED = (
    f"servoj({NEAR}, t=0.2)",
    f"servoc(p{[x, y + 0.1, z, *turn]}, a=1.0, v=0.1)",
    "speedj([0.1, 0, 0, 0, 0, 0], 1, 0.2)",
    "speedl([0, 0.1, 0, 0, 0, 0], 1, 0.2)",
)


@pytest.mark.parametrize("move", GUIDED)
def test_a_guided_motion_waits_until_the_program_before_has_come_to_rest(move):
    robot = a_robot()
    start(robot, "speedj([0.5, 0, 0, 0, 0, 0], 2, 9)")
    robot.tick(200)
    start(robot, move, "textmsg(1)")
    finish(robot)
    assert failure(robot) is None
    assert said(robot) == ["1"]


BUSY = "thread guide():", "  while True:", "    speedj([0.2, 0, 0, 0, 0, 0], 4, 0.002)", "{}", "  end", "end"


def guiding(work):
    """A robot whose program guides the arm by a thread that works for a while after each of its commands."""
    robot = a_robot()
    text = script(*BUSY, "handle = run guide()", "while True:", "  sync()", "end").format(work)
    robot.send(ProgramRun, text=text)
    return robot


def test_a_thread_that_misses_turns_is_named_once():
    robot = guiding("    i = 0\n    while i < 1100:\n      i = i + 1\n    end")
    robot.tick(200)
    (warning,) = [event.why for event in robot.events if event.kind == "warning"]
    assert warning.startswith("guide, line ")
    assert f"had no turn within the {EVALUATIONS} evaluations" in warning
    assert robot.states[-1].target_qd[0] == pytest.approx(0.2)


def test_the_arm_comes_to_rest_while_the_thread_that_guides_it_computes_and_goes_on_afterwards():
    robot = guiding("    i = 0\n    while i < 200000:\n      i = i + 1\n    end")
    speeds = []
    for _ in range(1000):
        robot.tick()
        speeds.append(robot.states[-1].target_qd[0])
    first = next(k for k, speed in enumerate(speeds) if speed > 0.0)
    assert max(speeds) < 0.1  # it slowed down before it reached 0.2
    assert sum(speed == 0.0 for speed in speeds[first:]) > 500
    assert sum(a == 0.0 < b for a, b in pairwise(speeds)) >= 2
    assert [event for event in robot.events if event.kind == "warning" and "slows down" in event.why]


STOPS = "thread t():\n protective_stop()\n end"
LAST = {
    "the last statement": ["protective_stop()"],
    "before halt": ["protective_stop()", "halt"],
    "in a branch": ["if True:", "  protective_stop()", "else:", "  sync()", "end"],
    "in a function": ["def f():", "  protective_stop()", "end", "f()"],
    "in a thread of a thread": [STOPS, "thread u():\n t = run t()\n join t\n end", "u = run u()", "join u"],
    "during a motion": ["speedj([0.1, 0, 0, 0, 0, 0], 1, 0.1)", "protective_stop()"],
}


@pytest.mark.parametrize("lines", LAST.values(), ids=LAST)
def test_a_program_ends_with_a_protective_stop_that_nothing_follows(lines):
    robot = a_robot()
    start(robot, *lines)
    finish(robot)
    assert robot.controller.programs.state == "STOPPED"
    assert {"protective_stop", "program_stopped"} <= set(robot.kinds())


@pytest.mark.parametrize("follows", ["x = 1", 'popup("a", blocking=True)', "sync()"])
def test_it_is_paused_where_something_follows(follows):
    for lines in (("protective_stop()", follows), (STOPS, "handle = run t()", "join handle", follows)):
        robot = a_robot()
        start(robot, *lines)
        finish(robot)
        assert (robot.controller.programs.state, said(robot)) == ("PAUSED", [])
