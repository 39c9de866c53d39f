"""The paper's figures from our runs."""

from pathlib import Path

from tvist_lab.figures import figure_2, figure_4, figure_7, figure_16, motion_figure, save
from tvist_lab.metrics import motions
from tvist_lab.one_joint.lesson import lesson
from tvist_lab.paper.experiment import Experiment
from tvist_lab.paper.published import MOTIONS

NUMBERS = {"Q1-Q2": 12, "Q1-Q3": 13, "Q3-Q1": 14}


def draw(done: Experiment, folder: Path, *, all_figures: bool) -> list[Path]:
    """Write figures 12 to 14 and 16, and 2, 4 and 7 too where all are wanted; the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    pairs = {}
    for motion in MOTIONS:
        recordings = [done.first[motion, kind] for kind in ("unshaped", "shaped")]
        unshaped, shaped = ((recording, motions(recording)[0]) for recording in recordings)
        pairs[motion] = (unshaped, shaped)
    figures = {f"figure_{NUMBERS[name]}": motion_figure(name, *pair) for name, pair in pairs.items()}
    figures["figure_16"] = figure_16(pairs)
    if all_figures:
        figures |= {"figure_02": figure_2(lesson()), "figure_04": figure_4(), "figure_07": figure_7()}
    return [save(figure, folder / f"{name}.png") for name, figure in sorted(figures.items())]
