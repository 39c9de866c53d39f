"""Recordings in memory and in files."""

from tvist_lab.recordings.read import read
from tvist_lab.recordings.recording import (
    STATE_COLUMNS,
    Floats,
    MissingColumnError,
    Recording,
    RecordingError,
)

__all__ = ["STATE_COLUMNS", "Floats", "MissingColumnError", "Recording", "RecordingError", "read"]
