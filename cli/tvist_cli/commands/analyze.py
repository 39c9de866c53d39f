"""`tvist analyze`: measure the motions of a recording."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import told
from tvist_cli.figure_files import AS_USUAL, FigureOptions, write
from tvist_cli.output import number, out, print_json, say, table

if TYPE_CHECKING:
    from tvist_lab.metrics import MotionResult

COLUMNS = (
    "motion", "start s", "stop s", "delay ms", "stabil. ms", "cycle ms", "overshoot m", "RV m/s²", "still after ms",
    "f_d Hz", "ζ",
)  # fmt: skip


def analyze(
    file: Path,
    *,
    figures: Path | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Measure each motion of a recording and print the columns of the paper's Table 2.

    Args:
        file: MCAP file that `tvist serve --record` or `tvist record` wrote.
        figures: Folder for two figures of each motion: what was recorded, and the ring-down after it.
        look: How to write the figures.
        json: Print one JSON object.
    """
    look.check(figures)
    from tvist_lab.metrics import NotMeasurableError, measure, motions
    from tvist_lab.recordings import RecordingError
    from tvist_lab.recordings.mcap_file import read

    with told(RecordingError):
        content = read(file)
    recording = content.recording
    found = motions(recording)
    results = [measure(recording, motion) for motion in found]
    if content.note:
        say(f"{file}: {content.note}")
    if figures is not None:
        from tvist_lab.figures import observed_figure, ring_down_figure

        files = look.into(figures)
        for index, motion in enumerate(found, 1):
            name, recorded = f"motion {index}", (recording, motion)
            write(files, {f"motion_{index}": observed_figure(name, recorded)})
            with suppress(NotMeasurableError):
                write(files, {f"ring_down_{index}": ring_down_figure(name, recorded)})
    if json:
        print_json(
            {"file": str(file), "motions": [result.as_dict() for result in results], "note": content.note}
        )
        return
    table(f"{file}: {len(results)} motions", COLUMNS, [_row(index, r) for index, r in enumerate(results, 1)])
    for index, result in enumerate(results, 1):
        for name, note in result.notes.items():
            out.print(f"motion {index}, {name}: {note}")


def _row(index: int, result: "MotionResult") -> tuple[str, ...]:
    overshoot = result.overshoot_m
    return (
        str(index),
        number(result.start_s),
        number(result.stop_s),
        number(result.delay_ms, 1),
        number(result.stabilisation_ms, 1),
        number(result.cycle_ms, 1),
        "–" if overshoot is None else f"{overshoot:.1e}",
        number(result.residual_vibration_m_s2),
        number(result.still_after_ms, 0),
        number(result.f_d_hz, 2),
        number(result.zeta),
    )
