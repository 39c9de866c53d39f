"""Compare translations of PolyScope's programs with its exports: `python -m tools.polyscope_pairs FOLDER [SECONDS]`.

For each .urp file beside a .script file, translation and export run in lockstep from the first waypoint, with
the TCP and the installation's variables of the export, for at most SECONDS of robot time. URCaps' nodes are
left out of both, since exports contain the URCaps' own programs. Translation and export agree if they move
the arm along the same path: their references in moving ticks differ by at most 1e-6 rad, over the length of
the shorter run.
"""

import re
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from tvist_lab.in_process import free_setup
from tvist_lab.programs.running import run_in_lockstep
from tvist_lab.recordings.read import read
from tvist_plant.model import Floats
from tvist_plant.user_file import UserFileError
from tvist_protocol.errors import RefusedError
from tvist_server.polyscope.files import read_program

MOVING, EQUAL = 1e-9, 1e-6
"""Change per tick above which a joint moves, and largest difference of equal paths [rad]."""
_NODE = re.compile(r"^ *# (begin|end): URCap (Installation|Program) Node")
_SET_UP = re.compile(r"^  (set_tcp|set_payload|global \w+ ?= ?(p?\[|-?[\d.]+$))")
_POSTURE = re.compile(r"global \w+_q ?= ?\[([^]]*)\]")


def without_urcaps(export: str) -> str:
    """Return an export without the lines of URCaps' nodes, except labels."""
    lines, depth = [], 0
    for line in export.splitlines():
        if found := _NODE.match(line):
            depth += 1 if found[1] == "begin" else -1
        elif not depth:
            lines.append(line)
    return "\n".join(lines) + "\n"


def translated(program: Path, export: str) -> str:
    """Return a program's translation without URCaps' nodes, with the set-up of its export."""
    text = read_program(program, frozenset({"Robotiq_Grippers", "Robotiq_Copilot", "Olis Teleop", "teleop"}))
    lines = text.splitlines()
    first = next(at for at, line in enumerate(lines) if line.lstrip().startswith(("$", "def ")) and at)
    head = export[: export.find("  $ 1 ")].splitlines()
    lines[first:first] = [line for line in head if _SET_UP.match(line)]
    return "\n".join(lines) + "\n"


def travelled(text: str, start: str, seconds: float) -> tuple[Floats, str]:
    """Run a program; return the references of moving ticks, shape (T, n) [rad], and how the program ended."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        setup = free_setup(profile="ursim", floor=False, start=start or None)
        watch = run_in_lockstep(
            setup, text, (), record=file, timeout=seconds, attend=lambda _: None, on_record_error=print
        )
        q = np.asarray(read(file)["reference_q"])
    moves = np.abs(np.diff(q, axis=0)).max(axis=1) > MOVING
    return q[1:][moves], watch.why or watch.reason or ""


def compared(program: Path, export: Path, seconds: float) -> tuple[str, str]:
    """Return whether the translation and the export of a program agree, and how they differ."""
    theirs = without_urcaps(export.read_text(encoding="utf-8", errors="replace"))
    try:
        ours = translated(program, theirs)
    except UserFileError as error:
        return "refused", str(error)
    taught = _POSTURE.search(theirs)
    paths, ends = [], []
    for text in (ours, theirs):
        try:
            path, end = travelled(text, taught[1].replace(" ", "") if taught else "", seconds)
        except RefusedError as error:
            path, end = np.empty((0, 6)), f"does not start: {error}"
        paths.append(path)
        ends.append(end)
    ticks = min(map(len, paths))
    apart = float(np.abs(paths[0][:ticks] - paths[1][:ticks]).max()) if ticks else 0.0
    word = "agrees" if apart <= EQUAL and (ticks or ends[0] == ends[1]) else "differs"
    return (
        word,
        f"{apart:.1e} rad in {ticks} of {len(paths[0])} and {len(paths[1])} ticks; {ends[0]} / {ends[1]}",
    )


def main(folder: str, seconds: str = "60") -> None:
    """Compare all pairs of a folder."""
    count = Counter[str]()
    for program in sorted(Path(folder).rglob("*.urp")):
        export = program.with_suffix(".script")
        if export.is_file():
            word, how = compared(program, export, float(seconds))
            count[word] += 1
            print(f"{program.relative_to(folder)}: {word}: {how}", flush=True)
    print(dict(count))


if __name__ == "__main__":
    main(*sys.argv[1:])
