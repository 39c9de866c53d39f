"""Find contradicting ring-downs, cross-validate a fit, and predict modes with their uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tvist_lab.identification.modal_fit import (
    MODES,
    ModalFit,
    OwnPoles,
    describe,
    fit_modal,
    lowest_poles,
    own_poles_near,
)
from tvist_lab.identification.ring_downs import IdentificationError, RingDownData
from tvist_lab.identification.unknowns import Z_95, ArmModes
from tvist_lab.recordings import Floats

DIFFERENCE_STEP = 1e-3  # step of a logarithm for finite differences [-]
MIN_ERRORS = (0.015, 0.06)
"""Smallest assumed errors of f_d and ζ [-]: joints that share a parameter differ; friction and gears are nonlinear."""
FEWEST = 6  # smallest number of modes in left-out ring-downs with which intervals can be checked
CONTRADICTION = 0.2  # `OwnPoles.share` of a ring-down from which it contradicts the others [-]
SIGNIFICANT = 60.0  # least `OwnPoles.significance` of a contradiction [-]
SUSPECTS = 3  # number of the worst explained ring-downs, of which each is left out in turn
GUILTY = 3  # if more than one ring-down in this number is wrong, the wrong ones cannot be determined
SINGLY = 14  # largest number of configurations that are left out one by one
FOLDS = 10  # number of parts into which more configurations are divided


@dataclass(frozen=True)
class LeftOut:
    """A ring-down, and the modes at its configuration from a fit without it."""

    ring_down: RingDownData
    f_d: Floats  # shape (k,) [Hz]
    zeta: Floats  # shape (k,) [-]
    own: OwnPoles  # the same modes fitted to the ring-down alone


@dataclass(frozen=True)
class ForecastModes:
    """Modes at a configuration, each an array with one entry per mode, the lowest first."""

    f_d: Floats  # damped frequencies [Hz]
    zeta: Floats  # damping ratios [-]
    f_d_error: Floats  # standard deviation of the logarithm of f_d [-]
    zeta_error: Floats  # standard deviation of the logarithm of ζ [-]

    @property
    def f_d_percent(self) -> Floats:
        """Half-width of the 95 % interval of f_d [%]."""
        return 100.0 * Z_95 * self.f_d_error


@dataclass(frozen=True)
class ModeForecast:
    """Fitted springs and drives with their uncertainty."""

    arm: ArmModes
    fit: ModalFit
    covariance: Floats  # covariance of the parameters' logarithms due to noise and model errors, shape (P, P)
    moved: Floats  # shift of these logarithms by the deviation of each mass, shape (P, masses)
    wider: tuple[float, float] = (1.0, 1.0)
    """Factors on the errors of f_d and ζ, at least 1, found from ring-downs left out of fits [-]."""

    def at(self, q: Floats, payload: int, modes: int = 1) -> ForecastModes:
        """Return the lowest modes at a configuration with one of the payloads."""
        # An error of the masses shifts the modes, but it also shifted the fitted parameters; both effects
        # mostly cancel.
        arm, here, mass = self.arm, self.fit.logarithms, self.arm.mass(q, payload)

        def logarithms(parameters: Floats, mass: Floats) -> Floats:
            return np.log(describe(lowest_poles(arm.drivetrain(parameters), mass)[:modes]))

        found = logarithms(here, mass)
        steps = DIFFERENCE_STEP * np.eye(len(here))
        slopes = np.array([(logarithms(here + step, mass) - found) / DIFFERENCE_STEP for step in steps])
        heavier = np.array([logarithms(here, other) - found for other in arm.heavier(q, payload)])
        by_mass = heavier + np.einsum("pm,pvk->mvk", self.moved, slopes)
        variance = np.einsum("pvk,pr,rvk->vk", slopes, self.covariance, slopes) + np.sum(by_mass**2, axis=0)
        errors = np.sqrt(variance + np.square(MIN_ERRORS)[:, None]) * np.array(self.wider)[:, None]
        return ForecastModes(*np.exp(found), *errors)

    def widened(self, left: Sequence[LeftOut]) -> "ModeForecast":
        """Return a forecast with errors enlarged, if necessary, to those at ring-downs left out of fits."""
        squares: list[tuple[float, float]] = []
        for one in left:
            known = self.at(one.ring_down.q, one.ring_down.payload, MODES)
            for k in (k for k in one.own.certain if k < len(known.f_d)):
                f_d = np.log(one.f_d[k] / one.own.f_d[k]) ** 2
                zeta = np.log(one.zeta[k] / one.own.zeta[k]) ** 2
                squares.append(
                    (
                        f_d / (known.f_d_error[k] ** 2 + one.own.f_d_error[k] ** 2),
                        zeta / (known.zeta_error[k] ** 2 + one.own.zeta_error[k] ** 2),
                    )
                )
        if len(squares) < FEWEST:
            return self
        f_d, zeta = np.sqrt(np.mean(squares, axis=0)).tolist()
        return replace(self, wider=(max(f_d, 1.0), max(zeta, 1.0)))


def contradicting(arm: ArmModes, ring_downs: Sequence[RingDownData]) -> list[int]:
    """Find ring-downs that no springs and drives can explain together with the others."""
    # A wrong ring-down also spoils the fit of the others. So leave out each of the worst explained ones in
    # turn, remove the one without which the fit is best, and repeat until the rest agree.
    fit = fit_modal(arm, ring_downs)
    rest = list(range(len(ring_downs)))
    guilty: list[int] = []
    while len(guilty) <= len(ring_downs) // GUILTY:
        explained = {number: own_poles_near(arm, ring_downs[number], fit) for number in rest}
        worst = sorted(rest, key=lambda number: -explained[number].share)[:SUSPECTS]
        if all(own.share < CONTRADICTION or own.significance < SIGNIFICANT for own in explained.values()):
            return sorted(guilty)
        without = {
            number: fit_modal(arm, [ring_downs[other] for other in rest if other != number], fit.logarithms)
            for number in worst
        }
        removed = min(worst, key=lambda number: without[number].cost)
        guilty.append(removed)
        rest.remove(removed)
        fit = without[removed]
    raise IdentificationError(
        f"the {len(ring_downs)} ring-downs contradict each other: no springs and drives explain them together. Was "
        "the payload the declared one each time, is the robot the one of the file, and did nothing shake it?"
    )


def cross_validate(
    arm: ArmModes, ring_downs: Sequence[RingDownData], fit: ModalFit
) -> tuple[list[LeftOut], Floats]:
    """Fit without each configuration in turn; if there are many, without each of `FOLDS` parts of them.

    Also return the jackknife covariance of the parameters' logarithms, shape (P, P), which includes model
    errors as well as noise.
    """
    places = {place: number for number, place in enumerate(dict.fromkeys(r.q.tobytes() for r in ring_downs))}
    folds = len(places) if len(places) <= SINGLY else FOLDS
    logarithms, left = [], []
    for fold in range(folds):
        out = [r for r in ring_downs if places[r.q.tobytes()] % folds == fold]
        others = [r for r in ring_downs if places[r.q.tobytes()] % folds != fold]
        unseen = fit_modal(arm, others, fit.logarithms)
        logarithms.append(unseen.logarithms)
        for ring_down in out:
            poles = lowest_poles(unseen.drivetrain, arm.mass(ring_down.q, ring_down.payload))
            left.append(LeftOut(ring_down, *describe(poles), own_poles_near(arm, ring_down, unseen)))
    apart = np.array(logarithms) - np.mean(logarithms, axis=0)
    return left, (folds - 1) / folds * apart.T @ apart
