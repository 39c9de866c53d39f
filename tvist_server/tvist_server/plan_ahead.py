"""Plans motions in a thread beside the controller's thread."""

import logging
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import NamedTuple

from tvist_controller.dispatch.admission import Admitted
from tvist_controller.dispatch.planner import Planner
from tvist_controller.dispatch.table import COMMANDS
from tvist_controller.host import Host
from tvist_controller.planning.plan import Plan
from tvist_controller.planning.snapshot import PlanningState
from tvist_controller.refusal import RefusalError
from tvist_protocol.commands import Command, KeepAlive
from tvist_protocol.replies import Posture, Refused, ToolPose
from tvist_server.gateways.base import Answer

log = logging.getLogger(__name__)

MAX_WAITING = 16  # number of commands that may wait for their planning, or for that of an earlier command
MAX_ASKING = 8
"""Number of waiting commands above which questions are refused, to leave room for the client in control."""
TRIES = 10  # number of outdated plans after which the controller's thread itself plans the command
CLOSE_WAIT = 1.0  # longest time to finish the current plan at close [s]

_REHEARSING = threading.Lock()
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
    """Passes commands to the controller in order, with a finished plan if planning takes long.

    A plan starts from the controller's state when the command's turn comes. If anything that the plan depends
    on changes before the controller gets it, planning is repeated. Commands wait while an earlier one is
    planned, except renewals of the lease. A command that stops the arm is carried out at once and again in
    its turn, so that it ends both the present motion and any motion that was sent before it and would start
    after it.
    """

    def __init__(
        self,
        host: Host,
        planner: Planner,  # used only by this thread
        post: Callable[[Callable[[], None]], None],  # queues a job for the controller's thread
        complete: Callable[[Admitted], Admitted | Refused],  # adds a program's text, or refuses
    ) -> None:
        self._host, self._planner, self._post, self._complete = host, planner, post, complete
        self._lock = threading.Lock()
        self._count, self._commands = 0, 0
        self._closing = False
        self._queue: SimpleQueue[_Waiting | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="tvist-plan", daemon=True)

    def start(self) -> None:
        """Start planning; earlier commands wait until now."""
        self._thread.start()

    def end(self) -> None:
        """Refuse the waiting and all further commands."""
        self._closing = True
        self._queue.put(None)

    def close(self) -> None:
        """Wait for the thread to end; call this before the controller's thread ends."""
        if self._thread.is_alive():
            self._thread.join(CLOSE_WAIT)

    def submit(self, admitted: Admitted, answer: Answer) -> None:
        """Queue a command, from any thread, without blocking; `answer` takes the reply in the controller's thread."""
        row = COMMANDS[type(admitted.command)]
        stops, asks = row.stops, row.asks
        with self._lock:
            waits = row.plan is not None
            waits |= self._commands > 0 and not isinstance(admitted.command, KeepAlive)
            full = self._count >= (MAX_ASKING if asks else MAX_WAITING) or self._closing
            if waits and not full:
                self._count += 1
                self._commands += not asks
                self._queue.put(_Waiting(admitted, (lambda _: None) if stops else answer))
        if not waits or stops:
            self._post(lambda: answer(self._host.carry_out(admitted)))
        elif full:
            self._post(lambda: answer(_BUSY))

    def _run(self) -> None:
        try:
            with _REHEARSING:  # the robots of a process share what the first of them compiles
                self._planner.rehearse_scripts()  # takes hundreds of milliseconds, so not before the start
        except Exception:  # motions need no program
            log.exception("programs cannot be compiled")
        while (waiting := self._queue.get()) is not None:
            try:
                self._hand_over(waiting)
            except Exception:
                log.exception("a command is refused, since its preparation failed")
                answer = waiting.answer
                self._post(lambda answer=answer: answer(_FAILED))  # type: ignore[misc]
            with self._lock:
                self._count -= 1
                self._commands -= not COMMANDS[type(waiting.admitted.command)].asks

    def _hand_over(self, waiting: _Waiting) -> None:
        if self._closing:
            self._post(lambda: waiting.answer(_BUSY))
            return
        completed = self._complete(waiting.admitted)
        if isinstance(completed, Refused):
            self._post(lambda: waiting.answer(completed))
            return
        waiting = waiting._replace(admitted=completed)
        command = waiting.admitted.command
        row = COMMANDS[type(command)]
        if row.asks:
            self._reply(command, waiting.answer)
            return
        if row.plan is not None:
            taken: SimpleQueue[bool] = SimpleQueue()
            for _ in range(TRIES):
                plan = self._planner.plan(command, self._present())
                self._post(lambda plan=plan: taken.put(self._take(waiting, plan)))  # type: ignore[misc]
                if taken.get():
                    return
        self._post(lambda: waiting.answer(self._host.carry_out(waiting.admitted)))

    def _reply(self, question: Command, answer: Answer) -> None:
        """Answer a question without the controller or its journal; every client may ask."""
        found = self._planner.plan(question, self._present()).found
        assert isinstance(found, Posture | ToolPose | RefusalError)
        reply = found.reply if isinstance(found, RefusalError) else found
        self._post(lambda: answer(reply))

    def _present(self) -> PlanningState:
        """Return the controller's present state, which its thread reads just before a tick."""
        present = SimpleQueue[PlanningState]()
        self._post(lambda: present.put(self._host.controller.snapshot()))
        return present.get()

    def _take(self, waiting: _Waiting, plan: Plan) -> bool:
        """Carry out a command with its plan, if the plan still applies; runs in the controller's thread."""
        if not self._host.controller.plans.hold(plan):
            return False
        waiting.answer(self._host.carry_out(waiting.admitted, plan))
        return True
