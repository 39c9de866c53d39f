"""The paper's figures, drawn from recordings and from the shaping library."""

from tvist_lab.figures.after_stop import after_stop_figure
from tvist_lab.figures.catalogue import catalogue_figure
from tvist_lab.figures.convolution import figure_3
from tvist_lab.figures.delay_filter import figure_8
from tvist_lab.figures.discretisation import figure_7
from tvist_lab.figures.elastic import elastic_figure
from tvist_lab.figures.evaluated import residual_by_move_figure, vibration_figure
from tvist_lab.figures.files import FORMATS, FigureFiles, save
from tvist_lab.figures.flexibility import figure_1
from tvist_lab.figures.frequency_error import sensitivity_figure, settling_against_delay_figure
from tvist_lab.figures.identified import identified_figure
from tvist_lab.figures.mean_delay import mean_delay_figure
from tvist_lab.figures.one_joint import figure_2
from tvist_lab.figures.pareto import pareto_figure, settling_figure
from tvist_lab.figures.path_shaping import corner_figure, path_shaping_figure
from tvist_lab.figures.recorded import Recorded, motion_figure, observed_figure
from tvist_lab.figures.residual import figure_16
from tvist_lab.figures.ring_down import ring_down_figure
from tvist_lab.figures.robustness import robustness_figure
from tvist_lab.figures.sensitivity import figure_4
from tvist_lab.figures.settling_times import figure_15
from tvist_lab.figures.study import study_figure
from tvist_lab.figures.sweep import sweep_figure
from tvist_lab.figures.workspace_map import workspace_map_figure

__all__ = [
    "FORMATS",
    "FigureFiles",
    "Recorded",
    "after_stop_figure",
    "catalogue_figure",
    "corner_figure",
    "elastic_figure",
    "figure_1",
    "figure_2",
    "figure_3",
    "figure_4",
    "figure_7",
    "figure_8",
    "figure_15",
    "figure_16",
    "identified_figure",
    "mean_delay_figure",
    "motion_figure",
    "observed_figure",
    "pareto_figure",
    "path_shaping_figure",
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
