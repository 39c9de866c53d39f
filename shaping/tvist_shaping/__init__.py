"""Time-varying input shaping: a filter that removes vibration from a reference in real time."""

from tvist_shaping.base import Filter
from tvist_shaping.catalogue import SHAPERS, shaper
from tvist_shaping.delay_line import DelayLine
from tvist_shaping.errors import (
    ConvergenceError,
    DelayError,
    DesignError,
    EstimatorError,
    FilterError,
    ImpulseError,
    ParameterError,
    ShaperFailureError,
    ShaperRangeError,
    ShapingError,
    UnknownShaperError,
)
from tvist_shaping.estimators import (
    Drivetrain,
    Estimator,
    Fixed,
    FlexibleJoint,
    Modal,
    Polynomial,
    flexible_joint,
    terms,
)
from tvist_shaping.exact import ei2_exact, ei3_exact, ei_exact
from tvist_shaping.fade import Fade
from tvist_shaping.filter import TvistFilter
from tvist_shaping.fir import FirDesign
from tvist_shaping.fir_shaper import FirShaper
from tvist_shaping.impulse_train import Impulses, product
from tvist_shaping.impulses import ei, ei2, ei3, mzv, none, zv, zvd, zvdd, zvddd
from tvist_shaping.makers import custom, ei_of, mzv_of, si_of
from tvist_shaping.named import BUILT_IN, DESIGNS, Registry, make_filter
from tvist_shaping.own import check_shaper, shaper_of
from tvist_shaping.sensitivity import band, residual
from tvist_shaping.shaper import Shaper
from tvist_shaping.steady import AimedFilter, Design, ProductDesign, ShortDesign, SteadyFilter
from tvist_shaping.unity import um_zv, um_zvd

__all__ = [
    "BUILT_IN", "DESIGNS", "SHAPERS", "AimedFilter", "ConvergenceError", "DelayError", "DelayLine", "Design",
    "DesignError", "Drivetrain", "Estimator", "EstimatorError", "Fade", "Filter", "FilterError", "FirDesign",
    "FirShaper", "Fixed", "FlexibleJoint", "ImpulseError", "Impulses", "Modal", "ParameterError",
    "Polynomial", "ProductDesign", "Registry", "Shaper", "ShaperFailureError", "ShaperRangeError",
    "ShapingError", "ShortDesign", "SteadyFilter", "TvistFilter", "UnknownShaperError", "band",
    "check_shaper", "custom", "ei", "ei2", "ei2_exact", "ei3", "ei3_exact", "ei_exact", "ei_of",
    "flexible_joint", "make_filter", "mzv", "mzv_of", "none", "product", "residual", "shaper", "shaper_of",
    "si_of", "terms", "um_zv", "um_zvd", "zv", "zvd", "zvdd", "zvddd",
]  # fmt: skip
