"""Statements that clients add to a program while it waits for them."""

from collections import deque
from collections.abc import Callable

from tvist_controller.command_row import Call, Row
from tvist_controller.peripherals import Peripherals
from tvist_controller.planning.basis import StatementBasis
from tvist_controller.programs.arm import ProgramArm, Turns
from tvist_controller.refusal import RefusalError
from tvist_protocol.programs import Interpreter, ProgramInterpret, ProgramSkip
from tvist_protocol.replies import Accepted
from tvist_urscript import Fault, Machine, Script

MOST = 1000
"""Statements that a program may be given before it forgets them."""
CLEAR = "clear_interpreter"
"""Function that forgets them."""


class StatementQueue:
    """The statements for one robot's program.

    Args:
        machine: Returns the program that runs now.
        arm: Its arm.
        peripherals: What is published with the state of the statements.
    """

    def __init__(self, machine: Callable[[], Machine], arm: ProgramArm, peripherals: Peripherals) -> None:
        self._machine, self._arm, self._peripherals = machine, arm, peripherals
        self._program: Machine | None = None
        """The program that waits for statements, or has waited last."""
        self._queue: deque[tuple[int, Script]] = deque()
        self._last: Script | None = None
        """The last statement that was added, or the program."""
        self._open = self._ending = self._clearing = False
        self._interpreted = self._executed = self._cleared = self._forgotten = 0
        self.rows = (
            Row(ProgramInterpret, self._interpret, changes_io=True),
            Row(ProgramSkip, self._skip, changes_io=True),
        )

    @property
    def basis(self) -> StatementBasis:
        """What the next statement is compiled after."""
        return StatementBasis(self._last if self._open else None)

    @property
    def published(self) -> Interpreter | None:
        """State of the statements; None before the first program that waits for some."""
        if self._program is None:
            return None
        return Interpreter(
            interpreted=self._interpreted,
            executed=self._executed,
            cleared=self._cleared,
            waiting=len(self._queue),
        )

    # ------------------------------------------------------------------ for programs

    def carry_out(self, *, clear_queue: bool, clear_at_end: bool) -> Turns:
        """Carry out statements until `end` is called.

        Args:
            clear_queue: Whether statements that were left over are dropped first.
            clear_at_end: Whether the program forgets them at the end.

        Raises:
            Fault: The program carries out statements already, or this is not its main thread.
        """
        machine = self._machine()
        if self._open or machine.thread != 0:
            where = "in a statement" if self._open else "in a thread"
            raise Fault(
                f"interpreter_mode cannot be called {where}: only the main program can wait for statements"
            )
        if machine is not self._program:
            self._begin(machine)
        if clear_queue:
            self._queue.clear()
        self._open, self._ending, self._peripherals.changed = True, False, True
        try:
            while not self._ending:
                if self._queue:
                    self._executed, script = self._queue.popleft()
                    self._peripherals.changed = True
                    yield from machine.add(script)
                    if self._clearing:
                        self._forget(machine, script.scope.number)
                        if CLEAR not in script.used:  # otherwise this was done when it was added
                            self._restart(machine)
                else:
                    yield from self._arm.finish()
                    if not self._queue:
                        yield
        finally:
            self._open, self._peripherals.changed = False, True
        if clear_at_end and self._last is not None:
            self._forget(machine, self._last.scopes)
            self._restart(machine)

    def end(self) -> None:
        """Carry out no further statements."""
        self._ending = True

    def clear(self) -> None:
        """Forget all statements so far and their functions, when the one that calls this has ended."""
        self._clearing = True

    def close(self) -> None:
        """Handle the end of the program."""
        self._queue.clear()
        self._last = None

    def _begin(self, machine: Machine) -> None:
        self._queue.clear()
        self._program, self._last = machine, machine.script
        self._clearing = False
        self._interpreted = self._executed = self._cleared = self._forgotten = 0

    def _forget(self, machine: Machine, before: int) -> None:
        """Forget functions with smaller numbers of scopes, unless a thread may still need them."""
        self._clearing = False
        self._cleared, self._peripherals.changed = self._executed, True
        if len(machine.living) == 1:
            machine.forget(before)

    def _restart(self, machine: Machine) -> None:
        """Compile later statements after the program alone."""
        if self._last is not None:
            self._last = machine.script.forgetting(self._last)
            self._forgotten = self._interpreted

    # ------------------------------------------------------------------ for clients

    def _interpret(self, call: Call[ProgramInterpret]) -> Accepted:
        script: Script = call.planned()
        assert self._program is not None, "the statement was compiled after a program"
        clears = CLEAR in script.used
        if len(self._queue) >= MOST or (self._interpreted - self._forgotten >= MOST and not clears):
            why = f"{MOST} statements were added: the program must forget them first, by {CLEAR}()"
            raise RefusalError("busy", "text", why, MOST)
        self._interpreted += 1
        self._queue.append((self._interpreted, script))
        self._last = script
        if clears:
            self._restart(self._program)
        return Accepted(id=self._interpreted)

    def _skip(self, call: Call[ProgramSkip]) -> None:
        if call.command.what == "statements":
            self._queue.clear()
        else:
            self._arm.abort()
