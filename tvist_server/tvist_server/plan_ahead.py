"""The thread that plans beside the controller's."""

import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import NamedTuple

from tvist_controller.admission import Admitted
from tvist_controller.host import Host
from tvist_controller.planning.planner import PLANNED, Plan, Planner
from tvist_protocol.commands import PowerOff, Stop
from tvist_protocol.programs import ProgramStop
from tvist_protocol.replies import Refused, Reply
from tvist_server.gateways.base import Answer

log = logging.getLogger(__name__)

MAX_WAITING = 16
"""Commands that may wait to be planned, and behind one that is."""
TRIES = 10
"""Plans that may be overtaken by what changes meanwhile, before one is made in the controller's thread."""
CLOSE_WAIT = 1.0
"""How long the plan that is being made may take at close [s]."""


STOPPING = (Stop, PowerOff, ProgramStop)
"""Commands that stop the arm."""
_BUSY = Refused(
    code="busy",
    where="",
    why=f"{MAX_WAITING} commands are waiting to be planned, or the server is shutting down: "
    "send the next one after an answer",
    limit=MAX_WAITING,
)
_FAILED = Refused(
    code="wrong_mode",
    where="",
    why="this command could not be planned because of an error in the server: see its log",
)


class _Waiting(NamedTuple):
    admitted: Admitted
    answer: Answer


class PlanAhead:
    """Hands commands to the controller in the order in which they came, those that take long with a plan.

    A plan is made of what the controller last said of itself. Where something that it depends on has
    changed until the controller has it, it is made anew. A command that comes while one before it is being planned
    waits for it. What stops the arm is carried out at once, and again when it is its turn: so it ends what moves now,
    and also a motion that was sent before it and begins after it.

    Args:
        host: The controller.
        planner: Makes plans, for this thread alone.
        post: Has something done in the controller's thread.
    """

    def __init__(self, host: Host, planner: Planner, post: Callable[[Callable[[], None]], None]) -> None:
        self._host, self._planner, self._post = host, planner, post
        self._lock = threading.Lock()
        self._count = 0
        self._closing = False
        self._queue: SimpleQueue[_Waiting | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-plan", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def end(self) -> None:
        """Refuse what waits, and what comes."""
        self._closing = True
        self._queue.put(None)

    def close(self) -> None:
        """Wait for the end, before the controller's thread ends."""
        if self._thread.is_alive():
            self._thread.join(CLOSE_WAIT)

    @property
    def waiting(self) -> int:
        """Commands that wait."""
        return self._count

    def submit(self, admitted: Admitted, answer: Answer) -> None:
        """Have a command carried out. From any thread; never waits.

        Args:
            admitted: The command.
            answer: Takes the reply, in the controller's thread.
        """
        stops = isinstance(admitted.command, STOPPING)
        with self._lock:
            waits = self._count > 0 or isinstance(admitted.command, PLANNED)
            full = self._count >= MAX_WAITING or self._closing
            if waits and not full:
                self._count += 1
                self._queue.put(_Waiting(admitted, _nobody if stops else answer))
        if not waits or stops:
            self._post(lambda: answer(self._host.carry_out(admitted)))
        elif full:
            self._post(lambda: answer(_BUSY))

    def _run(self) -> None:
        while (waiting := self._queue.get()) is not None:
            self._hand_over(waiting)
            with self._lock:
                self._count -= 1

    def _hand_over(self, waiting: _Waiting) -> None:
        command = waiting.admitted.command
        if self._closing:
            self._post(lambda: waiting.answer(_BUSY))
            return
        if isinstance(command, PLANNED):
            taken: SimpleQueue[bool] = SimpleQueue()
            for _ in range(TRIES):
                self._post(lambda: taken.put(True))
                taken.get()  # just before a tick: most plans are ready long before the next
                try:
                    plan = self._planner.plan(command, self._host.standing.basis)
                except Exception:
                    log.exception("a plan failed, its command is refused")
                    self._post(lambda: waiting.answer(_FAILED))
                    return
                self._post(lambda plan=plan: taken.put(self._take(waiting, plan)))  # type: ignore[misc]
                if taken.get():
                    return
        self._post(lambda: waiting.answer(self._host.carry_out(waiting.admitted)))

    def _take(self, waiting: _Waiting, plan: Plan) -> bool:
        """Carry out a command by its plan, where that holds; in the controller's thread."""
        if not plan.holds(self._host.controller.basis):
            self._host.publish()
            return False
        waiting.answer(self._host.carry_out(waiting.admitted, plan))
        return True


def _nobody(reply: Reply) -> None:
    """The sender has its answer."""
