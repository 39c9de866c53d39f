"""`tvist log export`: write a recording as CSV, Parquet, npz or mat."""

from pathlib import Path

from tvist_cli.failure import Failure, told
from tvist_cli.misuse import lower
from tvist_cli.output import print_json, say


def export(
    file: Path,
    *,
    to: str,
    output: Path | None = None,
    force: bool = False,
    columns: str | None = None,
    json: bool = False,
) -> None:
    """Write a recording or a log as CSV, Parquet, npz or mat, in full precision.

    Args:
        file: A recording, or any log that tvist log analyze reads.
        to: csv, parquet, npz or mat. A vector becomes columns NAME_0, NAME_1, ... in CSV and Parquet, and one array in
            npz and mat. Units, events and info go along; those of a CSV into FILE.csv-metadata.json.
        output: File to write [FILE with its ending replaced, such as run.csv for run.mcap].
        force: Replace an existing file.
        columns: Names of a CSV's columns if they are not RTDE's, with {} for the number of a joint or axis, and a unit
            after a colon: time=t:ms,q=joint_{}:deg,accelerometer=acc_{}:g. Also qd, pose, target_q, target_qd.
        json: Print one JSON object.
    """
    from tvist_lab.recordings import RecordingError, read
    from tvist_lab.recordings.export import FORMATS, written_by
    from tvist_lab.recordings.export import export as write

    kind = lower(to)
    if kind not in FORMATS:
        raise Failure(f"to is {to!r}: must be one of {', '.join(FORMATS)}", code=2)
    path = output or file.with_name(file.name.removesuffix(".gz")).with_suffix(f".{kind}")
    for place in written_by(path, kind):
        if place.exists() and file.exists() and place.samefile(file):
            raise Failure(f"{place} is the file to be exported: choose another one with --output", code=2)
        if place.exists() and not force:
            raise Failure(f"{place} exists already: give --force to replace it, or --output")
    with told(RecordingError):
        recording = read(file, columns)
        write(recording, path, kind)
    for note in recording.notes:
        say(f"{file}: {note}")
    written = written_by(path, kind)
    if json:
        print_json(
            {"file": str(file), "written": [str(place) for place in written], "rows": len(recording),
             "columns": list(recording.columns), "notes": list(recording.notes)}
        )  # fmt: skip
    else:
        say(
            f"{len(recording)} rows of {len(recording.columns)} columns are in {', '.join(map(str, written))}"
        )
