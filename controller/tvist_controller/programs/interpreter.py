"""Statements that clients add to a program while it waits for them (interpreter mode)."""

from collections import deque
from collections.abc import Callable
from typing import Literal

from tvist_controller.events import Emit
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.blended_moves import Turns
from tvist_controller.refusal import RefusalError
from tvist_protocol.programs import MAX_SCRIPT, Interpreter
from tvist_urscript import Fault, Machine, Script

MAX_STATEMENTS = 1000
"""Largest number of statements, with `MAX_SCRIPT` characters in total, before they must be cleared."""
HELD = 2  # Storage for statements not yet cleared, in multiples of the limits above
WAITS, CLEAR = "interpreter_mode", "clear_interpreter"
"""Functions that wait for statements, and that clear them."""


class StatementQueue:
    """The statements that clients have added to one robot's program.

    If a program calls `interpreter_mode` anywhere, it accepts statements from its start on; these run while
    the program waits in that function.
    """

    def __init__(
        self, machine: Callable[[], Machine], arm: ProgramArm, peripherals: Peripherals, emit: Emit
    ) -> None:
        self._machine, self._arm, self._peripherals, self._emit = machine, arm, peripherals, emit
        self._program: Machine | None = None  # the main program if it accepts statements
        self._queue: deque[tuple[int, Script]] = deque()
        self.last: Script | None = None
        """What the next statement is compiled after: the last one, or the program; None if none are accepted."""
        self._lengths: deque[tuple[int, int]] = deque()  # number and length of each stored statement
        self._waiting = self._ending = self._clearing = self._published = False
        self._interpreted = self._executed = self._cleared = self._forgotten = 0

    @property
    def published(self) -> Interpreter | None:
        """State of the statements for `io`; None before the first program that accepts statements."""
        if not self._published:
            return None
        return Interpreter(
            interpreted=self._interpreted,
            executed=self._executed,
            cleared=self._cleared,
            waiting=len(self._queue),
        )

    # ------------------------------------------------------------------ for programs

    def open(self, machine: Machine) -> None:
        """Handle the start of the main program."""
        self.close()
        if WAITS in machine.script.used:
            self._program, self.last, self._published = machine, machine.script, True
            self._lengths.clear()
            self._waiting = self._clearing = False
            self._interpreted = self._executed = self._cleared = self._forgotten = 0

    def close(self) -> None:
        """Handle the end of the main program."""
        self._queue.clear()
        self._program = self.last = None

    def carry_out(self, *, clear_queue: bool, clear_at_end: bool) -> Turns:
        """Carry out statements until `end` is called."""
        machine = self._machine()
        if machine is not self._program or self._waiting or machine.thread != 0:
            where = "in a statement" if self._waiting and machine.thread == 0 else "in a thread"
            raise Fault(f"{WAITS} cannot be called {where}: only the main program can wait for statements")
        if clear_queue and self._queue:
            first, last = self._queue[0][0], self._queue[-1][0]
            why = f"{WAITS}() has dropped the statements {first} to {last}, which were sent before it was called"
            self._emit("warning", why=why)
            self._queue.clear()
        self._waiting, self._ending, self._peripherals.changed = True, False, True
        try:
            while not self._ending:
                if self._queue:
                    yield from self._carry_out_next(machine)
                else:
                    yield from self._arm.finish()
                    if not self._queue:
                        yield
        finally:
            self._waiting, self._peripherals.changed = False, True
        if clear_at_end and self.last is not None:
            self._forget(machine, self.last.scopes)
            self._restart(machine)

    def end(self) -> None:
        """Carry out no more statements."""
        self._ending = True

    def clear(self) -> None:
        """Clear all statements and what they defined, after the present statement, which calls this."""
        if not self._waiting or self._machine() is not self._program:
            raise Fault(f"{CLEAR} can only be called while the program waits in {WAITS}()")
        self._clearing = True

    def _carry_out_next(self, machine: Machine) -> Turns:
        self._executed, script = self._queue.popleft()
        self._peripherals.changed = True
        yield from machine.add(script, f"statement {self._executed}")
        if self._clearing:
            self._forget(machine, script.scope.number)
            if CLEAR not in script.used:  # otherwise this was done when the statement was added
                self._restart(machine)
        if machine.left <= 0:
            yield

    def _forget(self, machine: Machine, before: int) -> None:
        """Clear executed statements, and functions whose scopes have smaller numbers."""
        self._clearing = False
        self._cleared, self._peripherals.changed = self._executed, True
        while self._lengths and self._lengths[0][0] <= self._cleared:
            self._lengths.popleft()
        machine.forget(before)

    def _restart(self, machine: Machine) -> None:
        """Compile later statements as if they followed the program directly, without earlier statements."""
        if self.last is not None:
            self.last = machine.script.forgetting(self.last)
            self._forgotten = self._interpreted

    # ------------------------------------------------------------------ for clients

    def interpret(self, script: Script) -> int:
        """Add a statement and return its number."""
        assert self._program is not None, "the statement was compiled after a program"
        clears = CLEAR in script.used
        self._check_room(len(script.text), clears=clears)
        self._interpreted += 1
        self._queue.append((self._interpreted, script))
        self._lengths.append((self._interpreted, len(script.text)))
        self.last = script
        if clears:
            self._restart(self._program)
        return self._interpreted

    def _check_room(self, length: int, *, clears: bool) -> None:
        """Refuse a statement that makes the program too large; with uncleared statements, twice as large."""
        held = [characters for _, characters in self._lengths]
        added = [characters for number, characters in self._lengths if number > self._forgotten]
        full = len(held) >= HELD * MAX_STATEMENTS or sum(held) + length > HELD * MAX_SCRIPT
        if full or ((len(added) >= MAX_STATEMENTS or sum(added) + length > MAX_SCRIPT) and not clears):
            taken = f"{MAX_STATEMENTS} statements or {MAX_SCRIPT} characters"
            why = f"the program has taken {taken}: clear them with {CLEAR}()"
            raise RefusalError("busy", "text", why, MAX_STATEMENTS)

    def skip(self, what: Literal["statements", "move"]) -> None:
        """Drop the waiting statements, or skip the present move."""
        if what == "statements":
            self._queue.clear()
        else:
            self._arm.abort()
