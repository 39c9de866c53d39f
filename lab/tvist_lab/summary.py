"""Summarize the content of a recording or log, without its values."""

import os
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

from tvist_lab.recordings import Recording, mcap_file
from tvist_lab.recordings.description import meaning_of, ordered
from tvist_lab.recordings.mcap_records import files_of


def summary(path: str | os.PathLike[str], recording: Recording) -> dict[str, Any]:
    """Describe a file that `tvist_lab.recordings.read` reads; times are in s on its own clock.

    `complete`, `dropped`, `replayable`, `from_tick` (the first tick if earlier ones were dropped) and
    `messages` are null unless the file is a recording of a served robot.
    """
    path = Path(path)
    content: mcap_file.RecordingFile | None = None
    with suppress(mcap_file.RecordingFileError):
        content = mcap_file.read_checked(path)
    info = recording.info
    return {
        "file": str(path),
        "bytes": sum(file.stat().st_size for file in files_of(path)),
        "robot": content.robot if content else info and info.name,
        "model": info and info.model,
        "version": info and info.version,
        "start_s": float(recording.time[0]),
        "duration_s": float(recording.time[-1] - recording.time[0]),
        "rows": len(recording),
        "missing_ticks": recording.missing_ticks,
        "complete": content and content.complete,
        "dropped": content.dropped and dict(content.dropped) if content else None,
        "replayable": content
        and bool(content.start)
        and content.from_tick is None
        and getattr(info, "watched", None) is None,
        "from_tick": content and content.from_tick,
        "messages": content
        and {**content.counts, "event": len(content.events), "journal": len(content.journal)},
        "events": dict(Counter(str(event.kind) for event in recording.events)),
        "columns": [
            {
                "name": name,
                "shape": list(values.shape),
                "unit": meaning_of(name).unit,
                "meaning": meaning_of(name).meaning,
            }
            for name, values in ordered(recording).items()
        ],
        "notes": list(recording.notes),
    }
