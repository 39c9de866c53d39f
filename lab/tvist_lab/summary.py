"""Summary of a recording or log: what a file holds, without its values."""

import os
from collections import Counter
from pathlib import Path
from typing import Any

from tvist_lab.metrics import motions
from tvist_lab.recordings import Recording, RecordingError, mcap_file, read
from tvist_lab.recordings.description import meaning_of, ordered
from tvist_lab.recordings.log_columns import ROBOT_OR_SENSOR


def summary(path: str | os.PathLike[str], read_as: Recording | None = None) -> dict[str, Any]:
    """Describe a file that `tvist_lab.recordings.read` reads.

    Args:
        path: The file.
        read_as: What was read from it, if it was not read as it is.

    Returns:
        Times in s on the recording's own clock. `complete`, `dropped`, `replayable`, `from_tick` and `messages` are
        null for other files than recordings of a served robot, `motions` if the columns do not show them. `from_tick`
        is the first tick of a recording that has forgotten those before.

    Raises:
        RecordingError: The file cannot be read; the message names it.
    """
    path = Path(path)
    content: mcap_file.RecordingFile | None = None
    try:
        content = mcap_file.read_checked(path)
        recording = read_as or content.recording
    except mcap_file.RecordingFileError:
        recording = read_as or read(path, needs=ROBOT_OR_SENSOR)
    info = recording.info
    return {
        "file": str(path),
        "bytes": path.stat().st_size if path.is_file() else None,
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
        "motions": _motions(recording),
        "columns": [
            {
                "name": name,
                "shape": list(values.shape),
                "unit": meaning_of(name).unit(),
                "meaning": meaning_of(name).meaning,
            }
            for name, values in ordered(recording).items()
        ],
        "notes": list(recording.notes) + _note(content),
    }


def _motions(recording: Recording) -> int | None:
    try:
        return len(motions(recording))
    except RecordingError:
        return None


def _note(content: mcap_file.RecordingFile | None) -> list[str]:
    """Return the note about what is missing in a recording, without the name of its file."""
    return [] if content is None or content.note is None else [content.note.removeprefix(f"{content.path} ")]
