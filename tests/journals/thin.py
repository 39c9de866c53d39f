"""Keep what a replay needs, and every fiftieth state and truth: `python -m tests.journals.thin FOLDER`."""

import hashlib
import os
import sys
from importlib.metadata import version
from pathlib import Path

from llvmlite import binding

from tvist_lab.recordings.mcap_file import read
from tvist_server.recording.recorder import Recorder

EVERY = 50
"""Of so many states one is kept."""
MADE_ON = Path(__file__).parent / "made-on.txt"
"""Names the processor that made the runs."""


def processor():
    """What the last bits depend on: the processor, and the libraries that choose their code by it."""
    features = sorted(name for name, there in binding.get_host_cpu_features().items() if there)
    libraries = [version(name) for name in ("numpy", "numba", "llvmlite", "pin", "ruckig")]
    names = ("OPENBLAS_CORETYPE", "NUMBA_CPU_NAME", "NUMBA_DISABLE_JIT")
    told = " ".join([*features, *libraries, *(os.environ.get(name, "") for name in names)])
    return f"{binding.get_host_cpu_name()} {hashlib.sha256(told.encode()).hexdigest()[:16]}"


def thin(path, kept):
    content = read(path)
    last = content.states[-1].tick
    with Recorder(kept, content.info, content.start, overwrite=True, wait=True) as recorder:
        for entry in content.journal:
            recorder.journal(entry)
        for event in content.events:
            recorder.event(event)
        for state in content.states:
            if state.tick % EVERY == 0 or state.tick == last:
                recorder.state(state)
        for truth in content.truths:
            if truth.tick % EVERY == 0:
                recorder.truth(truth)


if __name__ == "__main__":
    MADE_ON.write_text(processor() + "\n", encoding="utf-8")
    for path in Path(sys.argv[1]).glob("*.mcap"):
        thin(path, Path(__file__).parent / path.name)
