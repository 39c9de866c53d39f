"""Programs of one robot, compiled from their text."""

from functools import lru_cache

from tvist_controller.commands.refusal import RefusalError
from tvist_controller.programs.built_in import built_in
from tvist_controller.programs.interpreter import WAITS
from tvist_controller.programs.library import MOVING, known_signatures
from tvist_plant.description import RobotDescription
from tvist_protocol.programs import ProgramLoad, ProgramRun
from tvist_urscript import Script, ScriptError

KEPT = 8
"""Compiled programs that are kept, since many clients send the same text again and again."""


class ScriptCompiler:
    """Compiles programs, which takes many ticks for long ones that are new.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._built_in = built_in(description)
        self._compile = lru_cache(KEPT)(_program)

    def rehearse(self) -> None:
        """Build what compiling uses, before any program comes."""
        from tvist_urscript import compile_script  # with the compiler, which no start waits for

        # Once as a program, and once as a statement that is added to it, which takes other ways through the compiler.
        compile_script("sync()", known_signatures(), compile_script("sync()", known_signatures()))

    def compile(self, command: ProgramLoad | ProgramRun) -> Script | None:
        """Return the program of a command; None if it names a program without giving its text that is not built in.

        Raises:
            RefusalError: The text is not valid.
        """
        text = command.text
        if text is None:
            assert isinstance(command, ProgramLoad)
            text = self._built_in.get(command.name)
            if text is None:
                return None
        return self._compile(text)

    @staticmethod
    def compile_statement(text: str, after: Script | None) -> Script:
        """Return a statement for a running program.

        Args:
            text: Its text.
            after: The program, or what was added to it last; None if no program takes statements.

        Raises:
            RefusalError: The text is not valid, or no program takes statements.
        """
        if after is None:
            why = f"no program is running that waits for statements: it has to call {WAITS}()"
            raise RefusalError("wrong_mode", "", why)
        script = _compiled(text, after)
        if WAITS in script.used:
            raise _refusal(
                1, 1, f"{WAITS} cannot be called in a statement: only the program can wait for statements"
            )
        return script


def _program(text: str) -> Script:
    script = _compiled(text)
    moves = script.used & MOVING
    if script.secondary and moves:
        raise _refusal(1, 1, f"a secondary program cannot move the arm: it calls {', '.join(sorted(moves))}")
    return script


def _compiled(text: str, after: Script | None = None) -> Script:
    from tvist_urscript import compile_script

    try:
        return compile_script(text, known_signatures(), after)
    except ScriptError as error:
        raise _refusal(error.line, error.column, error.text) from error


def _refusal(line: int, column: int, text: str) -> RefusalError:
    return RefusalError("script_error", f"text:{line}:{column}", text)
