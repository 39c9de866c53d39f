"""The TVIST filter: Figure 8 of the paper."""

import math

import numpy as np
import numpy.typing as npt

from tvist_shaping._types import Floats
from tvist_shaping.base import Filter
from tvist_shaping.errors import FilterError, ShaperFailureError, check_positive
from tvist_shaping.estimators.base import Estimator
from tvist_shaping.estimators.polynomial import Polynomial
from tvist_shaping.failures import FAILURES, ROUNDING, failure
from tvist_shaping.filter_kernels import eased, shape, shape_all
from tvist_shaping.impulse_train import UNSHAPED, Impulses, product
from tvist_shaping.impulses import Train
from tvist_shaping.own import longest as longest_of
from tvist_shaping.shaper import Shaper

EASE = 40.0  # natural frequency of the low-pass for modes that may change abruptly [1/s]
QUICKEST = (1.0, 0.2)
"""Largest relative rate of change of f_d after the low-pass, and largest rate of change of ζ [1/s]."""


class TvistFilter(Filter):
    """Time-varying input shaping of a sampled reference, one filter for all joints.

    At tick i, with h the period,

        x*_i = Σ_j A_j(ζ) x(t_i - τ_j(f_d)),    (f_d, ζ) = estimator(x*_{i-1})

    (eq. (10)): the impulses of the *present* tick are applied to past samples. Their sum is 1 at every tick, so a
    reference at rest passes unchanged however the parameters change, and the final value equals the reference's. All
    joints get the same impulses, so a straight line in joint space stays straight. A curve is preserved if its
    parameter is shaped (see `reset`).

    Attributes:
        shaper: The shaper.
        max_delay: Longest delay for which samples are kept [s].
        clipped: Whether a mode was clamped to the estimator's `f_d_min` or `zeta_max`. Delays are never clipped, since
            the constructor refuses combinations that could exceed max_delay.
    """

    def __init__(
        self,
        shaper: Shaper,
        estimator: Estimator,
        *,
        joints: int,
        period: float = 0.002,
        max_delay: float = 1.0,
    ) -> None:
        """Create a filter at rest at q = 0; `reset` moves it to the arm's configuration.

        Args:
            shaper: Shaper for one mode; the impulses of several modes are convolved.
            estimator: The modes as functions of q.
            joints: Number of joints of the arm, >= 1.
            period: Time between two samples h [s], > 0.
            max_delay: Longest delay for which samples are kept [s], > 0.

        Raises:
            FilterError: An argument is out of range; or the shaper would be longer than max_delay at the estimator's
                lowest frequency; or the estimator's highest damping ratio exceeds the shaper's.
            EstimatorError: The estimator requires more joints.
            ShaperFailureError: The shaper's function fails for the modes at q = 0.
        """
        check_positive(FilterError, "seconds", period=period, max_delay=max_delay)
        longest = estimator.modes * shaper.duration_periods / estimator.f_d_min
        if longest > max_delay and estimator.modes * longest_of(shaper, estimator.f_d_min) <= max_delay:
            longest = max_delay
        if longest > max_delay:
            raise FilterError(
                "duration",
                longest,
                f"at most max_delay = {max_delay:g} s",
                f"shaper {shaper.name!r} lasts {shaper.duration_periods:g} periods a mode, and f_d of the estimator's "
                f"{estimator.modes} mode(s) may go down to {estimator.f_d_min:g} Hz: take a shorter shaper, whose "
                "times are in seconds, a larger max_delay or an estimator with a higher lowest frequency",
            )
        if estimator.zeta_max >= shaper.zeta_max:
            raise FilterError(
                "zeta_max",
                estimator.zeta_max,
                f"less than {shaper.zeta_max:g}, as shaper {shaper.name!r} demands",
                "take a shaper with a higher zeta_max or an estimator with a lower highest damping",
            )
        # One tick more than max_delay, for rounding of τ/h; the others are for interpolation.
        capacity, peak = math.ceil(max_delay / period) + 5, float(shaper.peak**estimator.modes)
        super().__init__(shaper.name, estimator, joints, period, capacity, peak)
        self._reach = math.ceil(longest / period) + 3  # three are for interpolation
        self._longest, self._most = longest, longest * (1.0 + ROUNDING)
        self.shaper, self.max_delay = shaper, max_delay
        self._impulses: Impulses | None = UNSHAPED
        self._eased: Floats = np.zeros((4, estimator.modes))
        train = shaper.function if estimator.modes == 1 and isinstance(shaper.function, Train) else None
        self._train = None if train is None else np.array([train.a, train.periods])
        self._work: Floats = np.zeros((3, 1 if train is None else len(train.a)))
        self.reset(self._q_star)
        self._check_made()

    @property
    def impulses(self) -> Impulses:
        """Impulses of the last tick."""
        if self._impulses is None:
            self._impulses = Impulses(self._work[0], self._work[1])
        return self._impulses

    @property
    def delay(self) -> float:
        """Delay of the last impulse at the last tick [s]; the shaped reference ends later by this time."""
        return self._work.item(1, -1) if self._impulses is None else self._impulses.duration

    @property
    def mean_delay(self) -> float:
        """Mean delay of the last tick's impulses [s]."""
        return self.impulses.mean_delay

    def mean_delay_of(self, f_d: Floats, zeta: Floats) -> float | None:
        """Sum of the modes' mean delays [s]; see `Filter.mean_delay_of`."""
        modes = zip(f_d.tolist(), zeta.tolist(), strict=True)
        return sum(self.shaper.impulses(*mode).mean_delay for mode in modes)

    def replace(self, *, shaper: Shaper | None = None, estimator: Estimator | None = None) -> "TvistFilter":
        """Return another filter, with a new shaper or estimator, that continues from the state of this one.

        During a motion the outputs of both differ; `Fade` provides a smooth transition.

        Args:
            shaper: Another shaper; None for the same.
            estimator: Another estimator; None for a fork of the same.

        Raises:
            FilterError: Shaper and estimator do not fit together, as in the constructor.
        """
        changed = TvistFilter(
            self.shaper if shaper is None else shaper,
            self.estimator.fork() if estimator is None else estimator,
            joints=self.joints,
            period=self.period,
            max_delay=self.max_delay,
        )
        changed.take_over(self)
        return changed

    def _start(self) -> None:
        modes = self.estimator.settle(self._angles(self._q_star))
        self._eased[:2], self._eased[2:] = modes, 0.0
        self._suppress(modes)

    def _modes(self) -> tuple[Floats, Floats]:
        """Return the modes; if they may change abruptly, smooth them by a low-pass to keep the limits."""
        modes = super()._modes()
        if not self.estimator.abrupt:
            return modes
        if self.settled:
            self._eased[:2], self._eased[2:] = modes, 0.0
            return modes
        eased(*modes, EASE, QUICKEST, self.period, self._eased)
        return self._eased[0].copy(), self._eased[1].copy()

    def _suppress(self, modes: tuple[Floats, Floats]) -> None:
        self.f_d, self.zeta = modes
        self.clipped = self.estimator.clipped
        try:
            self._impulses = self._computed()
        except FAILURES as error:
            self.fault = failure(error, self.f_d, self.zeta)
        else:
            self.fault = None

    def _computed(self) -> Impulses:
        give, f_d, zeta = self.shaper.impulses, self.f_d, self.zeta
        if len(f_d) == 1:  # the usual case, faster without lists
            impulses = give(f_d.item(), zeta.item())
        else:
            impulses = product([give(f, z) for f, z in zip(f_d.tolist(), zeta.tolist(), strict=True)])
        if impulses.tau.item(-1) > self._most:
            raise ShaperFailureError(
                self.name, f"gives impulses that last {impulses.duration:g} s, beyond {self._longest:g} s"
            )
        return impulses

    def _weigh(self) -> None:
        """Apply this tick's impulses, for the modes at the last shaped reference (z⁻¹ in Figure 8)."""
        line, modes = self._line, self._modes()
        if self._train is not None and shape(
            *modes, self.shaper.zeta_max, self._most, self.period,
            self._train, self._work, line.ring, line.head, line.scratch, self._q_star,
        ):  # fmt: skip
            self.f_d, self.zeta = modes
            self.clipped, self.fault, self._impulses = self.estimator.clipped, None, None
        else:
            self._suppress(modes)
            line.gather(self.impulses.A, self.impulses.tau / self.period, self._q_star)

    def filter_all(self, q_ref: npt.ArrayLike) -> Floats:
        """Shape many samples in one compiled call, with the paper's estimator; see `Filter.filter_all`."""
        estimator, line, train = self.estimator, self._line, self._train
        samples = np.ascontiguousarray(q_ref, dtype=float)
        fits = samples.ndim == 2 and samples.shape[1:] == (line.joints,) and len(samples) > 0
        if train is None or self._posture is not None or type(estimator) is not Polynomial or not fits:
            return super().filter_all(samples)
        out, modes = np.empty_like(samples), np.array([self.f_d, self.zeta])
        done = shape_all(
            samples, *estimator.coefficients, self.shaper.zeta_max, self._most, self.period,
            train, self._work, line.ring, line.head, line.scratch, self._q_star, modes, out,
        )  # fmt: skip
        if done:
            line.pushed(samples[:done], (line.head + done) % line.capacity)
            self.f_d, self.zeta = modes
            self.clipped, self.fault, self._impulses = False, None, None
        for i in range(done, len(samples)):
            out[i] = self.filter(samples[i])
        return out
