"""Predict modes and their uncertainty at any configuration from fitted springs and drives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tvist_lab.identification.modal_fit import MODES, ModalFit, OwnPoles, describe
from tvist_lab.identification.ring_downs import Ringing
from tvist_lab.identification.unknowns import Z_95, ArmModes
from tvist_lab.recordings import Floats

DIFFERENCE_STEP = 1e-3  # step of a logarithm for finite differences [-]
MIN_ERRORS = (0.015, 0.06)
"""Smallest assumed errors of f_d and ζ [-]: joints that share a parameter differ; friction and gears are nonlinear."""
FEWEST = 6  # number of modes in left-out ring-downs needed to check the intervals


@dataclass(frozen=True)
class LeftOut:
    """A ring-down, and the modes at its configuration from a fit without it."""

    ringing: Ringing
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
        # An error of the masses shifts the modes, but it also shifted the fitted parameters, which mostly
        # compensates.
        arm, here = self.arm, self.fit.logarithms
        mass = arm.mass(q, payload)
        modes = min(modes, MODES)

        def logarithms(parameters: Floats, mass: Floats) -> Floats:
            return np.log(describe(arm.drivetrain(parameters).poles(mass)[0][:modes]))

        found = logarithms(here, mass)
        slopes = np.array(
            [
                (logarithms(here + step, mass) - found) / DIFFERENCE_STEP
                for step in DIFFERENCE_STEP * np.eye(len(here))
            ]
        )
        heavier = np.array([logarithms(here, other) - found for other in arm.heavier(q, payload)])
        by_mass = heavier + np.einsum("pm,pvk->mvk", self.moved, slopes)
        variance = np.einsum("pvk,pr,rvk->vk", slopes, self.covariance, slopes) + np.sum(by_mass**2, axis=0)
        errors = np.sqrt(variance + np.square(MIN_ERRORS)[:, None]) * np.array(self.wider)[:, None]
        return ForecastModes(*np.exp(found), *errors)

    def widened(self, left: Sequence[LeftOut]) -> "ModeForecast":
        """Return the same with errors as large as those found at ring-downs left out of fits."""
        squares: list[tuple[float, float]] = []
        for one in left:
            known = self.at(one.ringing.q, one.ringing.payload, MODES)
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
