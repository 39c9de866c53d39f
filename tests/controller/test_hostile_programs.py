"""What a hostile program can make a tick compute is bounded, by counts, and what has stopped does nothing any more."""

import resource
from pathlib import Path
from random import Random

import numpy as np
import pytest

from tvist_controller.dispatch.planner import Planner
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.host import Host
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import LOST, pseudo_inverse
from tvist_controller.programs.journey import PAUSE
from tvist_controller.trajectory.speed import speed_step
from tvist_protocol import commands as c
from tvist_protocol import motions as m
from tvist_protocol.codec import encode
from tvist_protocol.programs import ProgramRun, ProgramStop
from tvist_protocol.replies import Accepted, Done
from tvist_urscript import EVALUATIONS
from tvist_urscript.expressions import MOST_OPERATIONS
from tvist_urscript.machine import OVERDRAFT, Machine

from .hostile import STARTS, begin, odd
from .robots import UR5E, Kept, Robot
from .scripts import URSIM, a_robot, playing, script, start

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


def test_a_tool_that_a_stretched_arm_cannot_move_is_told_at_once():
    """Outwards along the stretched arm there is no motion: a command that is held must be told of."""
    robot = Robot(q=tuple(STARTS[3]), shaper="none")
    left, values, _ = np.linalg.svd(Arm(UR5E).jacobian(np.array(STARTS[3])))
    assert values[-1] < LOST
    assert isinstance(robot.send(m.SpeedL, xd=tuple(0.1 * left[:, -1]), acceleration=1.0), Accepted)
    robot.tick(5)
    (told,) = [event.why for event in robot.events if event.kind == "motion_stopped"]
    assert "cannot move the tool in its direction" in told


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
            end, at = r.choice(ENDS), r.randrange(len(lines) + 1)
            lines.insert(at, end if r.random() < 0.3 else f"if i > {r.randrange(20)}:\n{end}\nend")
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


def test_nothing_is_compiled_when_a_tool_first_moves():
    """What a tick of `speedl` uses is compiled, or loaded, when the robot is made."""
    robot = a_robot()
    known = {one: list(one.signatures) for one in (speed_step, pseudo_inverse)}
    start(robot, "speedl([0, 0, 0.1, 0, 0, 0], a=1, t=0.1)")
    robot.tick(60)
    assert all(list(one.signatures) == before != [] for one, before in known.items())


@pytest.fixture
def little_memory():
    """Let what takes more than a gigabyte fail."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30), before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seeds", [range(100), pytest.param(range(100, 3100), marks=pytest.mark.nightly)])
def test_a_random_program_with_odd_numbers_ends_alone(seeds, little_memory, monkeypatch):
    """Nothing is raised out of a tick, or by a function that does not blame its arguments."""
    spent = spending(monkeypatch)
    for seed in seeds:
        robot = a_robot()
        robot.send(ProgramRun, text=odd(seed))
        for _ in range(600):
            spent[0] = 0
            robot.tick()
            assert spent[0] <= MOST
            if not playing(robot):
                break
        robot.send(ProgramStop)
        robot.until_rest(6000)


class Heard(Kept):
    """What a robot says."""

    def __init__(self):
        super().__init__()
        self.errors = []
        self.raised = self.errors.append


def fails(*_):
    raise ArithmeticError("on purpose")


def test_a_plan_that_fails_ends_its_program_which_names_the_line_and_is_logged(monkeypatch):
    robot, heard = a_robot(), Heard()
    monkeypatch.setattr(robot.controller.plans, "_order", lambda *_: fails)
    start(robot, "sync()", "movel(p[0.1, -0.4, 0.3, 2, 2, 0])")
    host = Host(robot.controller, heard, survives=True)
    while playing(robot):
        host.tick()
    (warning,) = [event for event in heard.events if event.kind == "warning"]
    assert (warning.line, warning.why) == (3, "an argument does not fit: on purpose")
    assert len(heard.errors) == 1


@pytest.mark.parametrize(("part", "name"), [("motion", "step"), ("programs", "advance"), ("motion", "stop")])
def test_what_fails_stops_the_robot_which_goes_on_when_it_is_unlocked(part, name, monkeypatch):
    robot, heard = a_robot(), Heard()
    host, owner = Host(robot.controller, heard, survives=True), getattr(robot.controller, part)
    start(robot, "sleep(1)")
    with monkeypatch.context() as failing:
        failing.setattr(owner, name, lambda *_: (failing.undo(), fails()))
        if name == "stop":
            assert host.request(encode(c.Stop())).code == "plant_failure"
        host.tick()
    assert [event.code for event in heard.events if event.kind == "protective_stop"] == ["plant_failure"]
    assert len(heard.errors) == 1
    assert host.request(encode(c.UnlockProtectiveStop(token=robot.token))) == Done()
    host.tick()
    assert host.controller.motion.activity.robot_mode.name == "RUNNING"
