"""The paper's figures, drawn from recordings and from the shaping library."""

from tvist_lab.figures.after_stop import after_stop_figure
from tvist_lab.figures.catalogue import catalogue_figure
from tvist_lab.figures.discretisation import figure_7
from tvist_lab.figures.elastic import elastic_figure
from tvist_lab.figures.evaluated import residual_by_move_figure, vibration_figure
from tvist_lab.figures.identified import identified_figure
from tvist_lab.figures.mean_delay import mean_delay_figure
from tvist_lab.figures.one_joint import figure_2
from tvist_lab.figures.pareto import pareto_figure
from tvist_lab.figures.path_shaping import corner_figure, path_shaping_figure
from tvist_lab.figures.recorded import Recorded, motion_figure, observed_figure
from tvist_lab.figures.residual import figure_16
from tvist_lab.figures.robustness import robustness_figure
from tvist_lab.figures.sensitivity import figure_4
from tvist_lab.figures.style import save
from tvist_lab.figures.sweep import sweep_figure

__all__ = [
    "Recorded",
    "after_stop_figure",
    "catalogue_figure",
    "corner_figure",
    "elastic_figure",
    "figure_2",
    "figure_4",
    "figure_7",
    "figure_16",
    "identified_figure",
    "mean_delay_figure",
    "motion_figure",
    "observed_figure",
    "pareto_figure",
    "path_shaping_figure",
    "residual_by_move_figure",
    "robustness_figure",
    "save",
    "sweep_figure",
    "vibration_figure",
]
