"""Read a file of any known format, which is recognised by its content."""

import os
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from tvist_lab.recordings import formats
from tvist_lab.recordings.checks import GZIP, content
from tvist_lab.recordings.mcap_records import files_of
from tvist_lab.recordings.recording import Recording, RecordingError
from tvist_lab.recordings.table import BINARY, READERS, ROBOT, TEXT, Needs, Reader, to_recording
from tvist_plant.user_file import UserFileError, check_is_file

SHOWN = 4096  # number of first bytes that distinguish text from packets


def read(path: str | os.PathLike[str], columns: str | None = None, needs: Needs = ROBOT) -> Recording:
    """Read a recording of this controller, or a log of another one; `notes` tell what was left out.

    Recordings are MCAP files (or a folder or pattern such as `run-2-part*.mcap` with segments) and the files
    of `tvist log export` (CSV, Parquet). Logs are CSV, Parquet and npz with RTDE's or other names, dumps of
    UR's port 30003, and rosbag2 in MCAP. CSV and dumps may be compressed with gzip.

    `columns` maps names, as in `time=t:ms,q=joint_{}:deg`: a short name (time, q, qd, accelerometer,
    gyroscope, pose) or RTDE's; the column's name, with `{}` for the number or letter of an entry, or a
    position as in `q=2-7`; and its unit if not SI. `needs` are the columns that a log must have. Raises
    RecordingError, with the file and if possible the line, if the file cannot be used.
    """
    path = Path(path)
    for module in iter_modules(formats.__path__, f"{formats.__name__}."):
        import_module(module.name)
    try:
        files = files_of(path)
        found = READERS[".mcap"](path) if len(files) > 1 else _reader_of(*files)(*files)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}") from error
    except UserFileError as error:
        raise RecordingError(str(error)) from error
    if not isinstance(found, Recording):
        return to_recording(found, columns, needs)
    return found if columns is None else found.noted("its columns have names, so those given were not used")


def _reader_of(path: Path) -> Reader:
    check_is_file(path, "recording")
    with path.open("rb") as stream:
        head = stream.read(SHOWN)
    if head.startswith(GZIP):
        head = content(path)[:SHOWN]
    if not head:
        raise RecordingError(f"{path} is empty")
    for kind, reader in READERS.items():
        if head.startswith(kind) if isinstance(kind, bytes) else path.suffix.lower() == kind:
            return reader
    return READERS[BINARY if b"\0" in head else TEXT]
