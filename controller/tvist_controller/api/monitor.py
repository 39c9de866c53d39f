"""What tells that an arm is no longer the one of its model or of the motions before; for recordings.

The modules behind it may change.
"""

from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.line_tick import SIGNALS, Q
from tvist_controller.line.sample import Sample
from tvist_controller.safety.change_detector import Change, ChangeDetector
from tvist_controller.safety.fit_monitor import FitMonitor
from tvist_controller.safety.payload_monitor import PayloadMonitor

__all__ = ["SIGNALS", "Change", "ChangeDetector", "FitMonitor", "LineMode", "PayloadMonitor", "Q", "Sample"]
