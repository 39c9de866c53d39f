"""Read a file of any known format; its content decides which."""

import os
from pathlib import Path

from tvist_lab.recordings.log_columns import ROBOT, Needs
from tvist_lab.recordings.mcap_records import MAGIC as MCAP
from tvist_lab.recordings.mcap_records import files_of
from tvist_lab.recordings.packed import GZIP, content
from tvist_lab.recordings.recording import Recording, RecordingError
from tvist_plant.user_file import UserFileError, check_is_file

SHOWN = 4096
"""Number of first bytes by which text is told from packets."""
TABLES = (".parquet", ".npz")
"""Endings of the names of files with named arrays."""


def read(path: str | os.PathLike[str], columns: str | None = None, needs: Needs = ROBOT) -> Recording:
    """Read a recording of this controller, or a log of another one.

    Recordings: MCAP, and what `tvist log export` writes (CSV, Parquet). Logs: CSV with RTDE's names, dumps of
    UR's port 30003, rosbag2 in MCAP (a file, or its folder). CSV and dumps may be compressed by gzip.

    Args:
        path: The file; or a folder, or a pattern such as `run-2-part*.mcap`, with the segments of one recording.
        columns: How a CSV, or a table of another program, names what is needed, as in `time=t:ms,q=joint_{}:deg`; see
            `named_columns.named`.
        needs: What a log must have.

    Returns:
        Named columns in SI units; `notes` say what was left out.

    Raises:
        RecordingError: The file cannot be opened or is none of these; the message names the file, and where possible
            the line.
    """
    path = Path(path)
    try:
        return _read(path, columns, needs)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
    except UserFileError as error:
        raise RecordingError(str(error)) from error


def _read(path: Path, names: str | None, needs: Needs) -> Recording:
    if len(files := files_of(path)) > 1:
        return _read_mcap(path, needs)
    (path,) = files
    named = _named(path, needs, names)
    if named is not None:
        used = names is None or path.suffix.lower() in TABLES
        return named if used else named.noted("its columns have names, so those given were not used")
    from tvist_lab.recordings.csv_log import read_csv
    from tvist_lab.recordings.exported import with_sidecar

    return with_sidecar(read_csv(path, names, needs), path)


def _named(path: Path, needs: Needs, names: str | None) -> Recording | None:
    """Read a file whose format says what its columns are; None for a CSV."""
    check_is_file(path, "recording")
    with path.open("rb") as stream:
        head = stream.read(SHOWN)
    if head.startswith(GZIP):
        head = content(path)[:SHOWN]
    if not head:
        raise RecordingError(f"{path} is empty")
    if path.suffix == ".mcap" and not head.startswith(MCAP):
        raise RecordingError(f"{path} is no MCAP file")
    if head.startswith(MCAP):
        return _read_mcap(path, needs)
    if path.suffix.lower() in TABLES:
        from tvist_lab.recordings.exported import read_exported

        return read_exported(path, needs, names)
    if b"\0" in head:
        from tvist_lab.recordings.realtime_dump import read_dump

        return read_dump(path)
    return None


def _read_mcap(path: Path, needs: Needs) -> Recording:
    from tvist_lab.recordings import mcap_file

    try:
        content = mcap_file.read_checked(path)
    except mcap_file.RecordingFileError as error:
        from tvist_lab.recordings.rosbag import has_ros, read_rosbag

        if not path.is_file() or not has_ros(path):
            raise error from None
        return read_rosbag(path, needs)
    recording = content.recording
    return recording if content.note is None else recording.noted(content.note.removeprefix(f"{path} "))
