"""Run a compiled script, one tick at a time."""

import sys
from collections.abc import Callable, Generator, Iterable, Mapping
from contextlib import suppress
from types import FrameType
from typing import Any

from tvist_urscript.errors import Fault, ScriptError
from tvist_urscript.failures import FILE, all_lines_of, failure, line_of, name_of, position_of
from tvist_urscript.functions import fail, too_deep
from tvist_urscript.namespace import Namespace
from tvist_urscript.pieces import HERE, MISSING
from tvist_urscript.script import Script
from tvist_urscript.threads import MOST_THREADS, CriticalSection, Halted, Killed, Thread, halt
from tvist_urscript.values import Value

EVALUATIONS = 2000
"""Budget of a tick, in evaluations of all threads together."""
PATIENCE = 1_000_000
"""Evaluations after which a thread that never waits and receives nothing counts as an endless loop."""
OVERDRAFT = 2000  # most evaluations by which one statement may exceed the budget

_MISSING = object()
Steps = Generator[Any, None, Any]


class Machine:
    """A running program: its threads, variables and budget.

    Attributes:
        left: Budget left in this tick; compiled code takes from it.
        thread: Number of the thread that runs now, or ran last; 0 is the main thread.
        halted: Whether the program has ended by `halt`.
        label: Number and name of the last label that the main thread has passed; None before the first.

    Args:
        script: The program.
        functions: The built-in functions that the script calls, without those of `PURE`.
        finish: Blocking function that each thread calls before it waits for another (`join`,
            `enter_critical`) and at the end of its function.

    Raises:
        ValueError: The script calls a function that is not in `functions`.
    """

    def __init__(
        self,
        script: Script,
        functions: Mapping[str, Callable[..., Any]],
        *,
        finish: Callable[[], Steps] | None = None,
    ) -> None:
        self.script = script
        self.left = self.thread = self._started = 0
        self.halted = self._held = False
        self.label: tuple[int, str] | None = None
        self._finish: Callable[[], Iterable[Any]] = finish or (lambda: ())
        self._critical = CriticalSection()
        self._line = 1
        called = {
            HERE: self,
            MISSING: _MISSING,
            "run": self._run,
            "kill": self._kill,
            "join": self._join,
            "enter_critical": self._enter,
            "exit_critical": self._exit,
            "halt": halt,
            "label": self._label,
            "too_deep": too_deep,
            "fail": fail,
        }
        self._names = Namespace(script, functions, self.charge, called)
        self._main = self._running = Thread(0, self._body(self._names[script.main]), None)
        self._threads: list[Thread] = [self._main]
        self._missed: list[Thread] = []
        self._turns: list[Thread] = []

    @property
    def running(self) -> bool:
        """Whether the main thread is still running."""
        return not self._main.ended

    @property
    def living(self) -> list[int]:
        """Numbers of the threads that are still running, oldest first."""
        return [thread.number for thread in self._threads if not thread.ended]

    @property
    def at_end(self) -> bool:
        """Whether no statement follows the running built-in function in its thread or any that joins that."""
        thread, lines = self._running, set[int]()
        frame: FrameType | None = sys._getframe()  # noqa: SLF001
        while frame is not None:
            lines |= {frame.f_lineno} if frame.f_code.co_filename == FILE else set()
            frame = frame.f_back
        while lines <= self.script.last_lines and not thread.added:
            if thread is self._main:
                return True
            joining = [one for one in self._threads if one.joins is thread]
            if not joining:
                return False
            thread = joining[0]
            lines = all_lines_of(thread.steps)
        return False

    @property
    def line(self) -> int:
        """The present line of the main thread."""
        self._line = line_of(self._main.steps) or self._line
        return self._line

    def missed(self, number: int) -> bool:
        """Return whether a thread could not continue in the last tick because the budget was spent."""
        thread = self._find(number) if number else self._main
        return thread is not None and (thread.owes > 0 or thread in self._missed)

    def place(self, number: int) -> tuple[str, int]:
        """Return the name and the present line of a thread that has started."""
        thread = self._find(number) if number else self._main
        steps = None if thread is None else thread.steps
        return name_of(steps) or self.script.name, line_of(steps) or 1

    def resume(self, budget: int = EVALUATIONS) -> int:
        """Run all threads for one tick: first those that had no turn in the last tick, then others by age.

        Args:
            budget: Evaluations that all threads together may use.

        Returns:
            The rest of the budget; below 0 if a statement took more, which the next ticks have to pay.

        Raises:
            ScriptError: A thread has failed, in the script or in a built-in function. All threads have ended.
        """
        self.left, self._held = budget, False
        missed, self._missed = self._missed, []
        self._turns = missed + [thread for thread in self._threads if thread not in missed]
        for thread in self._turns:  # grows when a thread starts another one
            if thread.ended:
                continue
            short = self._held or self.left <= 0 or self.left < min(thread.owes, budget)
            if short or not self._critical.admits(thread):
                self._missed.append(thread)
            else:
                self._turn(thread)
        while self._held and (over := [one for one in self._threads if one.joins and one.joins.ended]):
            if not all_lines_of(over[0].steps) <= self.script.last_lines:
                break
            self._turn(over[0])  # the thread only has to end
        return self.left

    def hold(self) -> None:
        """Let no other thread run in this tick; the running one goes on until its next waiting statement."""
        self._held = True

    def end(self) -> None:
        """End all threads: the blocking functions in which they wait get GeneratorExit.

        Raises:
            ScriptError: A blocking function has failed while it ended. All threads have ended.
        """
        threads, self._threads = self._threads, []
        failed: Exception | None = None
        for thread in reversed(threads):
            try:
                self._close(thread)
            except Exception as error:  # noqa: BLE001  the other threads have to end, too
                failed = failed or error
        if failed is not None:
            raise failure(failed) from failed

    def progress(self) -> None:
        """Note that the running thread has received something from outside, so its loop is not endless."""
        self._running.spent = 0

    def charge(self, work: int) -> None:
        """Take a cost that depends on values, such as the number of list elements, from the budget.

        Raises:
            Fault: One statement does too much.
        """
        self.left -= work
        if self.left < -OVERDRAFT:
            raise Fault("a statement works on too many list elements, or searches too many poses, at once")

    def _turn(self, thread: Thread) -> None:
        try:
            self._step(thread)
        except Exception as error:
            with suppress(ScriptError):  # only the first error matters to the script's author
                self.end()
            if isinstance(error, ScriptError):
                raise
            raise failure(error) from error
        except BaseException:
            self.end()
            raise

    def _step(self, thread: Thread) -> None:
        assert thread.steps is not None
        self._running, self.thread = thread, thread.number
        before = self.left
        self.left -= thread.owes
        thread.owes = 0
        try:
            why = next(thread.steps)
        except (StopIteration, Killed):
            self._ended(thread)
        except Halted:
            self.halted = True
            self.end()
        else:
            self._waits(thread, why, before)

    def _waits(self, thread: Thread, cost: int | None, before: int) -> None:
        """Note that a thread waits for the next tick or, if `cost` is given, for a budget that covers it.

        `cost` is that of the thread's next statements; `before` was the budget left before its turn.
        """
        if cost is None:
            thread.spent = 0
            self._critical.release(thread)
            return
        thread.owes = cost
        thread.spent += before - (self.left + cost)
        self.left = min(self.left + cost, 0)  # these statements have not run yet
        if thread.spent >= PATIENCE:
            line, column = position_of(thread.steps) or (1, 1)
            raise ScriptError(
                line,
                column,
                f"an endless loop: the thread has computed {PATIENCE} evaluations without waiting for time to pass",
            )

    def _ended(self, thread: Thread) -> None:
        thread.leave(self._threads)
        self._critical.release(thread)
        if thread is self._main:
            self.end()
        elif thread in self._threads:
            self._threads.remove(thread)

    def _close(self, thread: Thread) -> None:
        steps = thread.steps
        thread.leave(self._threads)
        self._critical.release(thread)
        if steps is not None and (thread is not self._running or not getattr(steps, "gi_running", False)):
            steps.close()

    def _body(self, function: Callable[[int], Steps]) -> Steps:
        yield from function(1)
        yield from self._finish()

    # Statements that are added to the program.

    def add(self, script: Script, title: str) -> Steps:
        """Add statements to the program and run them in its main thread, which calls this.

        Args:
            script: Statements compiled after the program and everything added to it before.
            title: Name of the statements in errors.

        Raises:
            ScriptError: They have failed.
            ValueError: They call a function that the machine does not have.
        """
        self._names.include(script)
        self._main.added = True
        try:
            yield from self._names[script.main](1)
        except (Halted, Killed):
            raise
        except Exception as error:
            wrong = failure(error)
            text = f"{wrong.text} (in {title})"
            raise ScriptError(wrong.line, wrong.column, text, wrong.internal) from error
        finally:
            self._main.added = False
        self._main.spent = 0  # many short statements are no endless loop

    def forget(self, before: int) -> None:
        """Remove everything that was added: threads, functions, and variables that the program does not have.

        Args:
            before: Number of the first scope that is kept.
        """
        for thread in [one for one in self._threads if one.added and one is not self._main]:
            self._threads.remove(thread)
            self._close(thread)
        self._names.forget(before, self.script.scope.globals)

    # Compiled code calls these.

    def _run(self, function: Callable[[int], Steps]) -> int:
        if len(self._threads) >= MOST_THREADS:
            raise Fault(f"a program has at most {MOST_THREADS} threads")
        self._started += 1
        thread = Thread(self._started, self._body(function), self._running, added=self._running.added)
        self._threads.append(thread)
        self._turns.append(thread)
        return self._started

    def _find(self, handle: Value) -> Thread | None:
        if type(handle) is not int:
            raise Fault("only the value of `run` names a thread")
        return next((thread for thread in self._threads if thread.number == handle != 0), None)

    def _kill(self, handle: Value) -> None:
        victim = self._find(handle)
        if victim is None:
            return
        itself = False
        for thread in [one for one in self._threads if one.descends_from(victim)]:
            if thread is self._running:
                itself = True
            else:
                self._threads.remove(thread)
                self._close(thread)
        if itself:
            raise Killed

    def _join(self, handle: Value) -> Steps:
        thread = self._find(handle)
        if thread is None:
            return
        yield from self._finish()
        waiting = self._running
        waiting.joins = thread
        while not thread.ended:
            yield
        waiting.joins = None

    def _enter(self) -> Steps:
        thread = self._running
        if self._critical.taken_from(thread):
            yield from self._finish()  # before it queues, since it gets no turn while it queues
        if not self._critical.enter(thread):
            yield

    def _exit(self) -> None:
        self._critical.leave(self._running)

    def _label(self, number: int, name: str) -> None:
        if self._running is self._main:
            self.label = number, name
