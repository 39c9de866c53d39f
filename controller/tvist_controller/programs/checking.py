"""Checks of programs without a robot."""

import re
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal

from tvist_controller.programs.functions.unsimulated import SUBJECTS
from tvist_controller.programs.library import known_signatures
from tvist_urscript import METHOD, PURE, ScriptError, check, compile_script
from tvist_urscript.checker import unportable

_SIMULATED = {name: one for name, one in known_signatures().items() if name not in SUBJECTS}
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
    """Return the findings in a program's text, in order.

    Errors are the compiler's: syntax, unknown names, wrong calls. Warnings are calls of functions that are not
    simulated, constructs that a UR robot rejects or reads differently, and texts that only define functions.
    """
    findings = [_error(error) for error in check(text, known_signatures())]
    # Checking again without these functions locates their calls.
    known = {(finding.line, finding.column) for finding in findings}
    for error in check(text, _SIMULATED):
        unknown = _UNKNOWN.fullmatch(error.text)
        if unknown is None or (error.line, error.column) in known:
            continue
        name = unknown[1].removeprefix(METHOD)
        subject = SUBJECTS.get(name if name == unknown[1] else METHOD)
        if subject is not None:
            text_of_it = f"{name}: this controller does not simulate {subject[1]}"
            findings.append(ProgramFinding(error.line, error.column, "warning", text_of_it))
    if not known:
        findings += [ProgramFinding(one.line, one.column, "warning", one.text) for one in unportable(text)]
        if compile_script(text, known_signatures()).idle:
            why = "the text only defines functions: as a program, it ends at once"
            findings.append(ProgramFinding(1, 1, "warning", why))
    return sorted(findings, key=lambda finding: (finding.line, finding.column))


def _error(error: ScriptError) -> ProgramFinding:
    """Return the compiler's error, with the function closest to an unknown name."""
    unknown = _UNKNOWN.fullmatch(error.text)
    near = [] if unknown is None else get_close_matches(unknown[1].lower(), _NAMES, n=1, cutoff=0.75)
    said = f"{error.text} did you mean {_NAMES[near[0]]}?" if near else error.text
    return ProgramFinding(error.line, error.column, "error", said)
