"""Filters that know where a motion will end, and use the weights for that configuration from the start."""

import numpy as np
import numpy.typing as npt

from tvist_shaping.steady import SteadyFilter


class AimedFilter(SteadyFilter):
    """Filter for motions with a known end, since the vibration after a motion has the modes of the arm at its end.

    Constant weights cannot exceed the limits of the reference, need no averaging, and do not lag behind the arm.
    During the motion, while the arm is elsewhere, they fit less well. If no end is known, as in a stream, the filter
    behaves like a `SteadyFilter`.
    """

    spared = 0.0
    _aimed = False

    def aim(self, q: npt.ArrayLike | None, *, quiet: bool = False) -> None:  # noqa: ARG002  see `PlannedFilter`
        """Use the weights for the end of a motion; the reference must be at rest. See `Filter.aim`."""
        if q is None:
            self._start()
            return
        self._ask(self.estimator.settle(self._angles(np.asarray(q, dtype=float))), None)
        self._taps[:] = self._designed
        self._aimed = True

    def _start(self) -> None:
        self._aimed = False
        super()._start()

    def _weigh(self) -> None:
        if self._aimed:
            self._line.gather(self._taps, self._delays, self._q_star)
        else:
            super()._weigh()


class PlannedFilter(AimedFilter):
    """Filter for motions that are planned to leave no vibration: it leaves these unchanged.

    It shapes all other motions like an `AimedFilter`.
    """

    def aim(self, q: npt.ArrayLike | None, *, quiet: bool = False) -> None:
        """Use the weights for the end of a motion, or leave a quiet one unchanged; see `Filter.aim`."""
        super().aim(q)
        if quiet:
            self._taps[:] = 0.0
            self._taps[0] = 1.0
