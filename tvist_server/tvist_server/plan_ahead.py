"""The thread that plans beside the controller's."""

import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import NamedTuple

from tvist_protocol.codec import encode
from tvist_protocol.commands import Stop
from tvist_protocol.replies import Refused
from tvist_server.admission import Admitted
from tvist_server.gateways.base import Reply
from tvist_server.host import Host
from tvist_server.planning.planner import PLANNED, Plan, Planner

log = logging.getLogger(__name__)

MOST_WAITING = 64
"""Commands that may wait to be planned."""
TRIES = 10
"""Plans that may be overtaken by what changes meanwhile, before one is made in the controller's thread."""
CLOSE_WAIT = 1.0
"""How long the plan that is being made may take at close [s]."""


class _Waiting(NamedTuple):
    admitted: Admitted
    reply: Reply


class PlanAhead:
    """Hands commands to the controller in the order in which they came, those that take long with a plan.

    A plan is made of what the controller said of itself after its last tick. Where something that it depends on has
    changed until the controller has it, it is made anew. A command that comes while one before it is being planned
    waits for it. Only a stop of something that moves does not wait: whatever is being planned then, it is no motion.

    Args:
        host: The controller.
        planner: Makes plans, for this thread alone.
        post: Has something done in the controller's thread.
    """

    def __init__(self, host: Host, planner: Planner, post: Callable[[Callable[[], None]], None]) -> None:
        self._host, self._planner, self._post = host, planner, post
        self._lock = threading.Lock()
        self._count = 0
        self._queue: SimpleQueue[_Waiting | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-plan", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def close(self) -> None:
        """End, after what waits; before the controller's thread does."""
        self._queue.put(None)
        if self._thread.is_alive():
            self._thread.join(CLOSE_WAIT)

    def submit(self, admitted: Admitted, reply: Reply) -> None:
        """Have a command carried out. From any thread; never waits.

        Args:
            admitted: The command.
            reply: Takes the answer, in the controller's thread.
        """
        with self._lock:
            if not self._waits(admitted):
                self._post(lambda: reply(self._host.carry_out(admitted)))
                return
            if self._count < MOST_WAITING:
                self._count += 1
                self._queue.put(_Waiting(admitted, reply))
                return
        why = f"{MOST_WAITING} commands wait to be planned: send the next when one is answered"
        reply(encode(Refused(code="busy", where="", why=why, limit=MOST_WAITING)))

    def _waits(self, admitted: Admitted) -> bool:
        if isinstance(admitted.command, Stop) and self._host.standing.basis.motion is None:
            return False
        return self._count > 0 or isinstance(admitted.command, PLANNED)

    def _run(self) -> None:
        while (waiting := self._queue.get()) is not None:
            self._hand_over(waiting)
            with self._lock:
                self._count -= 1

    def _hand_over(self, waiting: _Waiting) -> None:
        command = waiting.admitted.command
        if isinstance(command, PLANNED):
            taken: SimpleQueue[bool] = SimpleQueue()
            for _ in range(TRIES):
                self._post(lambda: taken.put(True))
                taken.get()  # just before a tick: most plans are ready long before the next
                try:
                    plan = self._planner.plan(command, self._host.standing.basis)
                except Exception:
                    log.exception("a plan failed; the controller's thread tries it")
                    break
                self._post(lambda plan=plan: taken.put(self._take(waiting, plan)))  # type: ignore[misc]
                if taken.get():
                    return
        self._post(lambda: waiting.reply(self._host.carry_out(waiting.admitted)))

    def _take(self, waiting: _Waiting, plan: Plan) -> bool:
        """Carry out a command by its plan, where that holds; in the controller's thread."""
        if not plan.holds(self._host.controller.basis):
            return False
        waiting.reply(self._host.carry_out(waiting.admitted, plan))
        return True
