"""`tvist log export`: write a recording as CSV or Parquet, or for Foxglove."""

from pathlib import Path

from tvist_cli.failure import Misuse
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.misuse import lower
from tvist_cli.output import default_output, print_json, say


def export(
    file: Path, *, to: str, output: Path | None = None, logs: LogOptions = AS_IT_IS, json: bool = False
) -> None:
    """Write a recording or a log as CSV or Parquet, in full precision, or a recording for Foxglove.

    Args:
        file: Read this recording, or any log that tvist log analyze reads.
        to: Write csv, parquet or foxglove. A vector becomes columns NAME_0, NAME_1, ... Units, events and
            info are included; for CSV they go into FILE.csv-metadata.json. With foxglove, the recording gets
            channels for the 3D panel of Foxglove and Lichtblick, and a layout for both is written beside it.
        output: Write to this file and replace it if it exists [FILE with another ending, such as run.csv or
            run.foxglove.mcap for run.mcap, if there is none yet; with several segments, the first one's name].
        logs: How to read logs.
        json: Print one JSON object.
    """
    from tvist_lab.recordings import mcap_file
    from tvist_lab.recordings.export import FORMATS, FOXGLOVE, written_by
    from tvist_lab.recordings.export import export as write
    from tvist_lab.recordings.mcap_records import files_of

    kind = lower(to)
    if kind not in (*FORMATS, FOXGLOVE):
        raise Misuse(f"to is {to!r}: must be one of {', '.join((*FORMATS, FOXGLOVE))}")
    if kind == FOXGLOVE and logs != AS_IT_IS:
        raise Misuse("--columns and --imu are for logs: --to foxglove needs a recording")
    ending = f".{kind}.mcap" if kind == FOXGLOVE else f".{kind}"
    files = files_of(file)
    named = file if file.exists() else files[0]
    path = output or named.with_name(named.name.removesuffix(".gz")).with_suffix(ending)
    written = written_by(path, kind)
    for place in written:
        if place.exists() and any(one.exists() and place.samefile(one) for one in files):
            raise Misuse(f"{place} is the file to be exported: choose another one with --output")
        if output is None:
            default_output(place)
    if kind == FOXGLOVE:
        from tvist_lab.foxglove.export import export as draw

        content = mcap_file.read_checked(file)
        recording = content.recording.noted(*filter(None, [content.note]), *draw(content, path))
    else:
        (recording,) = logs.read(file)
        write(recording, path, kind)
    for note in recording.notes:
        say(f"{file}: {note.removeprefix(f'{file} ')}")
    if json:
        print_json(
            {"file": str(file), "written": [str(place) for place in written], "rows": len(recording),
             "columns": list(recording.columns), "notes": list(recording.notes)}
        )  # fmt: skip
    elif kind == FOXGLOVE:
        say(
            f"{len(recording)} ticks are in {path}: open it in Foxglove or Lichtblick, with the layout {written[1]}"
        )
    else:
        say(
            f"{len(recording)} rows of {len(recording.columns)} columns are in {', '.join(map(str, written))}"
        )
