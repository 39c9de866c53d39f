"""Base of all estimators, which provide a filter with the modes of the arm."""

from abc import ABC, abstractmethod

from tvist_shaping._types import Floats, Forked


class Estimator(Forked, ABC):
    """Damped frequency and damping ratio of each mode as functions of q, sec. 3.3 of the paper.

    Attributes:
        modes: Number of modes estimated, >= 1.
        f_d_min: Lower bound of every mode's damped frequency over every q [Hz], > 0. It determines the longest possible
            delay.
        zeta_max: Upper bound of every mode's damping ratio over every q [-], < 1.
        clipped: Whether a mode of the last estimate was outside `f_d_min` or `zeta_max` and was clamped to it, so
            that the arm's mode differs. It is always False for an estimator whose bounds are those of its modes.
        abrupt: Whether modes may change almost at once from one configuration to the next, as where two of them come
            close.
    """

    modes: int
    f_d_min: float
    zeta_max: float
    clipped: bool = False
    abrupt: bool = False

    @abstractmethod
    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the modes at a configuration.

        Args:
            q: Joint angles [rad], shape (joints,), finite.

        Returns:
            f_d [Hz] and ζ [-], each of shape (modes,). The estimator does not modify these arrays later.
        """

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the modes anew, where a jump of the estimate has no effect: at rest, or when a filter begins.

        An estimator that follows its modes from one configuration to the next may switch to other modes only here,
        since a jump would shake a moving arm. Other estimators return their usual estimate.

        Args:
            q: Joint angles, see `estimate`.

        Returns:
            Modes, see `estimate`.
        """
        return self.estimate(q)
