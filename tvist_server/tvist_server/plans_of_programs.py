"""Plans the motions of programs in a thread beside the controller's thread."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from tvist_controller.dispatch.planner import Planner
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import PlanningState
from tvist_protocol.commands import Command


class PlansOfPrograms:
    """Plans commands for the controller in a thread of its own, the only user of `planner`.

    A program line starts a fixed number of ticks after its call, so a run is the same on every machine. If a
    plan takes longer, the controller waits for it and its ticks are late.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._thread = ThreadPoolExecutor(1, "tvist-program-plans")
        # If the tick thread started it, it would inherit that thread's priority.
        self._thread.submit(int)

    def order(self, command: Command, now: PlanningState) -> Callable[[], Plan]:
        """Start planning a command from a state; return a function that waits for the plan."""
        return self._thread.submit(self._planner.plan, command, now).result

    def close(self) -> None:
        """Finish the current plan; call this after the controller's thread has ended."""
        self._thread.shutdown(cancel_futures=True)
