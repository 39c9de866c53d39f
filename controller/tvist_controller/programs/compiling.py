"""Programs of one robot, compiled from their text."""

from functools import lru_cache

from tvist_controller.programs.built_in import built_in
from tvist_controller.programs.library import MOVING, SIGNATURES
from tvist_controller.refusal import RefusalError
from tvist_plant.description import RobotDescription
from tvist_protocol.programs import ProgramLoad, ProgramRun
from tvist_urscript import Script, ScriptError, compile_script

KEPT = 8
"""Compiled programs that are kept, since many clients send the same text again and again."""


class ScriptCompiler:
    """Compiles programs, which takes many ticks for long ones that are new.

    Args:
        description: The robot.
    """

    def __init__(self, description: RobotDescription) -> None:
        self._built_in = built_in(description)
        self._compile = lru_cache(KEPT)(_compile)

    def rehearse(self) -> None:
        """Build what compiling uses, before any program comes."""
        compile_script("sync()", SIGNATURES)

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


def _compile(text: str) -> Script:
    try:
        script = compile_script(text, SIGNATURES)
    except ScriptError as error:
        raise _refusal(error.line, error.column, error.text) from error
    moves = script.used & MOVING
    if script.secondary and moves:
        raise _refusal(1, 1, f"a secondary program cannot move the arm: it calls {', '.join(sorted(moves))}")
    return script


def _refusal(line: int, column: int, text: str) -> RefusalError:
    return RefusalError("script_error", f"text:{line}:{column}", text)
