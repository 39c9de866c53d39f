"""`tvist log analyze`: measure the motions of a recording or log, or compare two."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, Misuse
from tvist_cli.figure_files import DEFAULT_FIGURES, FigureOptions, Save, write
from tvist_cli.log_options import AS_IT_IS, LogOptions
from tvist_cli.output import number, out, print_json, print_lines, progress, say, table, words

if TYPE_CHECKING:
    from tvist_lab.metrics import ComparedMotion, MotionRows
    from tvist_lab.recordings import Recording

OF_TWO = (
    "motion of A", "of B", "RV m/s²: A", "B", "change", "peak m/s²: A", "B", "change", "still after ms: A", "B",
    "change", "f_d Hz: A", "B",
)  # fmt: skip
"""Column heads of the table that compares two files."""
COMPARED = (
    ("residual_vibration_m_s2", 2, "residual_vibration"), ("peak_m_s2", 2, "peak"),
    ("still_after_ms", 0, "still_after"), ("f_d_hz", 2, ""),
)  # fmt: skip
"""Fields of the comparison: name, number of decimals, and name of the field with the change."""


def analyze(
    *files: Path,
    figures: Path | None = None,
    look: FigureOptions = DEFAULT_FIGURES,
    logs: LogOptions = AS_IT_IS,
    json: bool = False,
) -> None:
    """Show what a recording or log contains and measure each motion, with the columns of the paper's Table 2.

    Frequency and damping have 95 % intervals. A line below the table explains each dash. If the payload, the
    gears or the ringing changed during the log, a line gives the first motion with the new value.

    If the log is of an accelerometer alone, it has no motions: its ring-downs, or a frequency sweep, are measured.

    Two files with the same motions, such as unshaped and shaped, are compared. Motions correspond if they start and
    end at the same joint angles within 0.02 rad. Motions that only one file contains are listed but not compared.

    Args:
        files: Read this recording of `tvist serve --record`, `tvist log record` or `tvist log export`, or
            this log of another robot: CSV with RTDE's names, a dump of UR's port 30003, a rosbag2 in MCAP.
            Give two to compare them; the formats may differ. A folder, or a quoted pattern such as
            'run-1-part*.mcap', names the files of one recording that was made with --keep.
        figures: Write figures of each motion to this folder: the recorded signals and the ring-down.
        look: How to write the figures.
        logs: How to read logs.
        json: Print one JSON object.
    """
    look.check(figures)
    if len(files) not in (1, 2):
        raise Misuse(
            f"analyze needs one recording or log, or two to compare, not {len(files)}: tvist log analyze run.mcap"
        )
    if len(files) == 2 and figures is not None:
        raise Misuse("--figures is for one file: leave it out")
    if len(files) == 2:
        _compare(*files, logs, json=json)
        return
    from tvist_lab.metrics import NotMeasurableError
    from tvist_lab.recordings import RecordingError
    from tvist_lab.summary import summary

    (file,) = files
    (recording,) = logs.read(file, sensor=True)
    about = summary(file, recording)
    if not json:
        out.print(about["file"])
        words(_facts(about))
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
    """Measure all motions; return the content for --json, or print it as a table."""
    from tvist_lab.metrics import (
        COLUMNS,
        MeasuredRecording,
        changes,
        grouped_notes,
        measure,
        motion_cells,
        motions,
    )
    from tvist_lab.phrases import counted

    found, results = motions(recording), []
    with progress(len(found), "motions") as bar:
        for motion in found:
            results.append(measure(recording, motion))
            bar()
    if figures is not None:
        with look.into(figures) as save:
            _draw(recording, found, save)
    changed = changes(MeasuredRecording(recording, found, results))
    if not results and not json:
        out.print("It contains no motion.")
    elif not json:
        origin = recording.origin
        since = f", times from {origin:.3f} s on" if origin else ""
        title = f"{counted(len(results), 'motion')}{since}"
        table(title, tuple(COLUMNS), motion_cells(results, origin))
        for note in (*changed, *grouped_notes(results)):
            out.print(note)
    return {"motions": [result.as_dict() for result in results], "changes": changed}


def _sensor_alone(recording: "Recording", *, json: bool) -> dict[str, Any]:
    """Measure frequency and damping in a log without joint angles; return or print them like `_motions`."""
    from tvist_lab.metrics.columns import number as cell
    from tvist_lab.metrics.sensor_alone import free_vibrations

    found = free_vibrations(recording)
    rows = [
        (
            one.kind, cell(one.start_s - recording.origin, 3), cell(one.f_d_hz, 2, one.f_d_interval_hz),
            cell(one.zeta, 3, one.zeta_interval),
        )
        for one in found
    ]  # fmt: skip
    if not json:
        names = ("vibration", "start s", "frequency f_d Hz", "damping ζ")
        table("an accelerometer alone, no joint angles", names, rows)
    return {"motions": [], "free_vibrations": [asdict(one) for one in found]}


def _draw(recording: "Recording", found: "list[MotionRows]", save: Save) -> None:
    """Write the figures of each motion, except those for which the log lacks a signal."""
    from tvist_lab.figures import motion_figure, ring_down_figure
    from tvist_lab.metrics import NotMeasurableError

    own: dict[str, Any] = {} if recording.foreign else {"motion": motion_figure}
    kinds = own | {"ring_down": ring_down_figure}
    for index, motion in enumerate(found, 1):
        for kind, figure_of in kinds.items():
            try:
                write(save, {f"{kind}_{index}": figure_of(f"motion {index}", (recording, motion))})
            except NotMeasurableError as error:
                say(f"motion {index}: no figure {kind}: {error}")


def _facts(found: dict[str, Any]) -> dict[str, str]:
    missing, size, facts = found["missing_ticks"], found["bytes"], {}
    if found["robot"] is not None:
        facts["robot"] = found["robot"] + (f", a {found['model']}" if found["model"] else "")
    if found["version"] is not None:
        facts["recorded by"] = f"tvist {found['version']}"
    facts["time"] = f"{found['duration_s']:.3f} s from {found['start_s']:.3f} s on"
    facts["rows"] = f"{found['rows']}, {missing or 'no'} tick{'' if missing == 1 else 's'} missing"
    if found["complete"] is not None:
        facts["closed"] = "yes" if found["complete"] else "no: cut off or damaged"
        lack = "does not contain the robot's commands"
        if found["from_tick"] is not None:
            lack = f"has forgotten all before tick {found['from_tick']}"
        facts["replay"] = "yes" if found["replayable"] else f"no: it {lack}"
        facts["messages"] = ", ".join(f"{count} {kind}" for kind, count in found["messages"].items())
    facts["events"] = ", ".join(f"{count} {kind}" for kind, count in found["events"].items()) or "none"
    facts["size"] = f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.1f} kB"
    facts["columns"] = ", ".join(map(_column, found["columns"]))
    return facts


def _column(column: dict[str, Any]) -> str:
    _, *shape = column["shape"]
    words = (column["name"], " × ".join(map(str, shape)), column["unit"] and f"[{column['unit']}]")
    return " ".join(filter(None, words))


def _compare(a: Path, b: Path, logs: LogOptions, *, json: bool) -> None:
    from tvist_lab.metrics import MeasuredRecording
    from tvist_lab.metrics import compare as compared

    first, second = logs.read(a, b)
    result = compared(MeasuredRecording.of(first), MeasuredRecording.of(second))
    for file, recording in ((a, first), (b, second)):
        for note in recording.notes:
            say(f"{file}: {note}")
    told = {
        "a": str(a), "b": str(b), "motions": [motion.as_dict() for motion in result.motions],
        "only_in_a": list(result.only_in_a), "only_in_b": list(result.only_in_b),
        "notes": {"a": list(first.notes), "b": list(second.notes)},
    }  # fmt: skip
    if result.motions and not json:
        table(f"A = {a}, B = {b}", OF_TWO, [_row(motion) for motion in result.motions])
    lines = [] if result.motions else ["No motion of A starts and ends where one of B does."]
    for name, numbers in (("A", result.only_in_a), ("B", result.only_in_b)):
        if numbers:
            lines.append(f"only in {name}, not compared: motion {', '.join(map(str, numbers))}")
    print_lines(told, lines, json=json)


def _row(motion: "ComparedMotion") -> tuple[str, ...]:
    from tvist_lab.metrics.columns import percent

    cells = [str(motion.a), str(motion.b)]
    for field, digits, impact in COMPARED:
        cells += [number(getattr(one, field), digits) for one in (motion.first, motion.second)]
        if impact:
            cells.append(percent(motion.impact_percent[impact]))
    return tuple(cells)
