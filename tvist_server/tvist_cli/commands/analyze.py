"""`tvist analyze`: measure the motions of a recording."""

from pathlib import Path

from tvist_cli.failure import told
from tvist_cli.output import err, number, out, print_json, table


def analyze(file: Path, *, figures: Path | None = None, json: bool = False) -> None:
    """Print Table 2's columns for each motion in a recording.

    Args:
        file: MCAP file that `tvist serve --record` or `tvist record` wrote.
        figures: Folder for a figure of each motion.
        json: Print one JSON object.
    """
    from tvist_lab.figures import observed_figure, save
    from tvist_lab.mcap_file import read
    from tvist_lab.metrics import measure, motions
    from tvist_lab.recordings import RecordingError

    with told(RecordingError):
        content = read(file)
    recording = content.recording
    found = motions(recording)
    results = [measure(recording, motion) for motion in found]
    if content.note:
        err.print(f"{file}: {content.note}")
    if figures is not None:
        figures.mkdir(parents=True, exist_ok=True)
        for index, motion in enumerate(found, 1):
            err.print(str(save(observed_figure(f"motion {index}", (recording, motion)), figures / f"motion_{index}.png")))
    if json:
        print_json({"file": str(file), "motions": [result.as_dict() for result in results], "note": content.note})
        return
    table(
        f"{file}: {len(results)} motions",
        ("motion", "start s", "stop s", "delay ms", "stabil. ms", "cycle ms", "overshoot m", "RV m/s²", "still after ms", "f_d Hz", "ζ"),
        [
            (
                str(index),
                number(r.start_s), number(r.stop_s), number(r.delay_ms, 1), number(r.stabilisation_ms, 1),
                number(r.cycle_ms, 1), "–" if r.overshoot_m is None else f"{r.overshoot_m:.1e}",
                number(r.residual_vibration_m_s2), number(r.still_after_ms, 0), number(r.f_d_hz, 2), number(r.zeta),
            )
            for index, r in enumerate(results, 1)
        ],
    )  # fmt: skip
    for index, result in enumerate(results, 1):
        for name, note in result.notes.items():
            out.print(f"motion {index}, {name}: {note}")
