"""Threads that guide the arm get a turn in every tick; where one does not, the arm does not go on without it."""

import numpy as np
import pytest

from tvist_controller.programs import driver_watch, player
from tvist_controller.programs.driver_watch import SILENT
from tvist_urscript import EVALUATIONS, GUIDED

from .scripts import a_robot, playing, said, start

TICKS = 600
HOME = "[-1.6, -1.727, -2.203, -0.808, 1.595, -0.031]"
SPLINE = """largest = 0
def largest_of(values):
  local found = norm(values[0])
  local k = 1
  while k < get_list_length(values):
    local one = norm(values[k])
    if one > found:
      found = one
    end
    k = k + 1
  end
  return found
end
def rates(c1, c2, c3, c4, c5, x):
  return c1 + 2 * x * c2 + 3 * pow(x, 2) * c3 + 4 * pow(x, 3) * c4 + 5 * pow(x, 4) * c5
end
asked = [0, 0, 0, 0, 0, 0]
thread guide():
  local zero = [0, 0, 0, 0, 0, 0]
  local part = [1.0, 0, 0, 0.2, 0, 0.1]
  local x = 0.0
  while x < 1.198:
    local left = 1.2 - x
    if left < 0.42:
      local ahead = rates(zero, zero, part * 2.8935, part * -3.6169, part * 1.2056, x + get_steptime())
      largest = largest_of(ahead)
    end
    x = x + get_steptime()
    local before = asked
    asked = rates(zero, zero, part * 2.8935, part * -3.6169, part * 1.2056, x)
    bend = 2 * zero + 6 * x * part + 12 * pow(x, 2) * part + 20 * pow(x, 3) * part
    asked = asked * 1.0
    most = largest_of((asked - before) / get_steptime())
    write_output_float_register(1, x)
    turns = turns + 1
    speedj(asked, most + 0.001, get_steptime())
  end
  stopj(4)
end
def look():
  enter_critical
  local words = [8, 20000, 100000, -200000, 300000, 400000, 500000, 600000, 3]
  local by = 1000000
  local q = [words[2] / by, words[3] / by, words[4] / by, words[5] / by, words[6] / by, words[7] / by]
  local wait = words[1] / 1000.0
  if words[8] == 2:
    textmsg(q)
  elif words[8] == 3 and wait > 30:
    textmsg(wait)
  end
  exit_critical
end"""
REGISTERS = f"""goal = {HOME}
mode = 7
thread guide():
  while True:
    turns = turns + 1
    servoj(goal, 0, 0, get_steptime(), 0.1, 300)
  end
end
def number(at):
  return read_input_integer_register(at + 0)
end
def real(at):
  return read_input_float_register(at + 0)
end
def look():
  local order = number(0)
  local k = 1
  while k < 14:
    if order == k:
      textmsg(k)
    end
    k = k + 1
  end
  local step = [real(0), real(1), real(2), real(3), real(4), real(5)]
  here = get_target_tcp_pose()
  goal = get_inverse_kin(pose_trans(here, p[step[0], step[1], step[2], 0, 0, 0]), {HOME})
  ok = is_within_safety_limits(here)
  write_output_integer_register(0, 2)
  write_output_float_register(0, real(0))
  if is_steady():
    write_output_integer_register(1, 1)
  end
end"""
GRIPPER = """thread guide():
  while True:
    turns = turns + 1
    speedl([0, 0, 0.01 - 0.00003 * turns, 0, 0, 0], 0.5, get_steptime())
  end
end
widths = [0, 85, 140, 50]
def is_answer(bytes):
  if bytes[0] != 3 or bytes[1] != 97 or bytes[2] != 99 or bytes[3] != 107:
    return False
  end
  return True
end
def rounded(x):
  if x % 1 < 0.5:
    return floor(x)
  end
  return ceil(x)
end
def scaled(x, low, high):
  local slope = (high - low) / (widths[1] - widths[0])
  local value = slope * (x - widths[0]) + low
  if value > high:
    value = high
  elif value < low:
    value = low
  end
  return rounded(value * 100) / 100
end
def look():
  local which = turns % 14
  local name = ""
  local k = 0
  while k < 14:
    if which == k:
      name = str_cat("V", k)
    end
    k = k + 1
  end
  enter_critical
  socket_set_var(name, scaled(turns % 85, 0, 255), "none")
  socket_send_string(str_cat("GET ", name), "none")
  if is_answer([3, 97, 99, 107]):
    place = scaled(rounded(turns / 3), 0, 100)
  end
  exit_critical
end"""


def beside(program):
    """A program whose thread guides the arm while the main thread does in each tick what such programs do."""
    lines = ["turns = 0", "looks = 0", f"movej({HOME})", *program.splitlines(), "handle = run guide()"]
    return [*lines, "while True:", "  look()", "  looks = looks + 1", "  write_output_integer_register(20, turns)",
            "  write_output_integer_register(21, looks)", "  sync()", "end"]  # fmt: skip


def warnings(robot):
    return [event.why for event in robot.events if event.kind == "warning"]


@pytest.mark.parametrize("program", [SPLINE, REGISTERS, GRIPPER], ids=["spline", "registers", "gripper"])
def test_loops_like_those_of_ur_s_clients_turn_once_a_tick_with_a_third_of_the_budget(program, monkeypatch):
    """The loops of UR's external_control, of ur_rtde's control program and of a gripper's preamble, beside a motion."""
    monkeypatch.setattr(player, "EVALUATIONS", GUIDED + (EVALUATIONS - GUIDED) // 3)
    robot = a_robot()
    start(robot, *beside(program))
    robot.tick(20)
    began = robot.controller.io().output_int_register
    robot.tick(TICKS - 30)
    turned = np.subtract(robot.controller.io().output_int_register, began)[20:22]
    assert playing(robot)
    assert turned.tolist() == [TICKS - 30] * 2
    assert warnings(robot) == []


def test_a_spline_of_velocities_ends_where_it_was_asked_to():
    robot = a_robot()
    start(robot, *beside(SPLINE))
    robot.tick(TICKS + 300)
    moved = np.subtract(robot.states[-1].reference_q, robot.states[0].reference_q)
    assert moved[:3] == pytest.approx([0.5, 0, 0], abs=1e-3)


BUSY = (
    "thread guide():",
    "  speedj([0.3, 0, 0, 0, 0, 0], 2, 0.5)",
    "  k = 0",
    "  while k < 30000:",
    "    k = k + 1",
    "  end",
    "  textmsg(k)",
    "  speedj([0.3, 0, 0, 0, 0, 0], 2, 0.5)",
    "end",
    "handle = run guide()",
    "join handle",
)


OTHER = ("thread other():", "  while True:", "    x = 1", "  end", "end", "run other()")


@pytest.mark.parametrize("beside", [(), OTHER], ids=["alone", "beside another that computes"])
def test_a_guided_motion_whose_thread_misses_its_ticks_is_told_once_and_the_arm_brakes(beside, monkeypatch):
    monkeypatch.setattr(player, "EVALUATIONS", GUIDED + 200)
    monkeypatch.setattr(driver_watch, "EVALUATIONS", GUIDED + 200)
    robot = a_robot()
    start(robot, *BUSY[:-1], *beside, "join handle")
    robot.tick(240)
    assert warnings(robot) == []
    robot.tick(SILENT + 100)
    speeds = np.array([state.target_qd[0] for state in robot.states])
    (why,) = warnings(robot)
    assert "thread guide in line " in why
    assert f"{GUIDED + 200} evaluations" in why
    assert speeds[240] == pytest.approx(0.3)
    assert abs(speeds[-1]) < 1e-6
    assert playing(robot)


def test_its_next_call_moves_the_arm_again(monkeypatch):
    monkeypatch.setattr(player, "EVALUATIONS", GUIDED + 1500)
    robot = a_robot()
    start(robot, *BUSY)
    robot.tick(1200)
    speeds = np.array([state.target_qd[0] for state in robot.states])
    rests = np.flatnonzero(np.abs(speeds[250:]) < 1e-6)
    assert said(robot) == ["30000"]
    assert speeds[250 + rests[0] :].max() == pytest.approx(0.3)


@pytest.mark.parametrize("waits", ["sleep(1)", "while read_input_integer_register(0) == 0:\n  sync()\nend"])
def test_a_motion_goes_on_while_its_thread_waits(waits):
    """UR's programs rely on it: `speedj` keeps its speed until the next command."""
    robot = a_robot()
    start(robot, "speedj([0.3, 0, 0, 0, 0, 0], 2, 0.2)", *waits.splitlines())
    robot.tick(400)
    assert robot.states[-1].target_qd[0] == pytest.approx(0.3)
    assert warnings(robot) == []
