"""Threads that guide the arm in every tick beside others, with the loops and calls of programs that clients send."""

from itertools import pairwise

import pytest
from tests.controller.scripts import a_robot, finish, said, script, start

from tvist_controller.programs import player
from tvist_protocol.programs import ProgramRun
from tvist_urscript import EVALUATIONS

SPLINE = (
    """
def steepest(speeds):
  local i = 1
  local most = norm(speeds[0])
  while i < get_list_length(speeds):
    if norm(speeds[i]) > most:
      most = norm(speeds[i])
    end
    i = i + 1
  end
  return most
end
turns = 0
ready = False
thread spline():
  local zero = [0, 0, 0, 0, 0, 0]
  local cubic = [10 * 0.4, 0, 0, 0, 0, 0]
  local quartic = [-15 * 0.4, 0, 0, 0, 0, 0]
  local quintic = [6 * 0.4, 0, 0, 0, 0, 0]
  local t = 0.0
  local last = zero
  while 1.0 - t > 0.5 * get_steptime():
    t = t + get_steptime()
    qd = zero + 2.0 * t * zero + 3.0 * pow(t, 2) * cubic + 4.0 * pow(t, 3) * quartic + 5.0 * pow(t, 4) * quintic
    qdd = 2.0 * zero + 6.0 * t * cubic + 12.0 * pow(t, 2) * quartic + 20.0 * pow(t, 3) * quintic
    u = t + get_steptime()
    next = zero + 2.0 * u * zero + 3.0 * pow(u, 2) * cubic + 4.0 * pow(u, 3) * quartic + 5.0 * pow(u, 4) * quintic
    if steepest(next - qd) > 15.0:
      stopj(15)
    end
    turns = turns + 1
    speedj(qd, steepest((qd - last) / get_steptime()) + 0.001, get_steptime())
    last = qd
  end
  stopj(5)
  ready = True
end
handle = run spline()
ticks = 0
while not ready:
  packet = socket_read_binary_integer(9, "reverse", 0.02)
  scaled = [packet[0] / 1000000, packet[0] / 1000000, packet[0] / 1000000, packet[0] / 1000000, packet[0] / 1000000]
  ticks = ticks + 1
  sync()
end
""",
    500,
)
REGISTERS = (
    """
turns = 0
target = get_target_joint_positions()
thread servo():
  while turns < 300:
    enter_critical
    q = target
    exit_critical
    turns = turns + 1
    servoj(q, 0, 0, get_steptime(), 0.1, 300)
  end
end
handle = run servo()
ticks = 0
while turns < 300:
  command = read_input_integer_register(20)
  if command == 0:
    enter_critical
    i = 0
    q = target
    while i < 6:
      q[i] = target[i] + read_input_float_register(24 + i)
      i = i + 1
    end
    target = q
    exit_critical
  end
  speed = read_input_float_register(30) + read_input_float_register(31) + read_input_float_register(32)
  pose = get_inverse_kin(get_actual_tcp_pose(), target)
  force = get_tcp_force()
  write_output_integer_register(20, ticks)
  write_output_float_register(24, norm(force))
  ticks = ticks + 1
  sync()
end
""",
    300,
)
GRIPPER = (
    """
turns = 0
state = [-1, -1, -1, -1, -1, -1, -1, -1, -1]
def ask(name, socket):
  answer = socket_get_var(name, socket)
  return answer
end
thread jog():
  while turns < 300:
    turns = turns + 1
    speedl([0, 0, 0.01, 0, 0, 0], 0.5, get_steptime())
  end
end
handle = run jog()
ticks = 0
while turns < 300:
  i = 0
  while i < 9:
    enter_critical
    if state[i] < 0:
      text = str_cat("gripper ", to_str(i))
      state[i] = str_len(text) * (i % 2) - 1
    end
    exit_critical
    i = i + 1
  end
  object = state[1] * 64 + state[2] * 8 + state[3] * 4 + state[4]
  socket_send_string("GET POS", "gripper_socket")
  textmsg("object ", object)
  ticks = ticks + 1
  sync()
end
""",
    300,
)


@pytest.mark.parametrize(
    ("text", "turns"), [SPLINE, REGISTERS, GRIPPER], ids=["spline", "registers", "gripper"]
)
def test_each_thread_has_its_turn_in_every_tick_with_a_third_of_the_evaluations(text, turns, monkeypatch):
    monkeypatch.setattr(player, "EVALUATIONS", EVALUATIONS // 3)
    robot = a_robot()
    start(robot, *text.strip().splitlines(), 'textmsg("turns ", turns)', 'textmsg("ticks ", ticks)')
    finish(robot)
    *_, done, ticks = said(robot)
    assert done == f"turns {turns}"
    assert int(ticks.split()[1]) <= turns + 5  # a stop included
    assert not [event for event in robot.events if event.kind == "warning" and "had no turn" in event.why]


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


LAST = {
    "the last statement": ["protective_stop()"],
    "before halt": ["protective_stop()", "halt"],
    "in a branch": ["if True:", "  protective_stop()", "else:", "  sync()", "end"],
    "in a function": ["def f():", "  protective_stop()", "end", "f()"],
    "in a thread that is joined": [
        "thread t():",
        "  protective_stop()",
        "end",
        "handle = run t()",
        "join handle",
    ],
    "in a thread of a thread": [
        "thread t():",
        "  protective_stop()",
        "end",
        "thread u():",
        "  inner = run t()",
        "  join inner",
        "end",
        "def wait():",
        "  outer = run u()",
        "  join outer",
        "end",
        "wait()",
    ],
    "during a motion": ["speedj([0.1, 0, 0, 0, 0, 0], 1, 0.1)", "protective_stop()"],
}


@pytest.mark.parametrize("lines", LAST.values(), ids=LAST)
def test_a_program_ends_with_a_protective_stop_that_nothing_follows(lines):
    robot = a_robot()
    start(robot, *lines)
    finish(robot)
    assert robot.controller.programs.state == "STOPPED"
    assert {"protective_stop", "program_stopped"} <= set(robot.kinds())


@pytest.mark.parametrize("then", ["sync()", "textmsg(2)"])
@pytest.mark.parametrize("where", ["thread", "main"])
def test_a_thread_s_protective_stop_pauses_the_program_where_something_follows(where, then):
    robot = a_robot()
    inside, after = ([f"  {then}"], []) if where == "thread" else ([], [then])
    start(
        robot, "thread t():", "  protective_stop()", *inside, "end", "handle = run t()", "join handle", *after
    )
    finish(robot)
    assert (robot.controller.programs.state, said(robot)) == ("PAUSED", [])


@pytest.mark.parametrize("follows", ["x = 1", 'popup("a", blocking=True)', "sync()"])
def test_it_is_paused_where_something_follows(follows):
    robot = a_robot()
    start(robot, "protective_stop()", follows)
    finish(robot)
    assert robot.controller.programs.state == "PAUSED"
