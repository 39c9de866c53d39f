"""Base class of all estimators."""

from abc import ABC, abstractmethod

from tvist_shaping._types import Floats, Forkable


class Estimator(Forkable, ABC):
    """Damped frequency and damping ratio of each mode as functions of q, sec. 3.3 of the paper.

    Attributes:
        modes: Number of modes estimated, >= 1.
        f_d_min: Lower bound of every mode's damped frequency at every q [Hz], > 0; determines the longest delay.
        zeta_max: Upper bound of every mode's damping ratio at every q [-], < 1.
        clipped: Whether a mode of the last estimate was clamped to `f_d_min` or `zeta_max`, so that the arm's mode
            differs. It is always False for an estimator whose bounds are those of its modes.
        abrupt: Whether modes may differ much between nearby configurations, such as
            where two frequencies meet.
    """

    modes: int
    f_d_min: float
    zeta_max: float
    clipped: bool = False
    abrupt: bool = False

    @abstractmethod
    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Return f_d [Hz] and ζ [-] at a configuration, each of shape (modes,); these arrays are not modified later.

        Args:
            q: Joint angles [rad], shape (joints,), finite.
        """

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the modes anew, where a jump has no effect: at rest, or when a filter starts.

        An estimator that follows its modes from one configuration to the next may switch to other modes only here,
        since a jump would shake a moving arm. Other estimators return their usual estimate. Argument and result are
        those of `estimate`.
        """
        return self.estimate(q)
