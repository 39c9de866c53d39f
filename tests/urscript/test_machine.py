"""The machine: ticks, budget, threads, critical sections, and what its user gives it."""

import pytest

from tvist_urscript import (
    EVALUATIONS,
    Fault,
    Machine,
    ScriptError,
    Signature,
    compile_script,
    parameters,
    to_str,
)
from tvist_urscript.machine import OVERDRAFT, PATIENCE
from tvist_urscript.statements import PIECE
from tvist_urscript.threads import MOST_THREADS

from .dry_functions import sync

SIGNATURES = {
    "say": Signature(parameters("value")),
    "sync": Signature((), blocks=True),
    "move": Signature(parameters("target", speed=1.5), blocks=True),
    "fail": Signature(parameters("why")),
    "costly": Signature((), cost=100),
}


class Robot:
    """Functions for a machine, and what happened to them."""

    def __init__(self, script, **keywords):
        self.said = []
        self.closed = []
        functions = {
            "say": lambda value: self.said.append(to_str(value)),
            "sync": sync,
            "move": self.move,
            "fail": self.fail,
            "costly": lambda: 0,
        }
        self.machine = Machine(
            compile_script(f"def program(): {script}\nend", SIGNATURES), functions, **keywords
        )

    def move(self, target, speed):
        try:
            for _ in range(3):
                yield
        except GeneratorExit:
            self.closed.append(target)
            raise
        return target * speed

    def fail(self, why):
        raise Fault(why)

    def ticks(self, number, budget=EVALUATIONS):
        return [self.machine.resume(budget) for _ in range(number)]


def test_a_blocking_function_takes_ticks_and_returns_a_value():
    robot = Robot("x = move(2)\nsay(x)\nx = move(speed=2, target=5)\nsay(x)")
    robot.ticks(3)
    assert robot.said == []
    robot.ticks(1)
    assert robot.said == ["3"]
    robot.ticks(3)
    assert robot.said == ["3", "10"]
    assert not robot.machine.running


def test_a_fault_has_the_position_of_its_call():
    robot = Robot('say(1)\n  fail("no way")')
    with pytest.raises(ScriptError) as caught:
        robot.ticks(1)
    assert (caught.value.line, caught.value.column, caught.value.text) == (2, 3, "no way")
    assert str(caught.value) == "line 2, column 3: no way"
    assert not robot.machine.running


def test_ending_the_machine_ends_waiting_functions():
    robot = Robot("thread t():\n move(1)\nend\nrun t()\nmove(2)")
    robot.ticks(2)
    robot.machine.end()
    assert sorted(robot.closed) == [1, 2]
    assert not robot.machine.running
    assert robot.ticks(1) == [EVALUATIONS]


def test_a_statement_beyond_the_budget_is_charged_to_later_ticks():
    robot = Robot("l = make_list(1000, 0.5)\nl = l + l\nsync()")
    assert -1000 < robot.ticks(1, 100)[0] < -100
    waiting = Robot("while True:\n x = 1\nend")
    assert waiting.ticks(3) == [0, 0, 0]


def test_an_error_of_one_thread_ends_the_others():
    robot = Robot('thread t():\n sync()\n fail("x")\nend\nrun t()\nmove(2)')
    robot.ticks(1)
    with pytest.raises(ScriptError):
        robot.ticks(1)
    assert robot.closed == [2]


@pytest.mark.parametrize("kind", [KeyError, AttributeError, NameError, RuntimeError, MemoryError])
def test_an_exception_in_a_built_in_function_is_an_error_at_its_call(kind):
    def broken(value):
        raise kind("x" * 10_000)

    machine = Machine(compile_script("\n  say(1)", SIGNATURES), {"say": broken})
    with pytest.raises(ScriptError, match=f"line 2, column 3: internal error: {kind.__name__}: ") as caught:
        machine.resume()
    assert isinstance(caught.value.__cause__, kind)
    assert len(caught.value.text) < 300
    assert not machine.running


def test_finish_runs_before_a_thread_waits_for_another():
    order = []

    def finish():
        yield
        order.append(("finish", robot.machine.thread))

    for waiting in ("join h", "enter_critical"):
        order.clear()
        robot = Robot(
            "thread t():\n enter_critical\n costly()\n i = 0\n while i < 200:\n  i = i + 1\n end\n exit_critical\n"
            f" while True:\n  sync()\n end\nend\nh = run t()\nsync()\n{waiting}\nsay(1)\nsync()",
            finish=finish,
        )
        robot.ticks(1, budget=150)
        robot.ticks(4, budget=150)
        assert order[0] == ("finish", 0), waiting


def test_kill_reaches_threads_whose_parent_has_ended():
    robot = Robot(
        "thread c():\n move(7)\nend\nthread b():\n run c()\nend\nthread a():\n run b()\n move(1)\nend\n"
        "h = run a()\nsync()\nkill h\nsync()"
    )
    robot.ticks(2)
    assert sorted(robot.closed) == [1, 7]
    assert robot.machine.living == [0]


def test_finish_runs_before_a_thread_ends_but_not_if_it_is_killed():
    finished = []

    def finish():
        yield
        finished.append(robot.machine.thread)

    robot = Robot(
        "thread t():\nend\nthread k():\n sync()\n sync()\n sync()\nend\nrun t()\nh = run k()\n"
        "sync()\nsync()\nkill h",
        finish=finish,
    )
    robot.ticks(3)
    assert finished == [1]
    assert robot.machine.running
    robot.ticks(1)
    assert finished == [1, 0]
    assert not robot.machine.running


def test_the_line_of_the_main_thread_is_known():
    robot = Robot("def f():\n  sync()\n  sync()\nend\n\nf()\nsync()")
    lines = []
    for _ in range(3):
        robot.ticks(1)
        lines.append(robot.machine.line)
    assert lines == [2, 3, 7]


def test_resume_returns_the_rest_of_the_budget():
    few, more = Robot("x = 1 + 2").ticks(1)[0], Robot("x = 1 + 2 + 3 + 4").ticks(1)[0]
    assert more == few - 2
    assert 0 < few < EVALUATIONS
    assert Robot("costly()").ticks(1)[0] < EVALUATIONS - 100


def test_a_thread_without_a_turn_runs_first_in_the_next_tick():
    robot = Robot(
        "thread busy():\n while True:\n  say(1)\n  i = 0\n  while i < 60:\n   i = i + 1\n  end\n  sync()\n end\nend\n"
        "thread late():\n while True:\n  say(2)\n  sync()\n end\nend\nrun busy()\nrun late()\nsync()\n"
        "while True:\n sync()\nend"
    )
    robot.ticks(1, budget=100)
    assert robot.said == ["1"]
    robot.ticks(1, budget=100)
    assert robot.said[:2] == ["1", "2"]


@pytest.mark.parametrize("budget", [EVALUATIONS, 20_000])
def test_an_endless_loop_is_an_error_after_a_million_evaluations(budget):
    robot = Robot("say(1)\nwhile True:\n  x = 1\nend")
    robot.ticks(PATIENCE // budget - 1, budget=budget)
    with pytest.raises(ScriptError, match="1000000 evaluations without waiting") as caught:
        robot.ticks(3, budget=budget)
    assert caught.value.line == 2


def test_a_long_computation_continues_over_ticks_within_the_budget():
    robot = Robot("i = 0\nwhile i < 100000:\n  i = i + 1\nend\nsay(i)")
    left = robot.ticks(2 * PATIENCE // EVALUATIONS)
    assert robot.said == ["100000"]
    assert min(left) > -PIECE


def test_the_number_of_threads_is_limited():
    robot = Robot("thread t():\n run t()\n run t()\n sync()\nend\nrun t()\nwhile True:\n sync()\nend")
    with pytest.raises(ScriptError, match=f"at most {MOST_THREADS} threads"):
        robot.ticks(1000)


def test_operations_on_lists_cost_by_their_length():
    prepared = "a = make_list(1000, 1)\nb = 0\n"
    alone = Robot(prepared).ticks(1, budget=10_000)[0]
    for work in ("b = a + a", "b = a * 2", "b = norm(a)", "b = -a"):
        robot = Robot(prepared + work)
        robot.ticks(1, budget=10_000)
        assert robot.machine.left <= alone - 900, work


def test_list_operations_of_one_statement_are_limited():
    robot = Robot("a = make_list(1000, 1)\na = " + " + ".join(["a"] * 90))
    with pytest.raises(ScriptError, match="too many list elements"):
        robot.ticks(3)
    assert robot.machine.left >= -2 * OVERDRAFT


def test_arguments_are_evaluated_in_text_order():
    for call in ('f(b=g("first"), a=g("second"))', 'move(speed=g("first"), target=g("second"))'):
        robot = Robot(
            "def g(x):\n say(x)\n return str_len(x)\nend\n"
            f"def f(a, b=2, c=3):\n return a + 10 * b + 100 * c\nend\nx = {call}\nsay(x)"
        )
        robot.ticks(5)
        assert robot.said == ["first", "second", "356" if call[0] == "f" else "30"]


class Added:
    """A program that runs statements as they are added to it."""

    def __init__(self, text):
        self.signatures = SIGNATURES | {"interpret": Signature((), blocks=True)}
        self.said, self.waiting = [], []
        self.last = compile_script(text, self.signatures)
        self.machine = Machine(
            self.last,
            {"say": lambda value: self.said.append(to_str(value)), "sync": sync, "interpret": self.interpret},
        )

    def interpret(self):
        while True:
            while self.waiting:
                yield from self.machine.add(self.waiting.pop(0), "the statement")
            yield

    def add(self, text):
        """Compile statements after what was added before, and run a few ticks."""
        self.last = compile_script(text, self.signatures, self.last)
        self.waiting.append(self.last)
        for _ in range(3):
            self.machine.resume()
        return self.said


PROGRAM = "def main():\n a = [1, 2]\n def twice(x, y=2):\n  return x * y\n end\n interpret()\nend"


def test_added_statements_use_the_program_and_earlier_statements():
    added = Added(PROGRAM)
    assert added.add("say(a)") == ["[1, 2]"]
    assert added.add("a[0] = twice(4)\nb = [7, 8]") == ["[1, 2]"]
    assert added.add("def sum(x):\n c = [0]\n c[0] = x[0] + x[1]\n return c[0]\nend")
    assert added.add("if True:\n sync()\n say(sum(a))\nend\nsay(sum(b))")[1:] == ["10", "15"]
    assert added.add("thread t():\n say(7)\nend\njoin run t()")[3:] == ["7"]
    assert added.add("def sum(x):\n return 0\nend\nsay(sum(b))")[-1] == "0"


def test_forgotten_names_are_unknown_to_later_statements():
    added = Added(PROGRAM)
    first = added.last
    added.add("def sum(x):\n return x[0]\nend\na = [3]")
    added.add("def kept():\n return [5]\nend")
    added.machine.forget(added.last.scope.number)
    assert added.add("say(kept())") == ["[5]"]
    with pytest.raises(ScriptError, match="the function sum has been forgotten"):
        added.add("say(sum(a))")
    added = Added(PROGRAM)
    added.add("a = [3]")
    added.last = first
    with pytest.raises(ScriptError, match="name_not_found:sum"):
        added.add("say(sum(a))")
    assert added.add("say(a)\nsay(twice(2))") == ["[3]", "4"]


def test_forgetting_ends_only_threads_and_variables_of_added_statements():
    beside = " def count():\n  while True:\n   b = b + 1\n   sync()\n  end\n end\n"
    added = Added(f"def main():\n b = 0\n{beside} thread t():\n  count()\n end\n run t()\n interpret()\nend")
    added.add("thread u():\n say(1)\n run t()\n while True:\n  sync()\n end\nend\nc = 7\nrun u()\nrun t()")
    assert len(added.machine.living) == 5
    added.machine.forget(added.last.scopes)
    assert added.machine.living == [0, 1]
    with pytest.raises(ScriptError, match="the variable c has no value yet"):
        added.add("say(c)")


def test_many_short_statements_are_no_endless_loop():
    added = Added(PROGRAM)
    for number in range(200):
        text = f"i = 0\nwhile i < 200:\n i = i + 1\nend\nsay({number})"
        added.last = compile_script(text, added.signatures, added.last)
        added.waiting.append(added.last)
    while len(added.said) < 200:
        added.machine.resume()


@pytest.mark.parametrize(
    "text",
    [
        "a = 1 b = 2 say(b) say([a, b])",
        'def f(): c = "h" say(c) end f()',
        "if True: say(1) say(2) end",
        "thread t(): i = 3 while i > 0: i = i - 1 sync() end end run t() say(1)",
        "x = (1 + 2) y = -x say(y) pass z = True say(z)",
    ],
)
def test_a_line_may_contain_several_statements(text):
    assert Added(PROGRAM).add(text)


@pytest.mark.parametrize(
    "text", ["a = 1 2", 'say "h"', "if True b = 1 end", "say(1 b)", "a = [1 b]", "a = b = 1"]
)
def test_invalid_lines_of_several_statements_are_refused(text):
    with pytest.raises(ScriptError, match="syntax_error"):
        Added(PROGRAM).add(text)


@pytest.mark.parametrize(("text", "place", "goes_on"), [
    ("say(nothing)", (1, 5), True), ("x = (1", (1, 7), True), ("sec f():\nend", (1, 5), True), ("", (1, 1), True),
    ("b = 1\nsay(a[9])", (2, 7), False),
])  # fmt: skip
def test_errors_of_added_statements_have_their_own_positions(text, place, goes_on):
    added = Added(PROGRAM)
    with pytest.raises(ScriptError) as caught:
        added.add(text)
    assert (caught.value.line, caught.value.column, added.machine.running) == (*place, goes_on)
