"""Reading of programs in URScript, and what is wrong with them."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.output import print_json
from tvist_protocol.errors import harmless

if TYPE_CHECKING:
    from tvist_controller.programs.checking import Finding

STDIN = "-"
"""Name that stands for the standard input."""


def named(file: Path) -> str:
    """Return how messages call a file."""
    return "<stdin>" if _is_stdin(file) else str(file)


def read_script(file: Path) -> str:
    """Read a program; `-` reads the standard input.

    Raises:
        Failure: There is no such file, or it is not a text; exit code 2.
    """
    from tvist_plant.user_file import LARGEST, UserFileError, read_text

    if _is_stdin(file):
        content = sys.stdin.buffer.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise Failure(
                f"the standard input has more than {LARGEST >> 20} MiB: is it the right one?", code=2
            )
        try:
            return content.decode()
        except UnicodeDecodeError as error:
            why = f"the standard input is not text in UTF-8 ({error.reason} at byte {error.start})"
            raise Failure(why, code=2) from error
    with told(OSError, code=2):
        try:
            return read_text(file, "program")
        except UserFileError as error:
            raise Failure(str(error), code=2) from error


def placed(file: Path, finding: "Finding") -> str:
    """Return a finding as FILE:LINE:COLUMN: text, which editors understand."""
    kind = "" if finding.level == "error" else f"{finding.level}: "
    return f"{named(file)}:{finding.line}:{finding.column}: {kind}{finding.text}"


def check_scripts(files: Sequence[Path], *, json: bool) -> None:
    """Print what is wrong with programs.

    Raises:
        Failure: One has an error, or cannot be read.
    """
    from tvist_controller.programs.checking import check_program

    found = [(one, finding) for one in files for finding in check_program(read_script(one))]
    errors = sum(finding.level == "error" for _, finding in found)
    if json:
        findings = [
            {"file": named(one), "line": finding.line, "column": finding.column, "level": finding.level,
             "text": finding.text}
            for one, finding in found
        ]  # fmt: skip
        print_json({"ok": errors == 0, "files": len(files), "errors": errors, "findings": findings})
    else:
        for one, finding in found:
            print(harmless(placed(one, finding)))
    if errors:
        programs = "1 program" if len(files) == 1 else f"{len(files)} programs"
        raise Failure(f"{errors} {'error' if errors == 1 else 'errors'} in {programs}")


def _is_stdin(file: Path) -> bool:
    """Whether a file is the standard input; a blank before the name keeps it from being taken for an option."""
    return str(file).strip() == STDIN
