"""The controller carries out programs by itself, with the rights of the client that played them."""

import pytest

from tvist_protocol import commands as c
from tvist_protocol.programs import ProgramLoad, ProgramPause, ProgramPlay, ProgramStop
from tvist_protocol.replies import Done
from tvist_protocol.simulation import SimulationInject, SimulationReset

from .robots import Q1, Q2, Q3

ALL = [q.tolist() for q in (Q1, Q2, Q3, Q2, Q1)]
"""Where the program `paper.urp` goes."""
LONG = 300
"""Ticks in which a line would begin and a stop ends."""


def play(robot, name):
    assert robot.send(ProgramLoad, name=name) == Done()
    assert robot.send(ProgramPlay) == Done()


def state(robot):
    io = robot.controller.io()
    return io.program, io.program_state, io.program_line


def stopped(robot):
    return lambda: state(robot)[1] == "STOPPED"


def reached(robot):
    """Return the targets of completed motions."""
    ends = {event.tick for event in robot.events if event.kind == "motion_done"}
    return [pytest.approx(state.target_q, abs=1e-6) for state in robot.states if state.tick in ends]


def test_a_program_makes_its_moves_in_order_without_gaps(robot):
    play(robot, "paper.urp")
    assert state(robot) == ("paper.urp", "PLAYING", 1)
    robot.until(stopped(robot))
    assert reached(robot) == ALL
    assert state(robot) == ("paper.urp", "STOPPED", 0)
    done = [event.tick for event in robot.told("motion_done")]
    started = [event.tick for event in robot.told("motion_started")]
    assert started == [1, *(tick + 1 for tick in done[:-1])]


def test_playing_without_a_program_and_loading_an_unknown_one_are_refused(robot):
    assert robot.send(ProgramPlay).code == "wrong_mode"
    refused = robot.send(ProgramLoad, name="nothing.urp")
    assert (refused.code, refused.where) == ("out_of_range", "name")
    assert "paper.urp" in refused.why
    assert state(robot) == (None, "STOPPED", 0)


def test_playing_and_pausing_need_control_loading_and_stopping_do_not(robot):
    receive = robot.controller.receive
    assert receive(ProgramLoad(name="Q2.urp")) == Done()
    assert receive(ProgramPlay(token="x")).code == "stale_token"
    robot.send(ProgramPlay)
    for kind in (ProgramPause, ProgramStop):
        assert receive(kind(token="x")).code == "stale_token"
    robot.tick(100)
    assert receive(ProgramStop()) == Done()
    assert state(robot)[1] == "STOPPED"
    robot.until_rest()
    assert robot.motions()[-1] == "motion_stopped"


@pytest.mark.parametrize(("name", "ticks"), [("paper.urp", 700), ("wait_program.urp", 10)])
@pytest.mark.parametrize(
    ("kind", "fields"),
    [(c.PowerOff, {}), (c.ReleaseControl, {}), (ProgramStop, {}), (SimulationReset, {"q": tuple(Q1)})]
    + [(SimulationInject, {"fault": fault}) for fault in ("emergency_stop", "violation")],
)
def test_commands_that_end_all_motions_end_the_program(robot, kind, fields, name, ticks):
    play(robot, name)
    robot.tick(ticks)
    assert state(robot)[1] == "PLAYING"
    robot.send(kind, **fields)
    robot.tick(600)
    assert state(robot)[1] == "STOPPED"
    started = sum(event.kind == "motion_started" for event in robot.events)
    ended = sum(event.kind in {"motion_done", "motion_stopped"} for event in robot.events)
    assert started == ended


def test_no_line_starts_after_an_earlier_stop(robot):
    play(robot, "paper.urp")
    assert robot.controller.receive(c.Stop()) == Done()  # before the tick in which the first line would begin
    robot.tick(10)
    assert robot.motions() == []
    robot.send(ProgramPlay)
    robot.until(lambda: len(reached(robot)) == 1)
    robot.send(c.Stop)  # between two lines
    robot.tick(10)
    assert state(robot) == ("paper.urp", "STOPPED", 0)
    assert robot.motions() == ["motion_started", "motion_done"]


@pytest.mark.parametrize("fault", ["protective_stop", "nan"])
def test_a_program_resumes_the_interrupted_line_after_a_protective_stop(robot, fault):
    play(robot, "paper.urp")
    robot.until(lambda: len(reached(robot)) == 1)
    robot.tick(300)
    robot.send(SimulationInject, fault=fault)
    robot.tick(LONG)
    assert state(robot) == ("paper.urp", "PAUSED", 3)
    refused = robot.send(ProgramPlay)
    assert "unlock_protective_stop" in refused.why
    assert robot.send(c.UnlockProtectiveStop) == Done()
    robot.tick(LONG)
    assert state(robot) == ("paper.urp", "PAUSED", 3)
    assert robot.send(ProgramPlay) == Done()
    robot.until(stopped(robot))
    assert reached(robot) == ALL


def test_pause_holds_the_motion_and_play_resumes_it(robot):
    play(robot, "Q2.urp")
    robot.tick(300)
    assert robot.send(ProgramPause) == Done()
    robot.tick(1000)
    held = robot.states[-1]
    robot.tick(100)
    assert robot.states[-1].target_q == pytest.approx(held.target_q)
    assert state(robot) == ("Q2.urp", "PAUSED", 2)
    assert robot.send(ProgramPause).code == "wrong_mode"
    assert robot.send(ProgramPlay) == Done()
    assert robot.send(ProgramPlay).code == "busy"
    robot.until(stopped(robot))
    assert reached(robot) == [Q2.tolist()]


def test_a_safeguard_stop_between_two_lines_delays_the_next_one(robot):
    play(robot, "paper.urp")
    robot.until(lambda: len(reached(robot)) == 1)
    robot.send(SimulationInject, fault="safeguard_stop")
    robot.tick(100)
    assert state(robot)[1] == "PLAYING"
    assert robot.motions() == ["motion_started", "motion_done"]
    robot.send(SimulationInject, fault="normal")
    robot.until(stopped(robot))
    assert reached(robot) == ALL


LABELS = """
def p():
  thread t():
    $ 9 "Thread_1"
    sleep(1)
  end
  def inner():
    sleep(0.2)
  end
  run t()
  $ 1 "Robot Program"
  $ 2 "Wait: 0.2"
  inner()
  $ 3 "Wait: 0.2" "noBreak"
  sleep(0.2)
end
"""


def test_the_last_passed_label_is_published_with_the_line(robot):
    robot.send(ProgramLoad, name="p", text=LABELS)
    robot.send(ProgramPlay)
    seen = []
    for _ in range(300):
        robot.tick()
        label, line = robot.controller.io().program_label, robot.controller.io().program_line
        now = (line, label and (label.number, label.name))
        seen += [now] if [now] != seen[-1:] else []
    assert seen == [(1, None), (8, (2, "Wait: 0.2")), (15, (3, "Wait: 0.2")), (0, None)]
