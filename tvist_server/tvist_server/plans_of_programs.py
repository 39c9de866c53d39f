"""Thread that plans the motions of programs next to the controller's thread."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from tvist_controller.dispatch.planner import Planner
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import Snapshot
from tvist_protocol.commands import Command


class PlansOfPrograms:
    """Plans what the controller orders. The controller takes each plan at a tick that does not depend on this thread.

    A program's line begins a fixed number of ticks after it is called, so a run is the same on every machine. If a plan
    takes longer than that, the controller waits for it, and its ticks are late.

    Args:
        planner: Makes plans; used by this thread only.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._thread = ThreadPoolExecutor(1, "tvist-program-plans")
        # Begun by the tick thread, it would inherit its priority.
        self._thread.submit(int)

    def order(self, command: Command, now: Snapshot) -> Callable[[], Plan]:
        """Have a command planned on a state; returns what waits for the plan."""
        return self._thread.submit(self._planner.plan, command, now).result

    def close(self) -> None:
        """Finish the current plan; to be called after the controller's thread has ended."""
        self._thread.shutdown(cancel_futures=True)
