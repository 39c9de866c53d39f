"""Two recordings of the same motions side by side."""

from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import told
from tvist_cli.log_options import LogOptions
from tvist_cli.output import number, out, print_json, say, table

if TYPE_CHECKING:
    from tvist_lab.metrics import ComparedMotion

COLUMNS = (
    "motion of A", "of B", "RV m/s²: A", "B", "change", "peak m/s²: A", "B", "change", "still after ms: A", "B",
    "change", "f_d Hz: A", "B",
)  # fmt: skip


def compare(a: Path, b: Path, logs: LogOptions, *, json: bool) -> None:
    """Print what changed between two recordings or logs, motion by motion; see `tvist log analyze`."""
    from tvist_lab.metrics import Measured
    from tvist_lab.metrics import compare as compared
    from tvist_lab.recordings import RecordingError

    first, second = logs.read(a, b)
    with told(RecordingError):
        result = compared(Measured.of(first), Measured.of(second))
    for file, recording in ((a, first), (b, second)):
        for note in recording.notes:
            say(f"{file}: {note}")
    if json:
        print_json(
            {
                "a": str(a),
                "b": str(b),
                "motions": [motion.as_dict() for motion in result.motions],
                "only_in_a": list(result.only_in_a),
                "only_in_b": list(result.only_in_b),
                "notes": {"a": list(first.notes), "b": list(second.notes)},
            }
        )
        return
    if result.motions:
        table(f"A = {a}, B = {b}", COLUMNS, [_row(motion) for motion in result.motions])
    else:
        out.print("No motion of A starts and ends where one of B does.")
    for name, numbers in (("A", result.only_in_a), ("B", result.only_in_b)):
        if numbers:
            out.print(f"only in {name}, not compared: motion {', '.join(map(str, numbers))}")


def _row(motion: "ComparedMotion") -> tuple[str, ...]:
    first, second, change = motion.first, motion.second, motion.impact_percent
    return (
        str(motion.a),
        str(motion.b),
        number(first.residual_vibration_m_s2, 2),
        number(second.residual_vibration_m_s2, 2),
        _percent(change["residual_vibration"]),
        number(first.peak_m_s2, 2),
        number(second.peak_m_s2, 2),
        _percent(change["peak"]),
        number(first.still_after_ms, 0),
        number(second.still_after_ms, 0),
        _percent(change["still_after"]),
        number(first.f_d_hz, 2),
        number(second.f_d_hz, 2),
    )


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{round(value):+d} %"
