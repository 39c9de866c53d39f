"""`tvist log analyze`: measure the motions of a recording or of a robot's log."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.output import out, print_json, progress, say, table

if TYPE_CHECKING:
    from tvist_lab.figures import FigureFiles
    from tvist_lab.metrics import MotionRows
    from tvist_lab.recordings import Recording


def analyze(
    file: Path,
    *,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    logs: LogOptions = AS_IT_IS,
    json: bool = False,
) -> None:
    """Measure each motion of a recording or a robot's log, and print the columns of the paper's Table 2.

    Frequency and damping have 95 % intervals. A dash has its reason in a line below the table. A line says from which
    motion on payload, gears or what rings after stops are not what they were before.

    A log of an accelerometer alone has no motions: its ring-downs, or a sweep of frequencies, are measured.

    Args:
        file: Recording of `tvist serve --record`, `tvist log record` or `tvist log export`; or a log of another robot:
            CSV with RTDE's names, a dump of UR's port 30003, a rosbag2 in MCAP.
        figures: Folder for the figures of each motion: what was recorded, and the ring-down after it.
        look: How to write the figures.
        logs: How to read logs.
        json: Print one JSON object.
    """
    look.check(figures)
    from tvist_lab.metrics import COLUMNS, Measured, changes, grouped_notes, measure, motion_cells, motions
    from tvist_lab.recordings import RecordingError
    from tvist_lab.words import counted

    (recording,) = logs.read(file, sensor=True)
    if "actual_q" not in recording and "target_q" not in recording:
        _sensor_alone(file, recording, json=json)
        return
    with told(RecordingError):
        found = motions(recording)
    results = []
    with progress(len(found), "motions") as bar:
        for motion in found:
            results.append(measure(recording, motion))
            bar(1, None)
    for note in recording.notes:
        say(f"{file}: {note}")
    if figures is not None:
        _draw(recording, found, look.into(figures))
    changed = changes(Measured(recording, found, results))
    if json:
        print_json(
            {
                "file": str(file),
                "motions": [result.as_dict() for result in results],
                "changes": changed,
                "notes": list(recording.notes),
            }
        )
        return
    if not results:
        out.print(f"{file} contains no motion.", markup=False)
        return
    origin = recording.origin
    since = f", times from {origin:.3f} s on" if origin else ""
    rows = [[cell.replace("\n", " ") for cell in row] for row in motion_cells(results, origin)]
    table(f"{file}: {counted(len(results), 'motion')}{since}", tuple(COLUMNS), rows)
    for note in (*changed, *grouped_notes(results)):
        out.print(note, markup=False)


def _sensor_alone(file: Path, recording: "Recording", *, json: bool) -> None:
    """Print frequency and damping from a log that has no joint angles."""
    from tvist_lab.metrics import NotMeasurableError
    from tvist_lab.metrics.columns import number
    from tvist_lab.metrics.sensor_alone import free_vibrations

    with told(NotMeasurableError):
        found = free_vibrations(recording)
    if json:
        vibrations, notes = [asdict(one) for one in found], list(recording.notes)
        print_json({"file": str(file), "motions": [], "free_vibrations": vibrations, "notes": notes})
        return
    for note in recording.notes:
        say(f"{file}: {note}")
    rows = [
        [cell.replace("\n", " ") for cell in (
            one.kind, number(one.start_s - recording.origin, 3), number(one.f_d_hz, 2, one.f_d_interval_hz),
            number(one.zeta, 3, one.zeta_interval),
        )]
        for one in found
    ]  # fmt: skip
    names = ("vibration", "start s", "frequency f_d Hz", "damping ζ")
    table(f"{file}: an accelerometer alone, no joint angles", names, rows)


def _draw(recording: "Recording", found: "list[MotionRows]", files: "FigureFiles") -> None:
    """Write the figures of each motion; what a log does not contain has none."""
    from tvist_lab.figures import observed_figure, ring_down_figure
    from tvist_lab.metrics import NotMeasurableError

    kinds = {"ring_down": ring_down_figure}
    if not recording.foreign:
        kinds = {"motion": observed_figure, **kinds}
    for index, motion in enumerate(found, 1):
        for kind, figure_of in kinds.items():
            try:
                write(files, {f"{kind}_{index}": figure_of(f"motion {index}", (recording, motion))})
            except NotMeasurableError as error:
                say(f"motion {index}: no figure {kind}: {error}")
