"""Programs of one robot: built-in and stored ones, compilation, and checks without a robot."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from typing import Final, Literal, NamedTuple

from tvist_controller.programs.interpreter import WAITS
from tvist_controller.programs.library import MOVING, known_signatures
from tvist_controller.refusal import RefusalError, invalid, wrong_mode
from tvist_plant.description import RobotDescription
from tvist_protocol.programs import ProgramLoad, ProgramRun
from tvist_urscript import PURE, Script, ScriptError, check, compile_script

KEPT = 8  # size of the cache of compiled programs; many clients send the same text repeatedly
MAX_KEPT = 100  # largest number of stored programs
WAIT: Final = "wait_program.urp"  # runs until it is stopped, for trying play, pause and stop
PAPER: Final = "paper.urp"  # Visits the poses in order and returns the same way


class ScriptCompiler:
    """Compiles programs; long new ones take many ticks."""

    def __init__(self, description: RobotDescription) -> None:
        self._built_in = built_in(description)
        self._compile = lru_cache(KEPT)(_program)

    def rehearse(self) -> None:
        """Build everything that compilation needs, in advance."""
        # A program, then a statement added to it: the compiler treats them differently.
        _compiled("sync()", _compiled("sync()"))

    def compile(self, command: ProgramLoad | ProgramRun) -> Script | None:
        """Return the program of a command; None without a text or built-in program."""
        if (text := command.text) is None:
            assert isinstance(command, ProgramLoad)
            if (text := self._built_in.get(command.name)) is None:
                return None
        return self._compile(text)

    @staticmethod
    def compile_statement(text: str, after: Script | None) -> Script:
        """Compile a statement that follows a program or its last added statement."""
        if after is None:
            raise wrong_mode(f"no program is running that waits for statements: it has to call {WAITS}()")
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
    try:
        return compile_script(text, known_signatures(), after)
    except ScriptError as error:
        raise _refusal(error.line, error.column, error.text) from error


def _refusal(line: int, column: int, text: str) -> RefusalError:
    return RefusalError("script_error", f"text:{line}:{column}", text)


def built_in(description: RobotDescription) -> dict[str, str]:
    """Return the built-in programs' texts by file name; one of them only waits until it is stopped."""
    names = list(description.poses)
    programs = {WAIT: "def wait_program():\n  while True:\n    sync()\n  end\nend\n"}
    if names:
        programs[PAPER] = _moves("paper", [*names, *names[-2::-1]], description)
    return programs | {f"{name}.urp": _moves(name, [name], description) for name in names}


def _moves(title: str, names: Sequence[str], description: RobotDescription) -> str:
    moves = [
        f"  movej({[float(angle) for angle in description.poses[name]]}, a=2.0, v=1.5)" for name in names
    ]
    return "\n".join((f"def {title}():", *moves, "end", ""))


class StoredProgram(NamedTuple):
    """A program and its sender."""

    script: Script
    origin: str | None  # address of the machine that sent it; None if unknown


class StoredPrograms:
    """Built-in programs, compiled when loaded, and programs that clients sent."""

    def __init__(self, built_in: Iterable[str]) -> None:
        self._built_in = frozenset(built_in)
        self._kept: dict[str, StoredProgram] = {}

    @property
    def names(self) -> list[str]:
        """Names of all programs, sorted."""
        return sorted(self._built_in | set(self._kept))

    def keep(self, name: str, kept: StoredProgram) -> None:
        """Store a program under its name, replacing an earlier one."""
        if name not in self._kept and len(self._kept) >= MAX_KEPT:
            why = f"{MAX_KEPT} programs are kept already: send this one with program.run"
            raise RefusalError("busy", "name", why, MAX_KEPT)
        self._kept[name] = kept

    def find(self, name: str) -> StoredProgram:
        """Return a stored program."""
        if name not in self._kept:
            raise invalid("name", repr(name), f"one of {', '.join(self.names)}")
        return self._kept[name]


_NAMES = {name.lower(): name for name in (*known_signatures(), *PURE)}
_UNKNOWN = re.compile(r"compile_error_name_not_found:(\.?\w+):")


@dataclass(frozen=True)
class ProgramFinding:
    """A place in a program that needs attention."""

    line: int  # line of the text, from 1
    column: int  # column of the token at fault, from 1
    level: Literal["error", "warning"]
    """Errors prevent the start; warnings mostly end the program when it reaches them."""
    text: str  # message


def check_program(text: str) -> list[ProgramFinding]:
    """Return the findings in a program's text, in order; see `check`."""
    errors, warnings = check(text, known_signatures())
    findings = [_error(error) for error in errors]
    findings += [ProgramFinding(one.line, one.column, "warning", one.text) for one in warnings]
    return sorted(findings, key=lambda finding: (finding.line, finding.column))


def _error(error: ScriptError) -> ProgramFinding:
    """Return the compiler's error; for an unknown name, suggest the function with the most similar name."""
    unknown = _UNKNOWN.fullmatch(error.text)
    near = [] if unknown is None else get_close_matches(unknown[1].lower(), _NAMES, n=1, cutoff=0.75)
    said = f"{error.text} did you mean {_NAMES[near[0]]}?" if near else error.text
    return ProgramFinding(error.line, error.column, "error", said)
