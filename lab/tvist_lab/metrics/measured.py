"""A recording with its motions and their figures."""

from collections.abc import Sequence
from dataclasses import dataclass

from tvist_lab.metrics.motion import MotionRows, motions
from tvist_lab.metrics.table import MotionResult, measure
from tvist_lab.recordings import Recording


@dataclass(frozen=True)
class Measured:
    """A recording whose motions are found and measured, each once."""

    recording: Recording
    motions: Sequence[MotionRows]
    results: Sequence[MotionResult]
    """Figures of each motion."""

    @classmethod
    def of(cls, recording: Recording) -> "Measured":
        """Find and measure all motions.

        Raises:
            RecordingError: The recording has no joint angles.
        """
        found = motions(recording)
        return cls(recording, found, [measure(recording, motion) for motion in found])
