"""What random sequences of commands with programs (`make search`) have found, reduced."""

import numpy as np
import pytest

from tvist_controller.kinematics.arm import Arm
from tvist_controller.paths.poses import placement_vector
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.programs import ProgramPause, ProgramPlay
from tvist_protocol.replies import Accepted, Done

from .robots import UR5E
from .scripts import URSIM, a_robot, failure, finish, playing, said, start

x, y, z, *turn = placement_vector(*Arm(UR5E).pose(np.array(URSIM)))
NEAR = [angle + 0.2 for angle in URSIM]
LINE = f"movel(p{[x, y + 0.1, z, *turn]}, a=1.0, v=0.2)"
TURN = (0.3, 0.0, 0.0, 0.0, 0.0, 0.0)


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


def test_servoc_takes_over_a_guided_motion_of_a_client():
    robot = a_robot()
    start(robot, f"servoc(p{[x, y + 0.1, z, *turn]}, a=1.0, v=0.1)", "textmsg(1)")
    robot.tick(100)
    assert isinstance(robot.send(m.SpeedJ, qd=TURN, acceleration=1.0), Accepted)
    finish(robot)
    assert said(robot) == ["1"]
    robot.until_rest()


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


def test_a_protective_stop_of_one_thread_pauses_the_servoc_of_another():
    robot = a_robot()
    servoc = f"  servoc(p{[x, y + 0.1, z, *turn]}, a=1.0, v=0.1)"
    start(robot, "thread other():", servoc, "  textmsg(1)", "end", "handle = run other()", "sleep(0.2)",
          "protective_stop()", "join handle")  # fmt: skip
    robot.tick(300)
    assert robot.controller.programs.state == "PAUSED"
    assert failure(robot) is None
    assert robot.send(c.UnlockProtectiveStop) == Done()
    assert robot.send(ProgramPlay) == Done()
    finish(robot)
    assert said(robot) == ["1"]


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


@pytest.mark.parametrize("move", GUIDED)
def test_a_guided_motion_waits_for_the_stop_of_a_thread_that_has_ended(move):
    robot = a_robot()
    start(robot, "thread turn():", "  speedj([0.5, 0, 0, 0, 0, 0], 2, 0.2)", "end", "join run turn()", "sync()",
          move, "textmsg(1)")  # fmt: skip
    finish(robot)
    assert failure(robot) is None
    assert said(robot) == ["1"]
