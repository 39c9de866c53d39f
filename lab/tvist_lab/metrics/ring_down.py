"""Fit (f_d, ζ) of the modes that vibrate after a stop, from the three axes of the tool's accelerometer."""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.optimize import least_squares

from tvist_lab.recordings import Floats

FREQUENCIES = (3.0, 45.0)  # range of damped frequencies; up to 0.45 of a slow rate [Hz]
DAMPING = (0.002, 0.7)  # range of damping ratios in the search [-]
SLOW_POLE = 17.5
"""Rate of the non-oscillatory tail that a position loop adds [1/s]."""
SKIP = 0.006  # ignored time after the stop, when the deceleration still ends [s]
WINDOW = 0.5  # duration of the first fit [s]
LEAST_R_SQUARED = 0.2
"""Smallest share of the signal's energy that a fit must explain [-]; a fit of pure noise explains a tenth."""
WINDOWS = (0.2, 1.0)  # shortest and longest duration of the final fit [s]
CERTAIN = 1.96  # half-width of a 95 % interval over its standard error [-]
SIGNIFICANT = 36.0  # gain of n ln SSE that noise exceeds in less than 1 % of fits [-]
CORRELATED = 0.02  # time over which the residual of a fit may be correlated [s]
MAX_CORRELATION = 0.97  # largest assumed correlation; beyond it, a residual is a drift [-]
COLOURS = 4  # order of the autoregression that describes the spectrum of a residual


@dataclass(frozen=True)
class Mode:
    """A damped sine."""

    f_d: float  # damped frequency [Hz]
    zeta: float  # damping ratio [-]
    amplitude: float  # largest |α| of the mode at the stop [m/s²]
    f_d_error: float  # standard error of f_d [Hz]
    zeta_error: float  # standard error of ζ [-]

    @property
    def f_d_interval(self) -> tuple[float, float]:
        """95 % interval of f_d [Hz]."""
        return _interval(self.f_d, self.f_d_error)

    @property
    def zeta_interval(self) -> tuple[float, float]:
        """95 % interval of ζ [-]."""
        return _interval(self.zeta, self.zeta_error)

    def amplitude_at(self, time: float) -> float:
        """Return the largest |α| of the mode some time after the stop [m/s²]."""
        return self.amplitude * math.exp(-decay_rate(self.f_d, self.zeta) * time)


@dataclass(frozen=True)
class RingDown(Mode):
    """The strongest mode of a ring-down; if `ok` is false, its values must not be used."""

    rms: float
    """rms of the residual of the fit, over all axes [m/s²]."""
    r_squared: float
    """Share of the signal's energy that the fit explains [-]."""
    window: float
    """Duration of the fit [s]."""
    modes: int
    ok: bool
    reason: str = ""
    """Why it is not measurable."""
    found: tuple[Mode, ...] = ()
    """All modes, the strongest at the stop first."""


def fit_ring_down(
    alpha: Floats,
    period: float,
    *,
    modes: int = 1,
    time: Floats | None = None,
    slow_poles: tuple[float, ...] = (),
    offset: bool = False,
    skip: float = SKIP,
    window: float | None = None,
    evidence: float | None = None,
) -> RingDown:
    """Fit damped sines to a ring-down by vector nonlinear least squares.

        α(t) = Σ_k e^(-σ_k t) (c_k cos ω_k t + s_k sin ω_k t) + Σ_l e^(-p_l t) d_l,  σ = ω ζ/√(1-ζ²)

    with vectors c, s, d of three axes. They enter linearly and are eliminated (variable projection; Golub and
    Pereyra, 1973); f_d and ζ are searched from the best points of a grid, so no initial guess is needed. The
    first fit is over 0.5 s, the second over the time in which the mode found decays into the noise.

    Args:
        alpha: Acceleration of the tool without gravity, starting at the stop, shape (T, 3) [m/s²].
        period: Time between samples [s].
        time: Times of the samples after the stop, shape (T,) [s]; None if none is missing.
        modes: Largest number of modes; another mode is kept only if it explains more than noise would.
        slow_poles: Rates of the non-oscillatory tails to include [1/s].
        offset: Whether to include a constant, for example if gravity is not known exactly.
        skip: Time after the stop that is ignored [s].
        window: Duration of the fit [s]; None to choose it automatically.
        evidence: Smallest n ln(SSE before/SSE after) for another mode [-]; None for the Bayesian information
            criterion, which grows with the number of samples.

    Returns: The strongest mode. `ok` is false, with a `reason`, if no mode is measurable.
    """
    first = round(skip / period)
    if time is None:
        late: Floats = skip + period * np.arange(len(alpha) - first, dtype=np.float64)
    else:
        first = int(np.searchsorted(time, skip - 1e-9))
        late = time[first:]
    signal = RingDownSignal(
        alpha[first:], late, period, (*slow_poles, 0.0) if offset else slow_poles, evidence
    )
    if window is not None:
        return signal.cut(window).fit(modes)
    if signal.length < WINDOWS[0]:
        return not_measurable(
            f"only {signal.length:.3f} s were recorded after the stop, {WINDOWS[0]} s are needed"
        )
    fit = signal.cut(WINDOW).fit(modes)
    audible = math.log(max(fit.amplitude / max(fit.rms, 1e-12), 2.0)) / decay_rate(fit.f_d, fit.zeta)
    chosen = min(max(audible, WINDOWS[0]), WINDOWS[1])
    return signal.cut(chosen).fit(modes) if chosen != fit.window else fit


class RingDownSignal:
    """A ring-down and the projection that eliminates its amplitudes."""

    def __init__(
        self,
        alpha: Floats,
        time: Floats,
        period: float,
        slow_poles: tuple[float, ...],
        evidence: float | None = None,
    ) -> None:
        self.alpha, self.time, self.period = alpha, time, period
        self.slow_poles, self.evidence = slow_poles, evidence
        self.length = float(time[-1] - time[0]) + period if len(time) else 0.0
        self.highest = min(FREQUENCIES[1], 0.45 / period)
        self._slow = [np.exp(-pole * time) for pole in slow_poles]

    def cut(self, window: float) -> "RingDownSignal":
        """Return the first part of the ring-down."""
        past = int(np.searchsorted(self.time, self.time[0] + window - 0.5 * self.period))
        return RingDownSignal(
            self.alpha[:past], self.time[:past], self.period, self.slow_poles, self.evidence
        )

    def basis(self, parameters: Floats) -> Floats:
        """Return functions of time whose amplitudes are eliminated, for (f_d, ζ) per mode, (T, columns)."""
        columns = []
        for f_d, zeta in parameters.reshape(-1, 2):
            decay = np.exp(-decay_rate(f_d, zeta) * self.time)
            phase = 2.0 * np.pi * f_d * self.time
            columns += [decay * np.cos(phase), decay * np.sin(phase)]
        return np.column_stack(columns + self._slow)

    def unexplained(self, parameters: Floats) -> Floats:
        """Return the residual of the signal's projection on the basis, flattened."""
        orthonormal, _ = np.linalg.qr(self.basis(parameters))
        return np.asarray((self.alpha - orthonormal @ (orthonormal.T @ self.alpha)).ravel())

    def fit(self, modes: int) -> RingDown:
        """Fit one mode, then further ones while they improve the fit."""
        # A further mode must lie inside the search range: one at an end would represent something else.
        parameters = self._add_mode(np.empty(0))
        for _ in range(1, modes):
            more = self._add_mode(parameters)
            if not self._pays(parameters, more) or np.any(more[::2] > 0.999 * self.highest):
                break
            parameters = more
        return self._judge(parameters)

    def _add_mode(self, parameters: Floats) -> Floats:
        """Add a mode found by a grid search, and refine all parameters."""
        grid = [
            (float(np.sum(self.unexplained(np.append(parameters, [f_d, zeta])) ** 2)), f_d, zeta)
            for f_d in np.geomspace(1.1 * FREQUENCIES[0], 0.9 * self.highest, 28)
            for zeta in (0.04, 0.12, 0.3)
        ]
        fits = [self.refine(np.append(parameters, [f_d, zeta])) for _, f_d, zeta in sorted(grid)[:3]]
        return min(fits, key=lambda fit: fit[0])[1]

    def refine(self, start: Floats) -> tuple[float, Floats]:
        """Return half the remaining sum of squares, and (f_d, ζ) of each mode, searched from a starting point."""
        count = start.size // 2
        lower = np.tile([FREQUENCIES[0], DAMPING[0]], count)
        upper = np.tile([self.highest, DAMPING[1]], count)
        fit = least_squares(
            self.unexplained,
            start,
            jac=self._jacobian,
            bounds=(lower, upper),
            x_scale=np.tile([1.0, 0.03], count),
            max_nfev=60,
        )
        return float(fit.cost), np.asarray(fit.x)

    def _jacobian(self, parameters: Floats) -> Floats:
        """Return the derivatives of the residual (Kaufman, BIT 15, 1975), shape (3 T, P)."""
        basis = self.basis(parameters)
        orthonormal, triangle = np.linalg.qr(basis)
        weights = np.linalg.lstsq(triangle, orthonormal.T @ self.alpha)[0]
        columns = []
        for k, (f_d, zeta) in enumerate(parameters.reshape(-1, 2)):
            turning, quarter = basis[:, 2 * k : 2 * k + 2], [[0.0, 1.0], [-1.0, 0.0]]
            wave = turning @ weights[2 * k : 2 * k + 2]
            ahead = turning @ quarter @ weights[2 * k : 2 * k + 2]
            rate = decay_rate(f_d, zeta)
            for slope in (
                2.0 * np.pi * ahead - rate / f_d * wave,
                -rate / (zeta * (1.0 - zeta * zeta)) * wave,
            ):
                change = self.time[:, None] * slope
                columns.append((orthonormal @ (orthonormal.T @ change) - change).ravel())
        return np.column_stack(columns)

    def _pays(self, fewer: Floats, more: Floats) -> bool:
        """Whether another mode explains more than noise would."""
        samples = self.alpha.size
        added = 2 + 2 * self.alpha.shape[1]
        before, after = (float(np.sum(self.unexplained(p) ** 2)) + 1e-300 for p in (fewer, more))
        wanted = added * math.log(samples) if self.evidence is None else self.evidence
        # Coloured noise looks like a mode at the frequency where its spectrum is high.
        noise = float(self._coloured(self.unexplained(more), more[-2:-1])[0])
        return bool(samples * math.log(before / after) > wanted * noise)

    def modes_at(self, parameters: Floats) -> tuple[list[Mode], Floats]:
        """Return modes with amplitudes and standard errors, and the residual of the signal, shape (T, 3)."""
        weights, *_ = np.linalg.lstsq(self.basis(parameters), self.alpha)
        left = self.unexplained(parameters)
        errors = self._standard_errors(parameters, left, weights.size).reshape(-1, 2)
        modes = []
        for k, (f_d, zeta) in enumerate(parameters.reshape(-1, 2).tolist()):
            amplitude = float(np.linalg.norm(weights[2 * k : 2 * k + 2], ord=2))
            modes.append(Mode(f_d, zeta, amplitude, float(errors[k, 0]), float(errors[k, 1])))
        return modes, left.reshape(self.alpha.shape)

    def _judge(self, parameters: Floats) -> RingDown:
        """Return the strongest mode with its standard errors, `ok` if they are small enough."""
        modes, left = self.modes_at(parameters)
        found = tuple(sorted(modes, key=lambda one: -one.amplitude))
        energy = float(np.sum(self.alpha**2))
        fit = RingDown(
            **vars(found[0]),
            rms=float(np.sqrt(np.mean(left**2))),
            r_squared=1.0 - float(np.sum(left**2)) / energy if energy > 0.0 else 0.0,
            window=self.length,
            modes=len(modes),
            ok=True,
            found=found,
        )
        reason = _objection(fit, self.highest)
        return replace(fit, ok=not reason, reason=reason)

    def _standard_errors(self, parameters: Floats, left: Floats, linear: int) -> Floats:
        """Return the standard errors of each mode's f_d and ζ, from the Jacobian without amplitudes.

        A residual that is correlated in time, due to a filtered sensor or an unfitted mode, causes larger
        errors than white noise. The largest of three estimates counts: from the residual's spectrum at each
        mode's frequency, from the correlation of successive samples, and from that over many lags (Newey and
        West, Econometrica 55, 1987, Bartlett's weights).
        """
        jacobian = self._jacobian(parameters)
        freedom = max(left.size - parameters.size - linear, 1)
        information = jacobian.T @ jacobian
        if not np.linalg.cond(information) < 1e14:
            return np.full(parameters.size, np.inf)
        inverse = np.linalg.inv(information)
        coloured = np.repeat(self._coloured(left, parameters[::2]), 2)
        white = np.diag(inverse) * float(left @ left) / freedom * coloured
        correlated = np.diag(inverse @ self._score_covariance(jacobian, left) @ inverse) * left.size / freedom
        return np.asarray(np.sqrt(np.maximum(white, correlated)))

    def colour(self, left: Floats, frequencies: Floats) -> Floats:
        """Return a residual's power at some frequencies over that of white noise, at least 1 (autoregression)."""
        left = left.reshape(self.alpha.shape)
        if len(left) < 8 * COLOURS or not np.sum(left * left) > 0.0:
            return np.ones(len(frequencies))
        lags = np.array([float(np.sum(left[lag:] * left[: len(left) - lag])) for lag in range(COLOURS + 1)])
        filtered = solve_toeplitz(lags[:-1] + lags[0] * 1e-6 * (np.arange(COLOURS) == 0), lags[1:])
        turns = np.exp(-2j * np.pi * np.outer(frequencies * self.period, np.arange(1, COLOURS + 1)))
        innovation = (lags[0] - float(filtered @ lags[1:])) / lags[0]
        return np.asarray(np.maximum(innovation / np.abs(1.0 - turns @ filtered) ** 2, 1.0))

    def _coloured(self, left: Floats, frequencies: Floats) -> Floats:
        """Return `colour`, but at least the factor from successive samples, which no unfitted mode lowers."""
        return np.maximum(self.colour(left, frequencies), widening(left.reshape(self.alpha.shape)) ** 2)

    def _score_covariance(self, jacobian: Floats, left: Floats) -> Floats:
        """Return the covariance of the residual's part in the direction of each parameter, shape (P, P)."""
        scores = (jacobian * left[:, None]).reshape(-1, self.alpha.shape[1], jacobian.shape[1]).sum(axis=1)
        total = scores.T @ scores
        lags = round(CORRELATED / self.period)
        for lag in range(1, lags + 1):
            product = scores[lag:].T @ scores[:-lag]
            total += (1.0 - lag / (lags + 1.0)) * (product + product.T)
        return np.asarray(total)


def widening(residual: Floats, fitted: int = 0) -> float:
    """Return the factor on standard errors for a coloured residual, sqrt((1 + r)/(1 - r)), at least 1.

    r is the correlation of successive samples, as of a first-order autoregression. `residual` has shape (T,)
    or (T, axes), in the order of time. For each of the `fitted` slow functions of time, (1 + 3 r)/T is added
    to the correlation found (Marriott and Pope, Biometrika 41, 1954, for the mean).
    """
    energy = float(np.sum(residual**2))
    if energy <= 0.0:
        return 1.0
    r = float(np.sum(residual[1:] * residual[:-1])) / energy
    r = min(max(r + fitted * (1.0 + 3.0 * r) / len(residual), 0.0), MAX_CORRELATION)
    return float(np.sqrt((1.0 + r) / (1.0 - r)))


def decay_rate(f_d: float, zeta: float) -> float:
    """Return the decay rate of a mode [1/s]."""
    return float(2.0 * np.pi * f_d * zeta / np.sqrt(1.0 - zeta * zeta))


def _interval(value: float, error: float) -> tuple[float, float]:
    return max(value - CERTAIN * error, 0.0), value + CERTAIN * error


def _objection(fit: RingDown, highest: float) -> str:
    """Return why a fit must not be used; empty if it may be used."""
    if fit.amplitude < 3.0 * fit.rms:
        return (
            f"the vibration of {fit.amplitude:.3f} m/s² does not stand out of {fit.rms:.3f} m/s² rms of noise"
        )
    if fit.r_squared < LEAST_R_SQUARED:
        return f"damped sines explain only {100.0 * fit.r_squared:.0f} % of the signal"
    for name, value, bounds in (("f_d", fit.f_d, (FREQUENCIES[0], highest)), ("zeta", fit.zeta, DAMPING)):
        if not bounds[0] * 1.001 < value < bounds[1] * 0.999:
            return (
                f"{name} = {value:.4g} is at the end of the range looked in, {bounds[0]:g} to {bounds[1]:g}"
            )
    if fit.f_d_error > 0.1 * fit.f_d or fit.zeta_error > max(0.3 * fit.zeta, 0.01):
        return f"noise leaves f_d ± {fit.f_d_error:.2g} Hz and zeta ± {fit.zeta_error:.2g}"
    return ""


def not_measurable(reason: str) -> RingDown:
    """Return a ring-down without usable values, and the reason."""
    nan = math.nan
    return RingDown(nan, nan, nan, nan, nan, nan, nan, nan, 0, ok=False, reason=reason)
