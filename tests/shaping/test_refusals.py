"""What is out of range is refused with the name of its parameter."""

from functools import partial
from math import inf, nan

import numpy as np
import pytest

import tvist_shaping as shaping

MODE = shaping.Fixed([7.0], [0.1])
TWO = shaping.Drivetrain((9e3, 9e3), (0.3, 0.3), (150.0, 150.0), (15.0, 15.0))
ONES = (1.0, 1.0)
HUMPS = [((0, 0.05), "humps"), ((11, 0.05), "humps"), *(((1, V), "V") for V in (0.0, 0.9, nan))]


def polynomial(**changes):
    row, wide = [0.5, *[0.0] * 24], {"f_d_range": (1e-3, 1e3), "zeta_range": (0.0, 0.99)}
    values = {"joints": (1, 2, 3), "degree": 2, "f_d_coefficients": row, "zeta_coefficients": row} | wide
    return shaping.Polynomial(**(values | changes))


def modal(**changes):
    return shaping.Modal(lambda x: np.diag([1.0 + x[0], 2.0]), TWO, **({"modes": 2} | changes))


def tvist(**changes):
    return shaping.TvistFilter(shaping.shaper("zv"), MODE, **({"joints": 1} | changes))


def steady(*, modes=1, joints=1):
    return shaping.SteadyFilter(shaping.ProductDesign(0.05, modes=modes), MODE, joints=joints)


def fade(**changes):
    limits = {"velocity": 1.5, "acceleration": 2.0, "jerk": 100.0}
    return shaping.Fade(tvist(), tvist(), **(limits | changes))


def fir_shaper(**changes):
    values = {"name": "mine", "description": "", "function": shaping.zv, "taps": 20}
    return shaping.FirShaper(**(values | changes))


def own(**changes):
    values = {"name": "mine", "description": "", "function": shaping.zv, "duration_periods": 0.5}
    return shaping.check_shaper(shaping.Shaper(**(values | changes)))


BY_NAME = {  # the last name of a row is the one that the refusal gives
    polynomial: (shaping.EstimatorError, [
        {"joints": ()}, {"joints": (1, 1)}, {"joints": (-1,)}, {"joints": (7,)}, {"degree": -1},
        {"degree": 1.5}, {"degree": 10**9}, {"degree": 30}, {"centre": [0.0]},
        {"centre": [0.0, nan, 0.0]}, {"f_d_coefficients": [10.0]},
        {"zeta_coefficients": [nan] * 25}, {"f_d_range": (6.0,)}, {"f_d_range": (15.0, 6.0)},
        {"f_d_range": (0.0, 6.0)}, {"f_d_range": (6.0, inf)}, {"zeta_range": (-0.1, 0.3)},
        {"zeta_range": (0.1, 1.0)},
    ]),
    modal: (shaping.EstimatorError, [
        {"modes": 0}, {"modes": 3}, {"f_d_min": 0.0}, {"f_d_min": nan}, {"zeta_max": 1.0},
        {"zeta_max": nan},
    ]),
    tvist: (shaping.FilterError, [{"joints": 0}, {"period": 0.0}, {"period": nan}, {"max_delay": inf}]),
    steady: (shaping.FilterError, [{"modes": 2}, {"joints": 0}]),
    fade: (shaping.FilterError, [{"velocity": 0.0}, {"acceleration": nan}, {"jerk": inf}]),
    shaping.ShortDesign: (shaping.FilterError, [{"mean_delay": 0.045}]),
    partial(shaping.ProductDesign, 0.05): (shaping.FilterError, [
        {"modes": 0}, {"modes": 7}, {"longest": inf}, {"period": 0.0},
    ]),
    shaping.FirDesign: (shaping.FilterError, [
        {"weight": (1.0,)}, {"residual": (0.05, 0.05, 0.05)},
        {"residual": (), "weight": (), "spread": ()}, {"spread": (-0.1, 0.0, 0.0, 0.0)},
        {"weight": (1.0, 1.0, 1.0, nan)}, {"residual": (0.0, 0.05, 0.05, 0.05)}, {"shortest": 0.2},
        {"shortest": 0.01},
    ]),
    fir_shaper: (shaping.DesignError, [{"taps": 0}, {"taps": 501}, {"modes": 0}, {"peak": 0.5}, {"period": 0.0}]),
    own: (shaping.DesignError, [
        {"duration_periods": "0.5"}, {"duration_periods": nan}, {"zeta_max": 1.5}, {"zeta_max": 0},
        {"peak": 0.5},
    ]),
}  # fmt: skip
BY_PLACE = {
    shaping.Fixed: (shaping.EstimatorError, [
        (([], []), "f_d"), ((7.0, 0.1), "f_d"), (([0.0], [0.1]), "f_d"), (([nan], [0.1]), "f_d"),
        (([inf], [0.1]), "f_d"), (([7.0], [0.1, 0.1]), "zeta"), (([7.0], [-0.1]), "zeta"),
        (([7.0], [1.0]), "zeta"), (([7.0], [nan]), "zeta"),
    ]),
    shaping.flexible_joint: (shaping.EstimatorError, [
        ((0.0, 1.0, 0.0), "inertia"), ((nan, 1.0, 0.0), "inertia"), ((1.0, -1.0, 0.0), "stiffness"),
        ((1.0, inf, 0.0), "stiffness"), ((1.0, 1.0, -0.1), "damping"), ((1.0, 1.0, 2.0), "damping"),
    ]),
    shaping.FlexibleJoint: (shaping.EstimatorError, [((lambda _: 0.2, (0.5, 0.1), 420.0, 1.05), "inertia_range")]),
    shaping.Drivetrain: (shaping.EstimatorError, [
        (((1.0, 0.0), ONES, ONES, ONES), "stiffness"),
        ((ONES, (1.0,), ONES, ONES), "rotor_inertia"),
        ((ONES, (0.0, 0.0), ONES, ONES), "rotor_inertia"),
        ((ONES, ONES, (1.0, -1.0), ONES), "velocity_gain"),
        ((ONES, ONES, ONES, (1.0, inf)), "position_gain"),
        ((ONES, ONES, ONES, ONES, (nan, 0.0)), "damping"), (((), (), (), ()), "stiffness"),
    ]),
    shaping.ProductDesign: (shaping.FilterError, [
        ((0.0,), "mean_delay"), ((0.3,), "mean_delay"), ((nan,), "mean_delay"),
    ]),
    shaping.ei_of: (shaping.DesignError, HUMPS),
    partial(shaping.ei_of, exact=True): (shaping.DesignError, HUMPS),
    shaping.mzv_of: (shaping.DesignError, [
        ((2, 0.5), "n"), ((3, 1.0), "t"), ((3, 1.2), "t"), ((4, 1.5), "t"), ((3, 0.0), "t"),
        ((3, -1.0), "t"), ((3, nan), "t"),
    ]),
    shaping.si_of: (shaping.DesignError, [
        ((0.0,), "low"), ((1.1,), "low"), ((nan,), "low"), ((0.75, 0.9), "high"),
        ((0.75, inf), "high"), ((0.75, 1.25, 0.0), "V"), ((0.75, 1.25, 0.6), "V"),
        ((0.1, 3.0), "band"),
    ]),
}  # fmt: skip
CASES = [
    *((partial(make, **row), error, [*row][-1]) for make, (error, rows) in BY_NAME.items() for row in rows),
    *((partial(make, *row), error, field) for make, (error, rows) in BY_PLACE.items() for row, field in rows),
]


@pytest.mark.parametrize(("make", "error", "field"), CASES)
def test_invalid_argument_is_refused_by_its_name(make, error, field):
    with pytest.raises(error, match=rf"^{field} is .*: must be ") as refused:
        make()
    assert refused.value.field == field
