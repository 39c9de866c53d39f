"""What a hostile program can make a tick compute is bounded, by counts, and what has stopped does nothing any more."""

from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.examples import examples

from tvist_controller.dispatch.planner import Planner
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import LOST, pseudo_inverse
from tvist_controller.programs.functions.state import PoseFunctions
from tvist_controller.programs.journey import DELAY, PAUSE
from tvist_controller.trajectory import speed as module
from tvist_controller.trajectory.speed import TRIES, speed_step
from tvist_protocol import motions as m
from tvist_protocol.commands import UnlockProtectiveStop
from tvist_protocol.programs import ProgramRun
from tvist_protocol.replies import Accepted, Done
from tvist_urscript import EVALUATIONS
from tvist_urscript.costs import cost_of
from tvist_urscript.expressions import MOST_OPERATIONS
from tvist_urscript.machine import OVERDRAFT, Machine

from .hostile import STARTS, begin
from .robots import UR5E, Robot
from .scripts import URSIM, a_robot, failure, said, script, start

MOST = max(EVALUATIONS, MOST_OPERATIONS) + OVERDRAFT
"""Evaluations that no tick exceeds: a budget, or one statement that is longer, and what it does beyond."""


class Counts:
    """Calls of a function in each tick."""

    def __init__(self, monkeypatch, owner, name):
        self.of_tick, whole = 0, getattr(owner, name)

        def counted(*arguments, **named):
            self.of_tick += 1
            return whole(*arguments, **named)

        monkeypatch.setattr(owner, name, counted)

    def take(self):
        found, self.of_tick = self.of_tick, 0
        return found


def spending(monkeypatch):
    """Count the evaluations of all machines."""
    spent, resume = [0], Machine.resume

    def counted(machine, budget=EVALUATIONS):
        resume(machine, budget)
        spent[0] += budget - machine.left
        return max(machine.left, 0)

    monkeypatch.setattr(Machine, "resume", counted)
    return spent


@pytest.mark.parametrize("seed", [*range(12), 12, 93, 156])
def test_no_tick_spends_more_than_the_budget_whatever_the_programs_do(seed, monkeypatch):
    """All programs of the robot together; a statement that a tick began late is borne by the next one."""
    robot, beside, _ = begin(seed)
    spent = spending(monkeypatch)
    solved = Counts(monkeypatch, type(robot.controller.programs.arm._access.motion.cycle.dynamics), "inertia")
    total = 0
    for tick in range(150):
        spent[0] = 0
        robot.controller.begin_tick()
        assert spent[0] <= MOST
        total += spent[0]
        assert total <= (tick + 1) * EVALUATIONS + MOST  # the next ticks have paid the rest
        assert solved.take() <= EVALUATIONS // 100
        robot.controller.complete_tick()
        beside.work()


def test_a_statement_that_waited_for_its_budget_is_borne_by_the_tick_that_carries_it_out(monkeypatch):
    """However many threads have one that waits, the next ticks do not carry out all of them at once."""
    threads = [
        f"thread t{k}():\n  while True:\n    x = get_mass_matrix()\n    sync()\n  end\nend" for k in range(50)
    ]
    robot = a_robot()
    calls = Counts(monkeypatch, type(robot.controller.cycle.dynamics), "inertia")
    start(robot, *"\n".join(threads).splitlines(), *(f"h{k} = run t{k}()" for k in range(50)), "sleep(1)")
    seen = []
    for _ in range(200):
        robot.tick()
        seen.append(calls.take())
    assert failure(robot) is None
    assert max(seen) <= EVALUATIONS // cost_of(PoseFunctions.get_mass_matrix) + 1
    assert sum(seen) >= 100  # and they get on


@pytest.mark.parametrize("seed", [6, 81, 240, 490])
def test_few_ticks_plan_or_stop_whatever_the_programs_do(seed, monkeypatch):
    """Threads that are killed while they move, and short moves in quick succession, are held back."""
    robot, beside, _ = begin(seed)
    plans, stops = Counts(monkeypatch, Planner, "plan"), Counts(monkeypatch, Stopper, "plan_stop")
    ticks, dear = 900, 0
    for _ in range(ticks):
        robot.controller.begin_tick()
        robot.controller.complete_tick()
        dear += plans.take() + stops.take()
        beside.work()
        plans.take()
    assert 2 <= dear <= 3 + ticks // PAUSE


def test_moves_that_are_planned_beside_the_ticks_take_their_fixed_time():
    """The first two short moves begin at once, the third as many ticks later as a line."""
    robot = a_robot()
    near = [[*URSIM[:5], URSIM[5] + turn] for turn in (0.01, 0.02, 0.03)]
    start(robot, *(f"movej({q}, a=8, v=3)" for q in near))
    robot.tick(300)
    begun = [event.tick for event in robot.events if event.kind == "motion_started"]
    done = [event.tick for event in robot.events if event.kind == "motion_done"]
    assert len(begun) == len(done) == 3
    assert begun[1] - done[0] == 1
    assert DELAY <= begun[2] - done[1] <= DELAY + 2


def test_a_program_that_fails_has_used_what_it_used(monkeypatch):
    """Programs beside it do not get all of the tick's evaluations once more."""
    robot, given, resume = a_robot(), [], Machine.resume
    monkeypatch.setattr(Machine, "resume", lambda self, budget: (given.append(budget), resume(self, budget)))
    for name in "ab":
        robot.send(ProgramRun, text=f"sec {name}():\n  x = make_list(300, 1)\n  x = x[300]\nend\n")
    robot.controller.begin_tick()
    assert given[0] == EVALUATIONS
    assert given[1] < EVALUATIONS - 100


@pytest.mark.parametrize("q", STARTS)
@pytest.mark.parametrize("program", [False, True])
def test_a_tick_of_speedl_factors_few_jacobians_in_any_posture(q, program, monkeypatch):
    """For a program and for a client of the network alike."""
    robot = a_robot(q=tuple(q))
    factored = Counts(monkeypatch, Arm, "inverse")
    tried = Counts(monkeypatch, module, "speed_step")
    random = Random(1)
    for _ in range(60):
        twist = [random.choice((-0.3, 0.0, 0.3)) for _ in range(6)]
        if program:
            robot.send(ProgramRun, text=script(f"speedl({twist}, a={random.choice((0.1, 10))}, t=0.1)"))
        else:
            robot.send(m.SpeedL, xd=tuple(twist), acceleration=random.choice((0.1, 10.0)))
        for _ in range(3):
            factored.take(), tried.take()
            robot.tick()
            assert factored.take() <= 2  # the tick's own, and one of the motion that takes over
            assert tried.take() <= 2 * (TRIES + 1)


@pytest.mark.parametrize("q", STARTS[:2] + STARTS[3:4])
def test_a_tool_that_a_stretched_arm_cannot_move_is_told_at_once(q):
    """Outwards along the stretched arm there is no motion: before, the command was held without a word."""
    robot = Robot(q=tuple(q), shaper="none")
    kinematics = Arm(UR5E)
    left, values, _ = np.linalg.svd(kinematics.jacobian(np.array(q)))
    assert values[-1] < LOST
    lost = 0.1 * left[:, -1]
    assert isinstance(robot.send(m.SpeedL, xd=tuple(lost), acceleration=1.0), Accepted)
    robot.tick(5)
    told = [event.why for event in robot.events if event.kind == "motion_stopped"]
    assert len(told) == 1
    assert "cannot move the tool in its direction" in told[0]


@examples(30)
@given(st.lists(st.floats(-1.0, 1.0), min_size=36, max_size=36), st.integers(0, 6))
def test_the_pseudo_inverse_is_numpy_s(numbers, rank):
    """Also of a Jacobian that has lost directions."""
    left, values, right = np.linalg.svd(np.array(numbers).reshape(6, 6))
    values[rank:] = 0.0
    if (abs(values - LOST) < 0.5 * LOST).any():
        return
    jacobian = np.ascontiguousarray((left * values) @ right)
    found = np.empty((6, 6))
    pseudo_inverse(jacobian, found)
    expected = np.linalg.pinv(jacobian, rcond=LOST / max(values[0], LOST))
    np.testing.assert_allclose(found, expected, atol=1e-8 / max(values[values > LOST].min(initial=1.0), LOST))


# ---------------------------------------------------------------- stops

ENDS = ("halt", "protective_stop()", "x = 1 / 0", "halt()", "stop()")
EFFECTS = ("set_standard_digital_out({n}, i % 2 == 0)", "write_output_integer_register({n}, i)",
           "write_output_float_register({n}, i)", "textmsg(i)", "set_analog_out(0, 0.5)", "x = x + 1")  # fmt: skip
MOVES = (
    "movej({q}, r=0.01)",
    "movej({q})",
    "speedj([0.1, 0, 0, 0, 0, 0], 1, 0.01)",
    "sync()",
    "sleep(0.01)",
    "servoj({q})",
)


def stopping(seed):
    """A random program with threads, and a secondary one; each writes, one of all moves, and one of them ends all.

    The main program writes to the places 0 to 3 and to the log, the secondary one to the places 4 to 7.
    """
    r = Random(seed)
    near = [round(angle + r.uniform(-0.2, 0.2), 3) for angle in URSIM]

    def body(moves, ends, effects=EFFECTS, first=0):
        lines = [r.choice(effects).format(n=first + r.randrange(4)) for _ in range(r.randrange(1, 6))]
        if moves:
            lines.insert(r.randrange(len(lines)), r.choice(MOVES).format(q=near))
        if ends:
            end = r.choice(ENDS)
            lines.insert(
                r.randrange(len(lines) + 1),
                end if r.random() < 0.3 else f"if i > {r.randrange(20)}:\n{end}\nend",
            )
        return ["while True:", "i = i + 1", *lines, r.choice(("sync()", "sleep(0.004)")), "end"]

    head = ["i = 0", "x = 0", "def stop():", "halt", "end"]
    threads, moving, ending = r.randrange(4), r.randrange(4), r.randrange(5)
    lines = list(head)
    for number in range(threads):
        lines += [f"thread t{number}():", *body(moving == number, ending == number), "end"]
    lines += [f"h{number} = run t{number}()" for number in range(threads)]
    lines += body(moving >= threads, threads <= ending < 4)
    beside = [*head, *body(False, ending == 4, EFFECTS[:3], 4)]
    return script(*lines), "\n".join(("sec beside():", *beside, "end", ""))


def written(robot, *, all_places):
    """What programs have written: to all places, or to those of the main program."""
    places = robot.controller.peripherals
    last = 8 if all_places else 4
    return (
        places.digital_outputs & ((1 << last) - 1), places.analog_shares[0],
        places.integers("output_int")[:last], places.doubles("output_double")[:last],
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(40))
def test_what_has_ended_or_stopped_does_nothing_any_more(seed):
    """Not even in the same tick: after a stop no output, register or message changes, and no motion begins.

    `halt` ends the secondary program as well; an exception, or a protective stop of the main program, does not.
    """
    robot = a_robot()
    player = robot.controller.programs
    for text in stopping(seed):
        robot.send(ProgramRun, text=text)
    at_stop, hear = [], player.hear

    def watching(event):
        """Look at what was written when the main program stops, still within the tick."""
        hear(event)
        if event.kind in {"program_stopped", "protective_stop"} and event.secondary is None and not at_stop:
            at_stop.append((len(robot.controller.events), robot.controller.tick_number))
            at_stop.append(written(robot, all_places=False))

    player.hear = watching
    for _ in range(200):
        known = len(robot.events)
        robot.tick()
        if at_stop:
            break
    else:
        return
    (number, _), before = at_stop
    assert not [event for event in robot.events[known + number :] if event.kind in {"text", "motion_started"}]
    assert written(robot, all_places=False) == before
    alone = not player._all
    known, before = len(robot.events), written(robot, all_places=alone)
    robot.tick(40)
    assert not [event for event in robot.events[known:] if event.kind in {"text", "motion_started"}]
    assert written(robot, all_places=alone) == before
    if player.state == "STOPPED":
        robot.until_rest()


def test_halt_in_a_secondary_program_ends_all_and_the_arm_stops():
    robot = a_robot()
    start(robot, f"movej({[angle + 0.5 for angle in URSIM]})", "set_standard_digital_out(1, True)")
    robot.tick(100)
    robot.send(ProgramRun, text="sec over():\n  halt\n  set_standard_digital_out(2, True)\nend\n")
    robot.until_rest()
    assert robot.controller.programs.state == "STOPPED"
    assert robot.controller.peripherals.digital_outputs == 0
    assert robot.states[-1].target_q != pytest.approx([angle + 0.5 for angle in URSIM], abs=0.1)
    assert "over has halted" in [event.why for event in robot.events if event.kind == "program_stopped"]


def test_a_secondary_program_waits_in_its_protective_stop():
    robot = a_robot()
    robot.send(ProgramRun, text='sec s():\n  protective_stop()\n  textmsg("on")\nend\n')
    robot.tick(50)
    assert said(robot) == []
    robot.tick(3000)
    assert robot.send(UnlockProtectiveStop) == Done()
    robot.tick(3)
    assert said(robot) == ["on"]


def test_plans_of_killed_threads_are_ordered_one_after_the_other():
    """Each takes longer than a tick beside the ticks: a queue of them would hold up the robot in the end."""
    robot, orders = a_robot(), []
    plans = robot.controller.plans
    order = plans._order
    plans._order = lambda command, basis: (orders.append(len(robot.states)), order(command, basis))[1]
    line = "movel(pose_trans(get_target_tcp_pose(), p[0, 0, 0.01, 0, 0, 0]))"
    start(
        robot, "thread f():", line, "end", "while True:", "h = run f()", "sync()", "sync()", "kill h", "end"
    )
    robot.tick(300)
    assert len(orders) > 3
    assert np.diff(orders).min() >= 10


def test_nothing_is_compiled_when_a_tool_first_moves():
    """What a tick of `speedl` uses is compiled, or loaded, when the robot is made."""
    robot = a_robot()
    known = {one: list(one.signatures) for one in (speed_step, pseudo_inverse)}
    start(robot, "speedl([0, 0, 0.1, 0, 0, 0], a=1, t=0.1)")
    robot.tick(60)
    assert all(list(one.signatures) == before != [] for one, before in known.items())
