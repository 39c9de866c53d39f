"""The paper's figures, drawn from our runs."""

from pathlib import Path

from tvist_lab.figures import (
    Recorded,
    after_stop_figure,
    figure_2,
    figure_4,
    figure_7,
    figure_16,
    motion_figure,
    save,
)
from tvist_lab.metrics import motions
from tvist_lab.one_joint.lesson import lesson
from tvist_lab.paper.experiment import Experiment
from tvist_lab.paper.published import MOTIONS

NUMBERS = {"Q1-Q2": 12, "Q1-Q3": 13, "Q3-Q1": 14}


def draw(done: Experiment, folder: Path, *, all_figures: bool) -> list[Path]:
    """Write figures 12 to 14 and 16, and on request also 2, 4 and 7; return the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    pairs = {motion: _pair(done, motion) for motion in MOTIONS}
    figures = {f"figure_{NUMBERS[name]}": motion_figure(name, *pair) for name, pair in pairs.items()}
    figures["figure_16"] = figure_16(pairs)
    if all_figures:
        figures |= {"figure_02": figure_2(lesson()), "figure_04": figure_4(), "figure_07": figure_7()}
    return [save(figure, folder / f"{name}.png") for name, figure in sorted(figures.items())]


def draw_overview(done: Experiment, motion: str, folder: Path) -> Path:
    """Write the tool's acceleration after one motion, without and with shaping; the file written."""
    figure = after_stop_figure(*_pair(done, motion), motion)
    return save(figure, folder / "vibration-with-and-without-shaping.png")


def _pair(done: Experiment, motion: str) -> tuple[Recorded, Recorded]:
    """The first recording of a motion without and with shaping."""
    unshaped, shaped = (done.first[motion, kind] for kind in ("unshaped", "shaped"))
    return (unshaped, motions(unshaped)[0]), (shaped, motions(shaped)[0])
