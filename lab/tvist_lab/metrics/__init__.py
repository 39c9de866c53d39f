"""Metrics of a recording: those of the paper, and those on a common clock."""

from tvist_lab.metrics.changes import changes
from tvist_lab.metrics.columns import COLUMNS, grouped_notes, motion_cells
from tvist_lab.metrics.common_clock import (
    envelope,
    in_motion_rms,
    peak_acceleration,
    peak_after_stop,
    peak_velocity,
    rigid_acceleration,
    still_after,
    vibration_after_stop,
)
from tvist_lab.metrics.comparison import ComparedMotion, Comparison, MotionPair, compare, pairs, shaper_of
from tvist_lab.metrics.measured_motion import still_driven
from tvist_lab.metrics.motion import MotionRows, motions
from tvist_lab.metrics.paper import Residual, Settling, attained_position, distance, residual, settling
from tvist_lab.metrics.ring_down import SLOW_POLE, RingDown, fit_ring_down
from tvist_lab.metrics.table import (
    MeasuredRecording,
    MotionResult,
    Runs,
    Table,
    analyze,
    measure,
    table_2,
    table_notes,
)
from tvist_lab.metrics.vibration import (
    NotMeasurableError,
    amplitude,
    best_tool_acceleration,
    tool_acceleration,
)

__all__ = [
    "COLUMNS",
    "SLOW_POLE",
    "ComparedMotion",
    "Comparison",
    "MeasuredRecording",
    "MotionPair",
    "MotionResult",
    "MotionRows",
    "NotMeasurableError",
    "Residual",
    "RingDown",
    "Runs",
    "Settling",
    "Table",
    "amplitude",
    "analyze",
    "attained_position",
    "best_tool_acceleration",
    "changes",
    "compare",
    "distance",
    "envelope",
    "fit_ring_down",
    "grouped_notes",
    "in_motion_rms",
    "measure",
    "motion_cells",
    "motions",
    "pairs",
    "peak_acceleration",
    "peak_after_stop",
    "peak_velocity",
    "residual",
    "rigid_acceleration",
    "settling",
    "shaper_of",
    "still_after",
    "still_driven",
    "table_2",
    "table_notes",
    "tool_acceleration",
    "vibration_after_stop",
]
