"""How often the programs of a robot may stop its arm or have a move planned within a tick."""

from collections.abc import Callable

from tvist_controller.motion.activity_control import MotionControl
from tvist_protocol.stream import State
from tvist_protocol.transitions import Activity

PAUSE = 300
"""Ticks that a stop, or a plan of a `movej` within a tick, is paid with. These two take longer than all else in a tick,
so fewer than one tick in a hundred may have one.
"""


class Allowance:
    """Counts the stops and plans of a robot's programs.

    Args:
        motion: The robot's motion.
        latest: Returns the state of the last tick.
    """

    def __init__(self, motion: MotionControl, latest: Callable[[], State]) -> None:
        self._motion, self._latest = motion, latest
        self.planning = 0
        """Ticks for which the last plan that was ordered is still being made."""
        self._paid = 0
        """Tick at which all stops and plans are paid."""

    @property
    def debt(self) -> int:
        """Ticks until all stops and plans are paid."""
        return max(self._paid - self._latest().tick, 0)

    def owe(self) -> None:
        """Note a stop or a plan."""
        self._paid = self._latest().tick + self.debt + PAUSE

    @property
    def waits(self) -> bool:
        """Whether the next motion has to wait, since stops and plans were too close to each other."""
        return self._motion.activity is Activity.REST and self.debt > 2 * PAUSE
