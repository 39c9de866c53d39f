"""Fit the paper's two polynomials of the lowest mode (section 3.3) to ring-downs with one payload."""

import math
from collections.abc import Sequence

import numpy as np

from tvist_lab.identification.modal_fit import ModalFit, own_poles_near
from tvist_lab.identification.ring_downs import RingDownData
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.recordings import Floats
from tvist_protocol.calibration import PolynomialModel, Spread
from tvist_shaping import terms

FOLDS = 10
DEGREES = (4, 3, 2)  # degree of the polynomials in one, two or three joints
ROUGH = 10.0  # largest error at nine of ten left-out ring-downs with which a polynomial is kept [%]


class FitError(ValueError):
    """The measurements do not suffice for a model; the message tells why."""


Deviations = dict[str, Spread]
"""Model deviations from measurements [%], by `Provenance` field; some from fits without the measurement."""


def polynomials(
    arm: ArmModes, ring_downs: Sequence[RingDownData], springs: ModalFit
) -> tuple[PolynomialModel, Deviations]:
    """Fit polynomials to the lowest mode of each ring-down, separated from higher modes by springs and drives.

    Raises FitError if the ring-downs are too few, or cover too little of the workspace.
    """
    changing = tuple(joint for joint in (1, 2, 3) if joint < arm.description.joints) or (0,)
    degree = DEGREES[len(changing) - 1]
    _check_count(len(ring_downs), changing, degree)
    own = [(ring_down.q, own_poles_near(arm, ring_down, springs)) for ring_down in ring_downs]
    kept = [(q, poles.f_d[0], poles.zeta[0]) for q, poles in own if 0 in poles.certain]
    _check_count(len(kept), changing, degree)
    q, f_d, zeta = (np.array(column) for column in zip(*kept, strict=True))
    model, deviations = fit_polynomials(q, f_d, zeta, joints=changing, degree=degree)
    if (error := deviations["cross_validated_f_d_percent"].p90) > ROUGH:
        raise FitError(
            f"f_d would be off by {error:.0f} % and more at one stop in ten: they cover too "
            "little of the workspace"
        )
    return model, deviations


def _check_count(configurations: int, joints: tuple[int, ...], degree: int) -> None:
    """Raise FitError if there are fewer than one and a half times as many configurations as coefficients."""
    size = terms(np.zeros((1, max(joints) + 1)), joints=joints, degree=degree).shape[1]
    needed = math.ceil(1.5 * size)
    if configurations < needed:
        raise FitError(
            f"{configurations} ring-downs are too few for {size} coefficients: at least {needed} are needed"
        )


def fit_polynomials(
    q: Floats, f_d: Floats, zeta: Floats, *, joints: tuple[int, ...], degree: int
) -> tuple[PolynomialModel, Deviations]:
    """Fit f_d [Hz] and ζ [-], each of shape (N,), at q, shape (N, n) [rad], by relative deviation."""
    design = terms(q, joints=joints, degree=degree)
    fold, coefficients, deviations = np.arange(len(design)) % FOLDS, [], Deviations()
    for name, y in (("f_d", f_d), ("zeta", zeta)):
        unseen = np.empty(len(design))
        for part in range(FOLDS):
            seen = fold != part
            unseen[~seen] = design[~seen] @ _solve(design[seen], y[seen])
        coefficients.append(_solve(design, y))
        deviations[f"residual_{name}_percent"] = spread(design @ coefficients[-1], y)
        deviations[f"cross_validated_{name}_percent"] = spread(unseen, y)
    model = PolynomialModel(
        joints=joints,
        degree=degree,
        f_d_coefficients=tuple(coefficients[0].tolist()),
        zeta_coefficients=tuple(coefficients[1].tolist()),
        f_d_range=(0.7 * float(f_d.min()), 1.25 * float(f_d.max())),
        zeta_range=(0.3 * float(zeta.min()), min(1.4 * float(zeta.max()), 0.95)),
    )
    return model, deviations


def spread(estimated: Floats, true: Floats) -> Spread:
    """Return median and 90th percentile of the relative deviation [%]."""
    median, p90 = np.percentile(100.0 * np.abs(estimated / true - 1.0), (50, 90))
    return Spread(median=float(median), p90=float(p90))


def _solve(design: Floats, y: Floats) -> Floats:
    """Return the coefficients with the least sum of squared relative deviations."""
    return np.asarray(np.linalg.lstsq(design / y[:, None], np.ones_like(y))[0])
