"""Reading of programs in URScript, and what is wrong with them."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told

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


def _is_stdin(file: Path) -> bool:
    """Whether a file is the standard input; a blank before the name keeps it from being taken for an option."""
    return str(file).strip() == STDIN
