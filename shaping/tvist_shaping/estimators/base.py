"""What an estimator is: where the filter learns the modes of the arm from."""

import copy
from abc import ABC, abstractmethod
from typing import Self

from tvist_shaping._types import Floats


class Estimator(ABC):
    """Damped frequency and damping ratio of each mode as functions of q, sec. 3.3 of the paper.

    Attributes:
        clipped: Whether a mode of the last estimate was beyond `f_d_min` or `zeta_max`, and held there: then the arm
            has another one. An estimator whose bounds are those of its modes never is.
    """

    clipped: bool = False

    @property
    @abstractmethod
    def modes(self) -> int:
        """Number of modes estimated, >= 1."""

    @property
    @abstractmethod
    def f_d_min(self) -> float:
        """Lower bound of every mode's damped frequency over every q [Hz], > 0.

        It says how long a delay can get.
        """

    @property
    @abstractmethod
    def zeta_max(self) -> float:
        """Upper bound of every mode's damping ratio over every q [-], < 1."""

    @abstractmethod
    def estimate(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the modes at a configuration.

        Args:
            q: Joint angles [rad], shape (joints,), finite.

        Returns:
            f_d [Hz] and ζ [-], each of shape (modes,). The estimator will not change them afterwards.
        """

    def settle(self, q: Floats) -> tuple[Floats, Floats]:
        """Estimate the modes anew, where no other estimate can move anything: the arm rests, or a filter begins.

        An estimator that follows its modes from one configuration to the next may take other modes here, and only
        here: a jump would shake an arm that moves. Others estimate as ever.

        Args:
            q: Joint angles, see `estimate`.

        Returns:
            As of `estimate`.
        """
        return self.estimate(q)

    def fork(self) -> Self:
        """An independent copy that goes on from here: the same estimates for the same configurations.

        Returns:
            The copy. It shares what nobody changes; use it in the thread of the original.
        """
        other = copy.copy(self)
        other._part()  # noqa: SLF001  one of its own kind
        return other

    def _part(self) -> None:  # noqa: B027  most estimators share nothing that changes
        """Replace what is changed in place, arrays and other objects, by copies: a new copy shares it still."""
