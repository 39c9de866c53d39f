"""`tvist log analyze`: what a recording or a robot's log holds, and what its motions measure; two are compared."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure
from tvist_cli.figure_files import AS_USUAL, FigureOptions, Save, write
from tvist_cli.log_comparison import compare
from tvist_cli.log_facts import show_facts
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.output import out, print_json, progress, say, table

if TYPE_CHECKING:
    from tvist_lab.metrics import MotionRows
    from tvist_lab.recordings import Recording


def analyze(
    *files: Path,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    logs: LogOptions = AS_IT_IS,
    json: bool = False,
) -> None:
    """Say what a recording or a robot's log holds, and measure each motion, with the columns of the paper's Table 2.

    Frequency and damping have 95 % intervals. A dash has its reason in a line below the table. A line says from which
    motion on payload, gears or what rings after stops are not what they were before.

    A log of an accelerometer alone has no motions: its ring-downs, or a sweep of frequencies, are measured.

    Two files of the same motions, as without and with shaping, are compared. Motions correspond if they start and end
    at the same joint angles within 0.02 rad. Those that only one file contains are listed, and not compared.

    Args:
        files: Recording of `tvist serve --record`, `tvist log record` or `tvist log export`; or a log of another robot:
            CSV with RTDE's names, a dump of UR's port 30003, a rosbag2 in MCAP. Two are compared; their formats may
            differ. A folder, or a pattern in quotes such as 'run-1-part*.mcap', names the files of one recording that
            were made with --keep.
        figures: Folder for the figures of each motion: what was recorded, and the ring-down after it.
        look: How to write the figures.
        logs: How to read logs.
        json: Print one JSON object.
    """
    look.check(figures)
    if len(files) not in (1, 2):
        why = f"analyze needs one recording or log, or two to compare, not {len(files)}: tvist log analyze run.mcap"
        raise Failure(why, code=2)
    if len(files) == 2:
        if figures is not None:
            raise Failure("--figures is for one file: leave it out", code=2)
        compare(*files, logs, json=json)
        return
    from tvist_lab.metrics import NotMeasurableError
    from tvist_lab.recordings import RecordingError
    from tvist_lab.summary import summary

    (file,) = files
    (recording,) = logs.read(file, sensor=True)
    about = summary(file, recording)
    if not json:
        show_facts(about)
    for note in recording.notes:
        say(f"{file}: {note}")
    try:
        if "actual_q" not in recording and "target_q" not in recording:
            measured = _sensor_alone(recording, json=json)
        else:
            measured = _motions(recording, figures, look, json=json)
    except (RecordingError, NotMeasurableError) as error:
        if json:
            print_json({**about, "motions": []})
        raise Failure(f"{file}: {error}") from error
    if json:
        print_json({**about, **measured})


def _motions(
    recording: "Recording", figures: Path | None, look: FigureOptions, *, json: bool
) -> dict[str, Any]:
    """Measure all motions, and print them as a table, or return what --json says of them."""
    from tvist_lab.metrics import COLUMNS, Measured, changes, grouped_notes, measure, motion_cells, motions
    from tvist_lab.words import counted

    found, results = motions(recording), []
    with progress(len(found), "motions") as bar:
        for motion in found:
            results.append(measure(recording, motion))
            bar(1, None)
    if figures is not None:
        with look.into(figures) as save:
            _draw(recording, found, save)
    changed = changes(Measured(recording, found, results))
    if json:
        return {"motions": [result.as_dict() for result in results], "changes": changed}
    if not results:
        out.print("It contains no motion.")
        return {}
    origin = recording.origin
    since = f", times from {origin:.3f} s on" if origin else ""
    rows = [[cell.replace("\n", " ") for cell in row] for row in motion_cells(results, origin)]
    table(f"{counted(len(results), 'motion')}{since}", tuple(COLUMNS), rows)
    for note in (*changed, *grouped_notes(results)):
        out.print(note, markup=False)
    return {}


def _sensor_alone(recording: "Recording", *, json: bool) -> dict[str, Any]:
    """Measure frequency and damping in a log that has no joint angles; see `_motions`."""
    from tvist_lab.metrics.columns import number
    from tvist_lab.metrics.sensor_alone import free_vibrations

    found = free_vibrations(recording)
    if json:
        return {"motions": [], "free_vibrations": [asdict(one) for one in found]}
    rows = [
        [cell.replace("\n", " ") for cell in (
            one.kind, number(one.start_s - recording.origin, 3), number(one.f_d_hz, 2, one.f_d_interval_hz),
            number(one.zeta, 3, one.zeta_interval),
        )]
        for one in found
    ]  # fmt: skip
    names = ("vibration", "start s", "frequency f_d Hz", "damping ζ")
    table("an accelerometer alone, no joint angles", names, rows)
    return {}


def _draw(recording: "Recording", found: "list[MotionRows]", save: Save) -> None:
    """Write the figures of each motion; what a log does not contain has none."""
    from tvist_lab.figures import motion_figure, ring_down_figure
    from tvist_lab.metrics import NotMeasurableError

    kinds: dict[str, Any] = {"ring_down": ring_down_figure}
    if not recording.foreign:
        kinds = {"motion": motion_figure, **kinds}
    for index, motion in enumerate(found, 1):
        for kind, figure_of in kinds.items():
            try:
                write(save, {f"{kind}_{index}": figure_of(f"motion {index}", (recording, motion))})
            except NotMeasurableError as error:
                say(f"motion {index}: no figure {kind}: {error}")
