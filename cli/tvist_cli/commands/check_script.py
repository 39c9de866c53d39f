"""`tvist check-script`: look for errors in programs without running them."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.failure import Failure
from tvist_cli.output import print_json
from tvist_cli.scripts import named, placed, read_script
from tvist_protocol.errors import harmless


def check_script(*file: Annotated[Path, Parameter(required=True)], json: bool = False) -> None:
    """Look for errors in programs in URScript, without a robot and without running them.

    Each error is a line FILE:LINE:COLUMN: text. Errors are what keeps a program from starting: wrong syntax, unknown
    names, and calls that do not fit their functions. A function of UR's robots that tvist does not simulate is a
    warning: the program starts, and ends with an error when it calls that function.

    Exit code 0: there is no error. Exit code 1: there is at least one. Exit code 2: a file cannot be read.

    Args:
        file: Programs to look at; - reads the standard input.
        json: Print one JSON object.
    """
    from tvist_controller.programs.checking import check_program

    found = [(one, finding) for one in file for finding in check_program(read_script(one))]
    errors = sum(finding.level == "error" for _, finding in found)
    if json:
        findings = [
            {"file": named(one), "line": finding.line, "column": finding.column, "level": finding.level,
             "text": finding.text}
            for one, finding in found
        ]  # fmt: skip
        print_json({"ok": errors == 0, "files": len(file), "errors": errors, "findings": findings})
    else:
        for one, finding in found:
            print(harmless(placed(one, finding)))
    if errors:
        files = "1 program" if len(file) == 1 else f"{len(file)} programs"
        raise Failure(f"{errors} {'error' if errors == 1 else 'errors'} in {files}")
