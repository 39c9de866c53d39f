"""Hostile programs compute little per tick, and stopped ones have no further effects."""

import re
import resource
from pathlib import Path
from random import Random

import numpy as np
import pytest
from tests.search.scripts import Author

from tvist_controller.dispatch.planner import Planner
from tvist_controller.foresight.stopper import Stopper
from tvist_controller.host import Host
from tvist_controller.programs.blended_moves import PAUSE
from tvist_protocol import commands as c
from tvist_protocol.codec import encode
from tvist_protocol.programs import ProgramRun, ProgramStop
from tvist_protocol.replies import Done
from tvist_urscript import EVALUATIONS
from tvist_urscript.expressions import MOST_OPERATIONS
from tvist_urscript.machine import OVERDRAFT, Machine

from .robots import UR5E, Kept
from .scripts import URSIM, a_robot, playing, start

MOST = max(EVALUATIONS, MOST_OPERATIONS) + OVERDRAFT
"""Evaluations that no tick exceeds: a budget, or one statement that is longer, and what it does beyond."""


class Counts:
    """Counts the calls of a function in each tick."""

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


@pytest.mark.parametrize("seed", [*range(4), 12, 93, 156])
def test_no_tick_exceeds_the_evaluation_budget_with_hostile_programs(seed, monkeypatch):
    """All programs of a robot share the budget; the next tick pays for a statement that began late."""
    robot, beside = begin(seed)
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
def test_hostile_programs_cause_few_plans_and_stops(seed, monkeypatch):
    """Threads killed while they move, and short moves in quick succession, are delayed."""
    robot, beside = begin(seed)
    plans, stops = Counts(monkeypatch, Planner, "plan"), Counts(monkeypatch, Stopper, "plan_stop")
    ticks, dear = 450, 0
    for _ in range(ticks):
        robot.controller.begin_tick()
        robot.controller.complete_tick()
        dear += plans.take() + stops.take()
        beside.work()
        plans.take()
    assert 2 <= dear <= 3 + ticks // PAUSE


ENDS = ("halt", "protective_stop()", "x = 1 / 0")


def stopping(seed):
    """Return a random program with threads, one of which ends or stops it at a random moment."""
    random = np.random.default_rng(seed)
    head, body = Author(UR5E, np.array(URSIM), random).program("prog").split("\n", 1)
    end = ("thread t():", f"sleep({random.uniform(0.0, 0.3):.3f})", random.choice(ENDS), "end", "run t()")
    step = (
        "n = (n + 0.001) - floor(n)",
        "write_output_float_register(1, n)",
        "set_standard_analog_out(0, n)",
    )
    writes = ("thread w():", "n = 0.0", "while True:", *step, "sync()", "end", "end", "run w()")
    return "\n".join((head, *writes, *end, body))


def written(robot):
    places = robot.controller.peripherals
    numbers = [places.read("output_int", place) for place in range(4)]
    return places.digital_outputs, numbers, places.read("output_double", 1), list(places.analog_shares)


@pytest.mark.parametrize("seed", range(20))
def test_ended_or_stopped_programs_have_no_further_effects(seed):
    """After a stop no output, register or message changes, and no motion starts in its tick."""
    robot = a_robot()
    player = robot.controller.programs
    robot.send(ProgramRun, text=stopping(seed))
    at_stop, hear, known = [], player.hear, 0

    def watching(event):
        """Record what was written when the program stops, still within the tick."""
        hear(event)
        if event.kind in {"program_stopped", "protective_stop"} and not at_stop:
            at_stop.append((len(robot.controller.events), written(robot)))

    player.hear = watching
    while not at_stop:
        known = len(robot.events)
        robot.tick()
        if len(robot.states) == 600:  # a thread that only computes may keep the others from ending it
            return
    ((number, before),) = at_stop
    robot.tick(40)
    assert not {event.kind for event in robot.events[known + number :]} & {"text", "motion_started"}
    assert written(robot) == before
    if player.state == "STOPPED":
        robot.until_rest()


@pytest.fixture
def little_memory():
    """Let allocations above a gigabyte fail."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (used + (1 << 30), before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_AS, before)


@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 800), marks=pytest.mark.nightly)])
def test_random_programs_with_odd_numbers_raise_no_exception(seeds, little_memory, monkeypatch):
    """No tick raises, and no function fails without blaming its arguments."""
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


def fails(*_):
    raise ArithmeticError("on purpose")


def test_a_failing_plan_ends_its_program_with_its_line_and_is_logged(monkeypatch):
    robot, heard = a_robot(), Kept()
    monkeypatch.setattr(robot.controller.plans, "_order", lambda *_: fails)
    start(robot, "sync()", "movel(p[0.1, -0.4, 0.3, 2, 2, 0])")
    host = Host(robot.controller, heard, survives=True)
    while playing(robot):
        host.tick()
    (warning,) = [event for event in heard.events if event.kind == "warning"]
    assert (warning.line, warning.why) == (3, "an argument does not fit: on purpose")
    assert len(heard.errors) == 1


@pytest.mark.parametrize(("part", "name"), [("motion", "step"), ("programs", "advance"), ("motion", "stop")])
def test_an_internal_failure_causes_a_protective_stop_that_can_be_unlocked(part, name, monkeypatch):
    robot, heard = a_robot(), Kept()
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


STARTS = (
    *(UR5E.poses[name] for name in ("Q1", "Q2", "Q3")),
    (0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0),
    URSIM,
)
"""Stretched and singular postures, UR's own start among them, and one with room around it."""
POSTURES = [list(map(float, q)) for q in STARTS]
POSES = ("p[0.3, 0.2, 0.4, 0, 3, 0]", "p[0, -0.23, 1.08, 0, 2.2, -2.2]", "p[0.8, -0.1, 0.2, 1, 1, 1]",
         "p[2, 0, 0, 0, 0, 0]", "get_target_tcp_pose()", "p[1e-9, 1e-9, 0.6, 3.14159, 0, 0]")  # fmt: skip
ONCE = (
    "x = get_inverse_kin_has_solution({pose}, {q})", "x = get_inverse_kin({safe})", "x = get_forward_kin({q})",
    "x = get_forward_kin({q}, {pose})", "x = get_jacobian({q})", "x = get_mass_matrix({q})", "x = get_mass_matrix()",
    "x = is_within_safety_limits({q})", "x = is_within_safety_limits({pose})", "x = force()", "x = get_tcp_force()",
    "x = get_joint_torques()", "zero_ftsensor()", "x = get_target_tcp_pose()", "x = get_target_tcp_speed()",
    "x = get_actual_tcp_pose()", "x = get_target_waypoint()", "x = get_actual_joint_positions_history(i % 2)",
    "x = get_actual_tool_flange_pose()", "x = get_tool_accelerometer_reading()", "x = is_steady()",
    "textmsg({q})", "textmsg(l)", "x = to_str(l)", 'x = str_cat("a", {q})', "x = s == str_cat(s, i)", "popup(s)",
    "set_standard_digital_out(i % 8, True)", "write_output_float_register(i % 40, 0.5)",
    "write_output_integer_register(1, i)", "set_flag(i % 30, True)", "set_analog_out(1, 0.5)",
    "x = pose_trans({pose}, {pose})", "x = interpolate_pose({pose}, {pose}, 0.3)", "x = pose_inv({pose})",
    "x = wrench_trans({pose}, [1, 2, 3, 4, 5, 6])", "x = rpy2rotvec([i, 2, 3])", "x = rotvec2rpy([i, 2, 3])",
    "x = inv(m)", "x = inv(big)", "x = big * big", "x = big * row", "x = transpose(big)", "x = l + l",
    "x = deep + deep",
    "x = deep * 2.5", "x = l * l", "l[i % 1000] = i", "big[3, 4] = i", "x = norm(l)", "x = normalize(l)",
    "x = size(big)",
    "x = make_list(1000, l)" , "x = make_list(1000, i)", "x = integer_to_binary_list(i)", "x = -deep",
    "x = deep == deep",
    "x = binary_list_to_integer(bits)", "x = recurse(150)", "x = sqrt(i) + sin(i) * cos(i)", "h = run tiny()",
    "x = to_num(s) + str_len(s)", "x = str_sub(s, 0, 5)", "x = [l, l, l]", "x = get_inverse_kin({safe}, {q})",
    'x = socket_open("127.0.0.1", 9, "a")', 'socket_send_string(s, "a")', 'x = socket_get_var("a", "a")',
    'rtde_set_watchdog("input_int_register_0", 0.001)', "x = [get_mass_matrix(), get_jacobian(), get_jacobian({q})]",
)  # fmt: skip
"""Statements without time, of which most are dear."""
HOSTILE_MOVES = (
    "movej({q}, a={a}, v={v})", "movej(get_target_joint_positions())", "movej({safe}, a={a}, v={v})", "movel({safe})",
    "movel(get_target_tcp_pose())", "movep({safe}, r=0.01)", "movec({safe}, get_target_tcp_pose())",
    "movej(near(0.0001), a={a}, v={v})", "movej(near(0.3), r=0.05)", "movel(get_target_tcp_pose(), r=0.02)",
    "servoj({q}, t=0.002, gain={gain}, lookahead_time={lag})", "servoj(near(0.01), t=0.002)", "servoc({safe}, r=0.05)",
    "speedj([{s}, {s}, {s}, {s}, {s}, {s}], {a}, 0.002)", "speedl([{s}, {s}, {s}, {s}, {s}, {s}], {a}, 0.002)",
    "speedl([0, 0, {s}, 0, 0, 0], {a}, 0.002)", "speedl([{s}, 0, 0, 0, 0, 0], {a}, 0.1)", "stopj({a})", "stopl({a})",
    "set_tcp(p[0, 0, {lag}, 0, 0, 0])", "set_payload({s}, [0, 0, 0.05])", "sleep({lag})", "sync()", "sync()",
)  # fmt: skip
HEAD = """
  i = 0
  x = 0
  s = "123"
  m = [[1, 2, 3], [4, 5, 6], [7, 8, 10]]
  l = make_list(1000, 0.5)
  row = make_list(14, 1.5)
  bits = make_list(32, True)
  deep = make_list(2, l)
  deep[1] = make_list(990, 2.5)
  big = make_list(14, row)
  while i < 14:
    big[i, i] = 20 + i
    i = i + 1
  end
  def recurse(n):
    if n > 0:
      return recurse(n - 1)
    end
    return 0
  end
  def near(d):
    q = get_target_joint_positions()
    q[i % 6] = q[i % 6] + d * (1 - 2 * (i % 2))
    return q
  end
  thread tiny():
    sync()
  end
"""


def text(seed: int) -> tuple[list[str], tuple[float, ...]]:
    """Return a hostile program, with its secondary ones, and the posture it begins at."""
    r = Random(seed)

    def filled(statement: str) -> str:
        return statement.format(
            q=r.choice(POSTURES), pose=r.choice(POSES), safe=r.choice((POSES[0], POSES[0], POSES[4])),
            a=r.choice((0.1, 1.4, 8, 40)), v=r.choice((0.01, 1.05, 3)), s=r.choice((-1, -0.1, 0.01, 0.1, 1)),
            gain=r.choice((100, 300, 2000)), lag=r.choice((0.03, 0.1, 0.2)),
        )  # fmt: skip

    def loop(name: str, statements: list[str], rest: int) -> list[str]:
        body = ["i = i + 1", *statements, f"if i % {rest} == 0:", "  sync()", "end"]
        return [f"thread {name}():", "while True:", *body, "end", "end"]

    dear = r.sample(ONCE, r.choice((1, 1, 2, 4)))
    threads = r.choice((1, 1, 3, 20))
    lines = HEAD.splitlines()
    for number in range(threads):
        lines += loop(f"t{number}", [filled(one) for one in dear], r.choice((1, 3, 10**6)))
    moves = [filled(one) for one in r.sample(HOSTILE_MOVES, r.choice((1, 1, 2, 3)))]
    if r.random() < 0.7:
        lines += loop("mover", moves, 10**6)
    lines += ["while True:", *(f"h{k} = run t{k}()" for k in range(threads))]
    lines += ["hm = run mover()"] if "thread mover():" in lines else []
    lines += [f"sleep({0.002 * r.choice((1, 5, 40))})", *(f"kill h{k}" for k in range(threads))]
    lines += [f"kill hm\n{r.choice(('', 'stopj(4)', 'stopl(2)'))}"] if "thread mover():" in lines else []
    main = "\n".join(("def hostile():", *lines, "end", "end", ""))
    beside = [
        "\n".join((f"sec beside{k}():", *HEAD.splitlines(), "while True:", "i = i + 1",
                   *(filled(one) for one in dear), "if i % 3 == 0:", "sync()", "end", "end", "end", ""))
        for k in range(r.choice((0, 0, 1, 8)))
    ]  # fmt: skip
    return [main, *beside], r.choice(STARTS)


class Beside:
    """Plans orders of programs between the ticks, as a served robot does in parallel."""

    def __init__(self, robot) -> None:
        self.controller = robot.controller
        self._planner, self._waiting = Planner(robot.controller.setup), []
        robot.controller.plans._order = self._order

    def _order(self, command, basis):
        found = []
        self._waiting.append((command, basis, found))
        return lambda: found[0] if found else self._planner.plan(command, basis)

    def work(self) -> None:
        for command, basis, found in self._waiting:
            found.append(self._planner.plan(command, basis))
        self._waiting.clear()


def begin(seed: int):
    """Return a robot that runs the hostile programs of a seed, and its planner."""
    texts, q = text(seed)
    robot = a_robot(q=q)
    beside = Beside(robot)
    for one in texts:
        reply = robot.send(ProgramRun, text=one)
        assert not hasattr(reply, "why"), f"{reply}\n{one}"
    return robot, beside


ODD = (
    *("0", "-1", "1e-300", "1e-9", "0.999999", "7", "100"),
    *("-1000", "1e5", "1e8", "-1e8", "1e160", "-1e160", "1e308"),
)
SETTINGS = (
    *("set_tcp(p[0, 0.01, 0.1, 0, 0, 0.5])", "set_payload(1.5, [0, 0.02, 0.05])", "set_payload_mass(2)", "force()"),
    *("set_target_payload(1, [0, 0, 0.05], [0.01, 0.01, 0.01, 0, 0, 0], 0.01)", "set_payload_cog([0, 0, 0.1])"),
    *("get_inverse_kin({safe}, {q}, 0, 0, p[0, 0, 0.1, 0, 0, 0])", "get_jacobian({q})", "tool_contact()"),
    *("force_mode({safe}, [0, 0, 1, 0, 0, 0], [0, 0, -5, 0, 0, 0], 2, [0.1, 0.1, 0.1, 0.3, 0.3, 0.3])", "servoj({q})"),
    *("ft_rtde_input_enable(True, 0.5, [0, 0, 0.1], [0, 0, 0.05])", "movel(p[-0.2, -0.3, 0.3, 2, 2, 0], r=0.01)"),
    *("movec({safe}, p[-0.1, -0.4, 0.3, 2, 2, 0], 1, 0.2)", "optimovej({q}, 0.5, 0.5)", "speedl([0, 0.1, 0, 0, 0, 0])"),
)  # fmt: skip


def odd(seed: int) -> str:
    """Return a program that sets the robot up and moves it, with odd numbers among plausible ones."""
    r = Random(seed)
    share = r.choice((0.02, 0.1, 0.3))
    lines = [r.choice((r.choice(SETTINGS), r.choice(HOSTILE_MOVES))) for _ in range(r.randrange(1, 7))]
    near = [round(angle + r.uniform(-0.3, 0.3), 3) for angle in URSIM]
    text = "\n".join(lines).format(q=near, safe=POSES[0], a=1.4, v=1.05, s=0.1, gain=300, lag=0.1)
    odd_one = re.sub(
        r"(?<![\w.])-?\d[\d.]*", lambda found: r.choice(ODD) if r.random() < share else found[0], text
    )
    return f"def odd():\n{HEAD}\n{odd_one}\nend\n"
