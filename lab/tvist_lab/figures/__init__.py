"""The paper's figures, drawn from recordings and from the shaping library."""

from tvist_lab.figures.after_stop import (
    ComparedPanel,
    after_stop_figure,
    compared_figure,
    ring_down_figure,
    vibration_figure,
)
from tvist_lab.figures.calibration import identified_figure, move_plan_figure, workspace_map_figure
from tvist_lab.figures.flexibility import figure_1, figure_2
from tvist_lab.figures.one_filter import figure_3, figure_7, figure_8
from tvist_lab.figures.recorded import Recorded, figure_15, figure_16, motion_figure
from tvist_lab.figures.sheets import StyleError, house_settings, house_style, save
from tvist_lab.figures.studies import (
    pareto_figure,
    residual_by_move_figure,
    robustness_figure,
    settling_figure,
    study_figure,
    sweep_figure,
)
from tvist_lab.figures.wrong_frequency import (
    catalogue_figure,
    figure_4,
    sensitivity_figure,
    settling_against_delay_figure,
)

__all__ = [
    "ComparedPanel",
    "Recorded",
    "StyleError",
    "after_stop_figure",
    "catalogue_figure",
    "compared_figure",
    "figure_1",
    "figure_2",
    "figure_3",
    "figure_4",
    "figure_7",
    "figure_8",
    "figure_15",
    "figure_16",
    "house_settings",
    "house_style",
    "identified_figure",
    "motion_figure",
    "move_plan_figure",
    "pareto_figure",
    "residual_by_move_figure",
    "ring_down_figure",
    "robustness_figure",
    "save",
    "sensitivity_figure",
    "settling_against_delay_figure",
    "settling_figure",
    "study_figure",
    "sweep_figure",
    "vibration_figure",
    "workspace_map_figure",
]
