"""Make recorded runs anew from their journals: `python -m tests.journals.make [FILE ...]`, by default all runs here.

What clients sent stays; what the robot did is that of the present controller. Every fiftieth state and truth is kept.
"""

import hashlib
import os
import sys
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from llvmlite import binding

from tvist_lab.recordings.mcap_file import read
from tvist_lab.replay import replay_file
from tvist_server.recording.recorder import Recorder

FOLDER = Path(__file__).parent
EVERY = 50  # every fiftieth state is kept
MADE_ON = FOLDER / "made-on.txt"
"""Names the processor that made the runs."""


def processor():
    """Return what the last bits depend on: the processor, and libraries that select code for it."""
    features = sorted(name for name, there in binding.get_host_cpu_features().items() if there)
    libraries = [version(name) for name in ("numpy", "numba", "llvmlite", "pin", "ruckig")]
    names = ("OPENBLAS_CORETYPE", "NUMBA_CPU_NAME", "NUMBA_DISABLE_JIT")
    told = " ".join([*features, *libraries, *(os.environ.get(name, "") for name in names)])
    return f"{binding.get_host_cpu_name()} {hashlib.sha256(told.encode()).hexdigest()[:16]}"


def make(path, made):
    """Write the run of the journal at one path to the other."""
    content = read(path)
    again = replay_file(content)
    last = again.states[-1].tick
    kept = [one for one in (*again.states, *again.truths) if one.tick % EVERY == 0 or one.tick == last]
    with Recorder(made, content.info, content.start, wait=True) as recorder:
        for message in (*content.journal, *again.events, *kept):
            recorder.take(message)


if __name__ == "__main__":
    with TemporaryDirectory(dir=FOLDER) as folder:
        paths = [Path(name) for name in sys.argv[1:]] or sorted(FOLDER.glob("*.mcap"))
        for path in paths:
            make(path, Path(folder, path.name))
        for path in paths:
            Path(folder, path.name).replace(FOLDER / path.name)
    MADE_ON.write_text(processor() + "\n", encoding="utf-8")
