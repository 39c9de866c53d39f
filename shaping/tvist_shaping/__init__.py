"""Time-varying input shaping: a filter that takes the vibration out of a reference, on line."""

from tvist_shaping.catalogue import SHAPERS, Shaper, shaper
from tvist_shaping.delay_line import DelayLine
from tvist_shaping.errors import (
    DelayError,
    EstimatorError,
    FilterError,
    ImpulseError,
    ShaperRangeError,
    ShapingError,
    UnknownShaperError,
)
from tvist_shaping.estimators import Estimator, Fixed, Polynomial, terms
from tvist_shaping.fade import Fade
from tvist_shaping.filter import TvistFilter
from tvist_shaping.impulses import Impulses, ei, ei2, ei3, mzv, none, product, zv, zvd
from tvist_shaping.sensitivity import band, residual

__all__ = [
    "SHAPERS",
    "DelayError",
    "DelayLine",
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
    "ei",
    "ei2",
    "ei3",
    "mzv",
    "none",
    "product",
    "residual",
    "shaper",
    "terms",
    "zv",
    "zvd",
]
