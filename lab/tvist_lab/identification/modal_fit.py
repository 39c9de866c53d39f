"""Estimate springs and drives from a few ring-downs, by separable least squares.

Each ring-down is a sum of the lowest modes, whose poles depend on the parameters, with its own amplitudes:

    α(t) = Σ_k Re(c_k e^(s_k(p) t)) + d e^(-rt) + g,  p the logarithms of the parameters

The vectors c, d, g enter linearly and are eliminated (variable projection; Golub and Pereyra, 1973), so modes
need not be detected in a signal or matched with the model's. Weak priors hold parameters that the data do not
determine near their guesses.

If gears have hysteresis, poles change with the tool's amplitude A: a small loop of twist and torque consists
of two parabolas (Rayleigh's law), so stiffness falls by a share h A, and the damping ratio rises by 2/(3π) of
that. The fitted poles are those of small vibrations, with s(t) = s - (2/(3π) + j/2) h A(t) |s|.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import least_squares

from tvist_lab.identification.ring_downs import RingDownData
from tvist_lab.identification.unknowns import FURTHEST, ArmModes
from tvist_lab.metrics import SLOW_POLE
from tvist_lab.recordings import Floats
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.poles import follow

Complex = npt.NDArray[np.complex128]

MODES = 4  # number of modes in a ring-down; a robot arm's higher modes decay within a few ticks
RAYLEIGH = 2.0 / (3.0 * np.pi) + 0.5j
"""Change of damping ratio (real) and frequency (imaginary) per relative stiffness loss by hysteresis [-]."""
SMOOTHED = 0.03  # width of the window in which the amplitude is determined [s]
DIFFERENCE_STEP = 1e-4  # step of a logarithm for finite differences [-]
INSIDE = 1e-3  # distance of a starting point from the bounds of the search [-]
EVALUATIONS = 60
SOFTENINGS = (0.0, 50.0, 100.0, 200.0, 300.0)
"""Softening by hysteresis to try [1/m]: 200 is 3 % for an amplitude of 1 m/s² at 13 Hz."""
LOOSE = 0.5  # prior deviation of the logarithms of a ring-down's own f_d and ζ from their start [-]
CERTAIN = (0.05, 0.2)  # largest errors of f_d and ζ fitted to a ring-down alone that may judge a model [-]
STARTS = 4  # number of starting points of the search; the first one is the guess
SPREAD = 0.35  # standard deviation of the other starting points about the guess [-]


@dataclass(frozen=True)
class ModalFit:
    """Parameters and their accuracy."""

    logarithms: Floats  # logarithms of the parameters, shape (P,)
    covariance: Floats  # covariance of the logarithms, shape (P, P)
    residual_to_noise: Floats  # rms of each ring-down's residual relative to its noise, shape (N,) [-]
    cost: float  # half the sum of squares, including that of the guess [-]
    drivetrain: Drivetrain

    @property
    def deviations(self) -> Floats:
        """Standard deviations of the logarithms, shape (P,)."""
        return np.sqrt(np.diag(self.covariance))


class _Signal:
    """One ring-down with its mass matrix; amplitudes are eliminated by projection."""

    def __init__(self, arm: ArmModes, ring_down: RingDownData) -> None:
        self.mass, self.force = arm.mass(ring_down.q, ring_down.payload), ring_down.force
        self.noise = float(np.hypot(ring_down.noise, ring_down.inexact))
        self.time = ring_down.time
        moved = cumulative_trapezoid(_amplitude(ring_down, self.time), self.time, initial=0.0)
        self._lost = ring_down.softening * moved
        still = np.exp(np.outer(self.time, np.array(ring_down.driven, dtype=complex)))
        self._always = np.column_stack(
            [np.exp(-SLOW_POLE * self.time), np.ones(len(self.force)), still.real, still.imag]
        )

    def _columns(self, poles: Complex) -> Floats:
        waves = np.exp(np.outer(self.time, poles) - np.outer(self._lost, RAYLEIGH / np.abs(poles)))
        return np.column_stack([waves.real, waves.imag, self._always])

    def amplitudes(self, poles: Complex) -> Floats:
        """Return the initial length of each mode's vector of amplitudes [m/s²]."""
        found = np.linalg.lstsq(self._columns(poles), self.force)[0][: 2 * len(poles)]
        return np.asarray(np.sqrt(np.sum(found.reshape(2, len(poles), -1) ** 2, axis=(0, 2))))

    def left(self, poles: Complex) -> Floats:
        """Return the residual of the signal for some poles, divided by its noise, flattened."""
        orthonormal, _ = np.linalg.qr(self._columns(poles))
        return np.asarray((self.force - orthonormal @ (orthonormal.T @ self.force)).ravel() / self.noise)

    def left_with(self, drivetrain: Drivetrain) -> Floats:
        """Return the residual for the lowest modes of springs and drives."""
        return self.left(lowest_poles(drivetrain, self.mass))

    def slopes(self, arm: ArmModes, logarithms: Floats) -> Floats:
        """Return the derivative of the residual by each parameter, shape (samples, P)."""
        poles, shapes = (part[:MODES] for part in arm.drivetrain(logarithms).poles(self.mass))
        here, columns, L = self.left(poles), [], len(self.mass)
        for step in DIFFERENCE_STEP * np.eye(len(logarithms)):
            drivetrain = arm.drivetrain(logarithms + step)
            moved, scratch = poles.copy(), np.zeros((L, L + 1), dtype=complex)
            if not follow(self.mass, drivetrain.rows, moved, shapes.copy(), scratch):
                moved = lowest_poles(drivetrain, self.mass)
            columns.append((self.left(moved) - here) / DIFFERENCE_STEP)
        return np.column_stack(columns)


def lowest_poles(drivetrain: Drivetrain, mass: Floats) -> Complex:
    """Return the poles of the modes that are fitted, the lowest first [1/s]."""
    return drivetrain.poles(mass)[0][:MODES]


def _amplitude(ring_down: RingDownData, time: Floats) -> Floats:
    """Return the amplitude of the tool's acceleration without the noise, shape (T,) [m/s²]."""
    swinging = np.sum((ring_down.force - ring_down.force.mean(axis=0)) ** 2, axis=1)
    width = SMOOTHED / float(np.median(np.diff(time)))
    power = gaussian_filter1d(swinging, width, mode="nearest") - 3.0 * ring_down.noise**2
    return np.asarray(np.sqrt(2.0 * np.maximum(power, 0.0)))


def fit_modal(arm: ArmModes, ring_downs: Sequence[RingDownData], start: Floats | None = None) -> ModalFit:
    """Estimate the parameters, starting from the guess or from `start`."""
    signals = [_Signal(arm, r) for r in ring_downs]

    def residual(logarithms: Floats) -> Floats:
        drivetrain = arm.drivetrain(logarithms)
        left = [signal.left_with(drivetrain) for signal in signals]
        return np.concatenate([*left, (logarithms - arm.guess) / arm.deviation])

    def jacobian(logarithms: Floats) -> Floats:
        changes = [signal.slopes(arm, logarithms) for signal in signals]
        return np.vstack([*changes, np.diag(1.0 / arm.deviation)])

    low, high = (arm.guess + side * FURTHEST * arm.deviation for side in (-1.0, 1.0))
    found = least_squares(
        residual,
        arm.guess if start is None else np.clip(start, low + INSIDE, high - INSIDE),
        jac=jacobian,
        bounds=(low, high),
        x_scale=0.1,
        xtol=1e-5,
        ftol=1e-6,
        max_nfev=EVALUATIONS,
    )
    samples = sum(signal.force.size for signal in signals)
    # The model error is not white noise, but the residual's size is the only estimate of it.
    excess = max(float(np.mean(found.fun[:samples] ** 2)), 1.0)
    changes = found.jac[:samples]
    knowledge = changes.T @ changes / excess + np.diag(arm.deviation**-2)
    drivetrain = arm.drivetrain(found.x)
    return ModalFit(
        logarithms=found.x,
        covariance=np.linalg.inv(knowledge),
        residual_to_noise=np.sqrt([np.mean(signal.left_with(drivetrain) ** 2) for signal in signals]),
        cost=float(found.cost),
        drivetrain=drivetrain,
    )


def fit_from_many(arm: ArmModes, ring_downs: Sequence[RingDownData]) -> ModalFit:
    """Return the best fit from several starting points."""
    # Parameters can compensate each other, so several sets may explain ring-downs equally well. A parameter
    # that differs between sets is uncertain: their spread, weighted by likelihood, adds to the deviations.
    rng = np.random.default_rng(0)
    starts = [arm.guess, *(arm.guess + rng.normal(0.0, SPREAD, (STARTS - 1, len(arm.guess))))]
    fits = [fit_modal(arm, ring_downs, start) for start in starts]
    best = min(fits, key=lambda fit: fit.cost)
    likely = np.array([np.exp(best.cost - fit.cost) for fit in fits])
    apart = np.array([fit.logarithms - best.logarithms for fit in fits])
    return replace(best, covariance=best.covariance + np.diag(np.max(likely[:, None] * apart**2, axis=0)))


def softened(arm: ArmModes, ring_downs: Sequence[RingDownData]) -> list[RingDownData]:
    """Return the ring-downs with `softening` set to the hysteresis that explains all of them best."""
    fits = {share: fit_modal(arm, [replace(r, softening=share) for r in ring_downs]) for share in SOFTENINGS}
    best = min(fits, key=lambda share: fits[share].cost + 0.5 * (share / SOFTENINGS[-1]) ** 2)
    return [replace(r, softening=best) for r in ring_downs]


def of_masses(arm: ArmModes, ring_downs: Sequence[RingDownData], fit: ModalFit) -> Floats:
    """Return the shift of the fitted logarithms if each mass deviates as assumed, shape (P, masses)."""
    # Masses are not fitted, since they are known better than a fit could find them. The shift is of first
    # order.
    signals = [_Signal(arm, r) for r in ring_downs]
    changes, heavier = [], []
    for signal, r in zip(signals, ring_downs, strict=True):
        changes.append(signal.slopes(arm, fit.logarithms))
        here, masses = signal.left_with(fit.drivetrain), arm.heavier(r.q, r.payload)
        others = [signal.left(lowest_poles(fit.drivetrain, mass)) - here for mass in masses]
        heavier.append(np.column_stack(others))
    change = np.vstack(changes)
    knowledge = change.T @ change + np.diag(arm.deviation**-2)
    return np.asarray(-np.linalg.solve(knowledge, change.T @ np.vstack(heavier)))


def information(arm: ArmModes, ring_down: RingDownData, logarithms: Floats) -> Floats:
    """Return a ring-down's information about the parameters: inverse of their covariance, shape (P, P)."""
    change = _Signal(arm, ring_down).slopes(arm, logarithms)
    return np.asarray(change.T @ change)


@dataclass(frozen=True)
class OwnPoles:
    """Modes fitted to one ring-down alone, their accuracy, and how much worse given poles explain it."""

    f_d: Floats  # damped frequencies, shape (k,) [Hz]
    zeta: Floats  # damping ratios, shape (k,) [-]
    f_d_error: Floats  # standard deviation of the logarithm of f_d, shape (k,) [-]
    zeta_error: Floats  # standard deviation of the logarithm of ζ, shape (k,) [-]
    amplitude: Floats  # largest initial |α| of each mode, shape (k,) [m/s²]
    significance: float
    """Increase of the residual's sum of squares with given poles, over noise variance [-]; 8 by chance."""
    share: float  # rms that these poles explain but the given ones do not, relative to the vibration [-]

    @property
    def certain(self) -> list[int]:
        """Indices of the modes that the ring-down alone determines accurately."""
        errors = zip(self.f_d_error, self.zeta_error, strict=True)
        return [k for k, (f_d, zeta) in enumerate(errors) if f_d < CERTAIN[0] and zeta < CERTAIN[1]]


def own_poles(arm: ArmModes, ring_down: RingDownData, poles: Complex) -> OwnPoles:
    """Fit poles to one ring-down alone, starting at given poles; springs and drives do not constrain them."""
    signal = _Signal(arm, ring_down)
    f_d, zeta = describe(poles)
    start = np.log(np.concatenate([f_d, np.clip(zeta, 1e-4, 0.95)]))

    def residual(logarithms: Floats) -> Floats:
        return np.concatenate([signal.left(_poles(logarithms)), (logarithms - start) / LOOSE])

    found = least_squares(residual, start, x_scale=0.1, max_nfev=EVALUATIONS)
    excess = max(float(np.mean(residual(found.x)[: -len(start)] ** 2)), 1.0)
    errors = np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)) * excess)
    f_d, zeta = np.exp(found.x.reshape(2, -1))
    f_d_error, zeta_error = errors.reshape(2, -1)
    others, own, nothing = (np.sum(signal.left(p) ** 2) for p in (poles, _poles(found.x), poles[:0]))
    significance = max(float(others - own), 0.0)
    return OwnPoles(
        f_d=f_d,
        zeta=zeta,
        f_d_error=f_d_error,
        zeta_error=zeta_error,
        amplitude=signal.amplitudes(_poles(found.x)),
        significance=significance,
        share=float(np.sqrt(significance / max(nothing - signal.force.size, 1.0))),
    )


def own_poles_near(arm: ArmModes, ring_down: RingDownData, fit: ModalFit) -> OwnPoles:
    """Fit poles to one ring-down alone, starting from those of fitted springs and drives."""
    return own_poles(arm, ring_down, lowest_poles(fit.drivetrain, arm.mass(ring_down.q, ring_down.payload)))


def describe(poles: Complex) -> tuple[Floats, Floats]:
    """Return f_d [Hz] and ζ [-] of poles."""
    return np.asarray(poles.imag / (2.0 * np.pi)), np.asarray(-poles.real / np.abs(poles))


def _poles(logarithms: Floats) -> Complex:
    f_d, zeta = np.exp(logarithms.reshape(2, -1))
    omega, zeta = 2.0 * np.pi * f_d, np.minimum(zeta, 0.99)
    return np.array(omega * (1j - zeta / np.sqrt(1.0 - zeta**2)))
