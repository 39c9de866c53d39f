"""Compare translations of PolyScope's programs with its exports: `python -m tools.polyscope_pairs FOLDER [SECONDS]`.

For each .urp file beside a .script file, translation and export run in lockstep from the first waypoint, with
the TCP and the installation's variables of the export, for at most SECONDS of robot time. URCaps' nodes are
left out of both, since exports contain the URCaps' own programs, and Modbus signals are not added. The first
node begins at the same tick. Translation and export agree if their references in moving ticks differ by at
most 1e-6 rad and their outputs change to the same values in the same ticks, over the length of the shorter
run.
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
from tvist_server.polyscope.nodes import Choices

MOVING, EQUAL = 1e-9, 1e-6
"""Change per tick above which a joint moves, and largest difference of equal paths [rad]."""
_NODE = re.compile(r"^ *# (begin|end): URCap (Installation|Program) Node")
_VARIABLE = re.compile(r"^  global \w+ ?= ?(p?\[|-?[\d.]+$)")
_SET_UP = re.compile(r"^  set_\w+\(.*\n", re.MULTILINE)
_MODBUS = re.compile(r" *modbus_(add|set)_")
_FIRST = re.compile(
    r"^ *\$ [12] ", re.MULTILINE
)  # in a program with variables to initialize, node 1 has no label
_WAIT = "while (time().sec < 1):\n  sync()\nend\n"
_OUTPUTS = ("actual_digital_output_bits", "standard_analog_output")
_URCAPS = frozenset({"Robotiq_Grippers", "Robotiq_Copilot", "Olis Teleop", "teleop"})
_POSTURE = re.compile(r"global \w+_q ?= ?\[([^]]*)\]")


def without_urcaps(export: str) -> str:
    """Return an export without the lines of URCaps' nodes, except labels."""
    lines, depth = [], 0
    for line in export.splitlines():
        if found := _NODE.match(line):
            depth += 1 if found[1] == "begin" else -1
        elif not depth and not _MODBUS.match(line):
            lines.append(line)
    return "\n".join(lines) + "\n"


def translated(program: Path, export: str) -> str:
    """Return a program's translation without URCaps' nodes, with the variables of its export's installation."""
    text = read_program(program, Choices(_URCAPS))
    lines = text.splitlines()
    first = next(at for at, line in enumerate(lines) if line.lstrip().startswith(("$", "def ")) and at)
    head = export[: export.find("  $ 1 ")].splitlines()
    lines[first:first] = [line for line in head if _VARIABLE.match(line)]
    return "\n".join(lines) + "\n"


def aligned(text: str, export: str) -> str:
    """Return a program whose first node, after the set-up of an export, begins at a given tick.

    The set-up lets the arm sag a little, so that measured poses depend on the time since then.
    """
    first = found.start() if (found := _FIRST.search(text)) else 0
    set_up = "".join(one[0] for one in _SET_UP.finditer(export[: export.find("  $ 1 ")]))
    return f"{_SET_UP.sub('', text[:first])}{_WAIT}{set_up}{text[first:]}"


def travelled(text: str, start: str, seconds: float) -> tuple[Floats, Floats, str]:
    """Run a program; return references of moving ticks, outputs of all ticks, and how the program ended."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "run.mcap")
        setup = free_setup(profile="ursim", floor=False, start=start or None)
        watch = run_in_lockstep(
            setup, text, (), record=file, timeout=seconds, attend=lambda _: None, on_record_error=print
        )
        found = read(file)
        q = np.asarray(found["reference_q"])
        outputs = np.column_stack([np.asarray(found[name]) for name in _OUTPUTS])
    moves = np.abs(np.diff(q, axis=0)).max(axis=1) > MOVING
    return q[1:][moves], outputs, watch.why or watch.reason or ""


def compared(program: Path, export: Path, seconds: float) -> tuple[str, str]:
    """Return whether the translation and the export of a program agree, and how they differ."""
    theirs = without_urcaps(export.read_text(encoding="utf-8", errors="replace"))
    try:
        ours = translated(program, theirs)
    except UserFileError as error:
        return "refused", str(error)
    taught = _POSTURE.search(theirs)
    start = taught[1].replace(" ", "") if taught else ""
    runs = []
    for text in (ours, theirs):
        try:
            runs.append(travelled(aligned(text, theirs), start, seconds))
        except RefusedError as error:
            runs.append((np.empty((0, 6)), np.empty((0, 3)), f"does not start: {error}"))
    (path, outputs, end), (other_path, other_outputs, other_end) = runs
    ticks, all_ticks = min(len(path), len(other_path)), min(len(outputs), len(other_outputs))
    apart = float(np.abs(path[:ticks] - other_path[:ticks]).max()) if ticks else 0.0
    wrong = int((outputs[:all_ticks] != other_outputs[:all_ticks]).any(axis=1).sum())
    agree = apart <= EQUAL and not wrong and (ticks or end == other_end)
    word = "differs" if not agree else "agrees" if ticks else "agrees without motion"
    told = f"{apart:.1e} rad in {ticks} of {len(path)} and {len(other_path)} ticks"
    return word, f"{told}, other outputs in {wrong} ticks; {end} / {other_end}"


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
