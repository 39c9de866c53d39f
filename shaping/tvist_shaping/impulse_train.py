"""The train of impulses that a shaper computes for a mode, and the range of modes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.errors import ImpulseError, ShaperRangeError

F_D_RANGE = (1e-6, 1e6)
"""Range of damped frequencies of a shaper [Hz]: wide enough for any vibration, and times cannot overflow."""


@dataclass(frozen=True, eq=False, slots=True)
class Impulses:
    """A train of impulses, with which the reference is convolved, eqs. (1)-(3) of the paper.

    Attributes:
        A: Amplitudes [-], shape (N,), read-only, with sum 1.
        tau: Times [s], shape (N,), read-only, ascending from 0 (two modes may share a time).

    Raises:
        ImpulseError: The shapes differ, a value is not finite, times do not ascend from 0, or |ΣA - 1| >= 1e-9.
    """

    A: Floats
    tau: Floats

    def __post_init__(self) -> None:
        A, tau = np.array(self.A, dtype=float), np.array(self.tau, dtype=float)
        if A.ndim != 1 or A.shape != tau.shape or A.size == 0:
            raise ImpulseError(f"A has shape {A.shape} and tau {tau.shape}: both must be (N,), N >= 1")
        for name, values in (("A", A), ("tau", tau)):
            if not np.isfinite(values).all():
                raise ImpulseError(f"{name} is {values.tolist()}: must be finite")
        if tau[0] != 0.0 or (np.diff(tau) < 0.0).any():
            raise ImpulseError(
                f"tau is {tau.tolist()}: must ascend from 0 (sort the impulses by time, and subtract the first)"
            )
        if abs(A.sum() - 1.0) >= 1e-9:
            raise ImpulseError(f"A sums to {float(A.sum())!r}: must be 1 within 1e-9 (divide A by its sum)")
        self._hold(A, tau)

    def _hold(self, A: Floats, tau: Floats) -> None:
        A.setflags(write=False)
        tau.setflags(write=False)
        object.__setattr__(self, "A", A)
        object.__setattr__(self, "tau", tau)

    @classmethod
    def _by_construction(cls, A: Floats, tau: Floats) -> "Impulses":
        """Create impulses that the caller guarantees to be valid; this saves checks at every tick."""
        impulses = object.__new__(cls)
        impulses._hold(A, tau)
        return impulses

    @property
    def duration(self) -> float:
        """Time of the last impulse [s]; the shaped reference ends later by this time."""
        return float(self.tau[-1])

    @property
    def mean_delay(self) -> float:
        """Σ A_j τ_j [s], the lag of the shaped reference behind one of constant velocity."""
        return float(self.A @ self.tau)


UNSHAPED = Impulses(np.ones(1), np.zeros(1))  # the single impulse that leaves a reference unchanged


def check_mode(f_d: float, zeta: float, zeta_max: float = 1.0, instead: str = "") -> None:
    """Raise ShaperRangeError if a mode is outside a shaper's range; `instead` says what to use for a higher ζ."""
    if not F_D_RANGE[0] <= f_d <= F_D_RANGE[1]:
        raise ShaperRangeError("f_d", f_d, f"{F_D_RANGE[0]:g} to {F_D_RANGE[1]:g} Hz")
    if not 0.0 <= zeta < zeta_max:
        limit = f"at least 0 and less than {zeta_max:g}"
        raise ShaperRangeError("zeta", zeta, f"{limit}: beyond it {instead}" if instead else limit)


def product(trains: Sequence[Impulses]) -> Impulses:
    """Convolve the impulse trains of several modes, which suppresses all of them.

    The result has amplitudes A_i B_j … [-] at the times τ_i + σ_j + … [s], sorted by time, shape (Π N,).

    Args:
        trains: One train for each mode, at least one.

    Raises:
        ImpulseError: There are no trains.
    """
    if not trains:
        raise ImpulseError("a product needs at least one impulse train")
    A, tau = trains[0].A, trains[0].tau
    for train in trains[1:]:
        A = np.multiply.outer(A, train.A).ravel()
        tau = np.add.outer(tau, train.tau).ravel()
        order = np.argsort(tau, kind="stable")
        A, tau = A[order], tau[order]
    return Impulses._by_construction(A, tau)  # noqa: SLF001  sums of 1 multiply to 1, times from 0 add from 0
