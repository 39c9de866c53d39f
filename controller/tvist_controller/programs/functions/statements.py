"""Functions with which a program waits for statements from clients."""

from tvist_controller.programs.arguments import flag
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.interpreter import StatementQueue
from tvist_controller.programs.journey import Turns


class StatementFunctions:
    """Lets clients add statements to the program.

    Args:
        arm: The arm of the program.
        queue: The statements.
    """

    def __init__(self, arm: ProgramArm, queue: StatementQueue) -> None:
        self._arm, self._queue = arm, queue

    def interpreter_mode(self, clearQueueOnEnter: object = True, clearOnEnd: object = True) -> Turns:
        """Carry out the statements that clients send to port 30020, until one of them calls `end_interpreter`.

        They see the program's functions and its variables, and may define both.
        """
        clear_queue = flag("clearQueueOnEnter", clearQueueOnEnter)
        clear_at_end = flag("clearOnEnd", clearOnEnd)
        yield from self._arm.finish()
        yield from self._queue.carry_out(clear_queue=clear_queue, clear_at_end=clear_at_end)

    def end_interpreter(self) -> None:
        """Let `interpreter_mode` return when the present statement has ended."""
        self._queue.end()

    def clear_interpreter(self) -> None:
        """Forget all statements so far, with the variables and functions that they define, and end their threads."""
        self._queue.clear()
