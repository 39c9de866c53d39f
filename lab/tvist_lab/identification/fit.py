"""Fit of two multivariate polynomials to measured (f_d, ζ)."""

import math
from dataclasses import dataclass

import numpy as np

from tvist_lab.recordings import Floats
from tvist_protocol.calibration import PolynomialModel, Spread
from tvist_shaping import terms

FOLDS = 10
"""Number of parts that the measurements are divided into for cross-validation."""


class FitError(ValueError):
    """The measurements are not sufficient for a model; the message says what to do."""


@dataclass(frozen=True)
class Fit:
    """A model and its deviations from the measurements."""

    model: PolynomialModel
    residual_f_d: Spread
    residual_zeta: Spread
    cross_validated_f_d: Spread
    """Deviation of each measurement from a fit that did not include it."""
    cross_validated_zeta: Spread
    unseen_f_d: Floats
    """f_d that fits without a measurement give for it, shape (N,) [Hz]."""
    unseen_zeta: Floats
    """ζ that fits without a measurement give for it, shape (N,) [-]."""


def check_count(configurations: int, joints: tuple[int, ...], degree: int) -> None:
    """Check that there are enough configurations, before or after they are measured.

    Raises:
        FitError: There are fewer than one and a half times as many as coefficients.
    """
    size = terms(np.zeros((1, max(joints) + 1)), joints=joints, degree=degree).shape[1]
    needed = math.ceil(1.5 * size)
    if configurations < needed:
        raise FitError(
            f"{configurations} usable configurations for {size} coefficients: at least {needed} are needed; "
            "measure more configurations or lower the degree"
        )


def fit_polynomials(
    q: Floats, f_d: Floats, zeta: Floats, weights: Floats, *, joints: tuple[int, ...], degree: int
) -> Fit:
    """Fit the relative deviation by weighted least squares.

    Args:
        q: Configurations, shape (N, n) [rad].
        f_d: Measured damped frequencies, shape (N,) [Hz].
        zeta: Measured damping ratios, shape (N,) [-].
        weights: Weight of each sample, shape (N,) [-].
        joints: Joints that the modes depend on.
        degree: Highest total degree.

    Raises:
        FitError: There are fewer than one and a half times as many measurements as coefficients.
    """
    check_count(len(q), joints, degree)
    design = terms(q, joints=joints, degree=degree)
    count = len(design)
    coefficients = [_solve(design, y, weights) for y in (f_d, zeta)]
    fold = np.arange(count) % FOLDS
    unseen = np.empty((2, count))
    for part in range(FOLDS):
        seen = fold != part
        for row, y in zip(unseen, (f_d, zeta), strict=True):
            row[~seen] = design[~seen] @ _solve(design[seen], y[seen], weights[seen])
    model = PolynomialModel(
        joints=joints,
        degree=degree,
        f_d_coefficients=tuple(coefficients[0].tolist()),
        zeta_coefficients=tuple(coefficients[1].tolist()),
        f_d_range=(0.7 * float(f_d.min()), 1.25 * float(f_d.max())),
        zeta_range=(0.3 * float(zeta.min()), min(1.4 * float(zeta.max()), 0.95)),
    )
    return Fit(
        model=model,
        residual_f_d=spread(design @ coefficients[0], f_d),
        residual_zeta=spread(design @ coefficients[1], zeta),
        cross_validated_f_d=spread(unseen[0], f_d),
        cross_validated_zeta=spread(unseen[1], zeta),
        unseen_f_d=unseen[0],
        unseen_zeta=unseen[1],
    )


def spread(estimated: Floats, true: Floats) -> Spread:
    """Median and 90th percentile of the relative deviation [%]."""
    median, p90 = np.percentile(100.0 * np.abs(estimated / true - 1.0), (50, 90))
    return Spread(median=float(median), p90=float(p90))


def _solve(design: Floats, y: Floats, weights: Floats) -> Floats:
    scale = np.sqrt(weights) / y
    solution, *_ = np.linalg.lstsq(design * scale[:, None], y * scale)
    return np.asarray(solution)
