"""Print the errors and warnings of a script: `python -m tvist_urscript FILE`."""

import re
import sys
from pathlib import Path

from tvist_urscript.checker import check
from tvist_urscript.errors import ScriptError, name_not_found
from tvist_urscript.names import BUILT_IN_ARRAYS
from tvist_urscript.signatures import Signature, parameters

CALL = re.compile(r"(?P<name>\w+)\s*\(")
ARRAYS = {read: Signature(parameters("n")) for read, _ in BUILT_IN_ARRAYS.values()} | {
    write: Signature(parameters("n", "value")) for _, write in BUILT_IN_ARRAYS.values() if write
}
"""Robot functions that `digital_out[0]` and similar expressions call."""


def main(arguments: list[str]) -> int:
    """Return the exit code: 0 if the script can run, 1 if it has errors, 2 without a readable file.

    A function that neither the script nor the language defines is assumed to be the robot's.
    """
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print("usage: python -m tvist_urscript FILE", file=sys.stderr)
        return 0 if arguments == ["--help"] else 2
    path = Path(arguments[0])
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as unreadable:
        print(f"{path} cannot be read: {unreadable.strerror}", file=sys.stderr)
        return 2
    lines = text.split("\n")
    found = check(text, ARRAYS)
    errors = [error for error in found.errors if not _is_of_robot(error, lines)]
    for error in errors:
        print(f"{path}:{error.line}:{error.column}: {error.text}")
    for warning in found.warnings:
        print(f"{path}:{warning.line}:{warning.column}: warning: {warning.text}")
    return 1 if errors else 0


def _is_of_robot(error: ScriptError, lines: list[str]) -> bool:
    call = CALL.match(lines[error.line - 1], error.column - 1)
    return call is not None and error.text == name_not_found(call["name"])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
