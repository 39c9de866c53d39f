"""What an exported file says of its columns, and what it holds beside them: events, info, notes. As JSON."""

import json
from pathlib import Path
from typing import Annotated

import msgspec

from tvist_lab.recordings.recording import Floats, Recording, RecordingError
from tvist_lab.recordings.units import meaning_of
from tvist_protocol.content import checked, parse_json
from tvist_protocol.errors import ProtocolError
from tvist_protocol.info import Info
from tvist_protocol.stream import Event

KEY = "tvist"
"""Name of the description in a file that has named parts."""
FORMAT = 1
"""Version of the description."""


class ColumnDescription(msgspec.Struct, frozen=True):
    """One column."""

    width: Annotated[int, msgspec.Meta(ge=0, le=100_000)] | None
    """Number of entries in a row; null for a number."""
    unit: str
    """Unit or units (SI)."""
    meaning: str
    """What it is."""


class Description(msgspec.Struct, frozen=True):
    """A recording without its arrays."""

    format: int
    """Version of the description."""
    columns: dict[str, ColumnDescription]
    """Columns in their order."""
    events: list[Event] = []
    """Events in the order of their ticks."""
    info: Info | None = None
    """Description of the robot."""
    notes: list[str] = []
    """What was left out when the recording was read."""
    foreign: bool = False
    """Whether another controller was recorded."""

    def recording(self, columns: dict[str, Floats]) -> Recording:
        """Return the recording with these arrays."""
        return Recording(columns, tuple(self.events), self.info, tuple(self.notes), foreign=self.foreign)


def ordered(recording: Recording) -> dict[str, Floats]:
    """Return the columns with `timestamp` first, where there is one."""
    columns = dict(recording.columns)
    first = {"timestamp": columns.pop("timestamp")} if "timestamp" in columns else {}
    return first | columns


def describe(recording: Recording) -> bytes:
    """Return the description of a recording as JSON in ASCII."""
    columns = {
        name: ColumnDescription(
            None if values.ndim == 1 else values.shape[1], meaning_of(name).unit(), meaning_of(name).meaning
        )
        for name, values in ordered(recording).items()
    }
    described = Description(
        FORMAT, columns, list(recording.events), recording.info, list(recording.notes), recording.foreign
    )
    return json.dumps(msgspec.to_builtins(described)).encode()


def sidecar(path: Path) -> Path:
    """Return the file beside a CSV that describes it, as the W3C's "CSV on the Web" names it."""
    return path.with_name(f"{path.name}-metadata.json")


def described(text: str) -> Description:
    """Read a description from JSON.

    Raises:
        RecordingError: It is none, or of a later version.
    """
    try:
        content = parse_json(text.encode())
    except ProtocolError as error:
        raise RecordingError(f"has no valid description of its columns: {error.why}") from error
    return checked_description(content)


def checked_description(content: object) -> Description:
    """Read a description from plain values.

    Raises:
        RecordingError: It is none, or of a later version.
    """
    try:
        found = checked(content, Description)
    except ProtocolError as error:
        raise RecordingError(f"has no valid description of its columns: {error.why}") from error
    if found.format != FORMAT:
        raise RecordingError(f"has a description of format {found.format}; {FORMAT} can be read")
    return found
