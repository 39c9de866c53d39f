"""Time-varying input shaping: a filter that takes the vibration out of a reference, on line."""

from tvist_shaping.catalogue import SHAPERS, shaper
from tvist_shaping.delay_line import DelayLine
from tvist_shaping.errors import (
    ConvergenceError,
    DelayError,
    DesignError,
    EstimatorError,
    FilterError,
    ImpulseError,
    ShaperRangeError,
    ShapingError,
    UnknownShaperError,
)
from tvist_shaping.estimators import Estimator, Fixed, Polynomial, terms
from tvist_shaping.exact import ei2_exact, ei3_exact, ei_exact
from tvist_shaping.fade import Fade
from tvist_shaping.filter import TvistFilter
from tvist_shaping.impulses import Impulses, ei, ei2, ei3, mzv, none, product, zv, zvd, zvdd, zvddd
from tvist_shaping.makers import custom, ei_of, mzv_of, si_of
from tvist_shaping.sensitivity import band, residual
from tvist_shaping.shaper import Shaper
from tvist_shaping.unity import um_zv, um_zvd

__all__ = [
    "SHAPERS",
    "ConvergenceError",
    "DelayError",
    "DelayLine",
    "DesignError",
    "Estimator",
    "EstimatorError",
    "Fade",
    "FilterError",
    "Fixed",
    "ImpulseError",
    "Impulses",
    "Polynomial",
    "Shaper",
    "ShaperRangeError",
    "ShapingError",
    "TvistFilter",
    "UnknownShaperError",
    "band",
    "custom",
    "ei",
    "ei2",
    "ei2_exact",
    "ei3",
    "ei3_exact",
    "ei_exact",
    "ei_of",
    "mzv",
    "mzv_of",
    "none",
    "product",
    "residual",
    "shaper",
    "si_of",
    "terms",
    "um_zv",
    "um_zvd",
    "zv",
    "zvd",
    "zvdd",
    "zvddd",
]
