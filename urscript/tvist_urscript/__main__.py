"""Run a script without a robot and print what it says: `python -m tvist_urscript FILE`."""

import sys
from pathlib import Path

from tvist_urscript.dry_run import dry_run


def main(arguments: list[str]) -> int:
    """Return the exit code: 0 if the script has ended, 1 if it has an error or does not end, 2 without a file."""
    if len(arguments) != 1:
        print("usage: python -m tvist_urscript FILE", file=sys.stderr)
        return 2
    path = Path(arguments[0])
    run = dry_run(path.read_text(encoding="utf-8", errors="replace"))
    for text in run.memory.said:  # without a terminal's commands
        print("".join(c if c.isprintable() or c in "\n\t" else "\N{REPLACEMENT CHARACTER}" for c in text))
    if run.error is not None:
        print(f"{path}: {run.error}", file=sys.stderr)
        return 1
    if not run.ended:
        print(f"{path}: the program has not ended after {run.ticks} ticks", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
