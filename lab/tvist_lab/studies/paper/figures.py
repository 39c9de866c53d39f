"""The paper's figures, drawn from new runs, the robot file and the shaping library."""

from matplotlib.figure import Figure

from tvist_lab.figures.after_stop import after_stop_figure, ring_down_figure
from tvist_lab.figures.flexibility import figure_1, figure_2
from tvist_lab.figures.one_filter import figure_3, figure_7, figure_8
from tvist_lab.figures.recorded import Recorded, figure_15, figure_16, motion_figure
from tvist_lab.figures.wrong_frequency import figure_4
from tvist_lab.metrics import motions
from tvist_lab.one_joint import pluck_all
from tvist_lab.studies.paper.experiment import Experiment
from tvist_lab.studies.paper.published import MOTIONS

NUMBERS = {"Q1-Q2": 12, "Q1-Q3": 13, "Q3-Q1": 14}
DEFINED_ON = "Q1-Q2"  # motion of figure 15 and of the spectrogram


def draw(done: Experiment, *, all_figures: bool) -> dict[str, Figure]:
    """Draw figures 12 to 16, or also 1 to 4, 7, 8 and the spectrogram; return them by file name without suffix."""
    pairs = {motion: _pair(done, motion) for motion in MOTIONS}
    figures = {f"figure_{NUMBERS[name]}": motion_figure(name, *pair) for name, pair in pairs.items()}
    figures |= {"figure_15": figure_15(DEFINED_ON, *pairs[DEFINED_ON]), "figure_16": figure_16(pairs)}
    if all_figures:
        figures |= {"figure_02": figure_2(pluck_all())}
        makers = {1: figure_1, 3: figure_3, 4: figure_4, 7: figure_7, 8: figure_8}
        figures |= {f"figure_{number:02}": make() for number, make in makers.items()}
        figures |= {"ring_down": ring_down_figure(DEFINED_ON, pairs[DEFINED_ON][0])}
    return dict(sorted(figures.items()))


def overview(done: Experiment, motion: str) -> Figure:
    """Draw the tool's acceleration after one motion, without and with shaping."""
    return after_stop_figure(*_pair(done, motion), motion)


def _pair(done: Experiment, motion: str) -> tuple[Recorded, Recorded]:
    """Return the first recording of a motion without and with shaping."""
    unshaped, shaped = (done.first[motion, kind] for kind in ("unshaped", "shaped"))
    return (unshaped, motions(unshaped)[0]), (shaped, motions(shaped)[0])
