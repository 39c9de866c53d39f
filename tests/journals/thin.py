"""Keep what a replay needs of recordings, and every fiftieth state: `python -m tests.journals.thin FOLDER`."""

import sys
from pathlib import Path

from tvist_lab.recordings.mcap_file import read
from tvist_server.recording import Recorder

EVERY = 50
"""Of so many states one is kept."""


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


if __name__ == "__main__":
    for path in Path(sys.argv[1]).glob("*.mcap"):
        thin(path, Path(__file__).parent / path.name)
