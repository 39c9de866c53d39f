"""Host of one controller: carries out and journals admitted messages, passes output to sinks; no clock or socket."""

from collections.abc import Callable, Sequence

import msgspec

from tvist_controller.about import info_of
from tvist_controller.cell.gripper import changes
from tvist_controller.controller import Controller
from tvist_controller.dispatch.admission import Admitted, admit, admit_setpoint
from tvist_controller.dispatch.rights import ControlHolders, is_holders, may_step
from tvist_controller.instruments.report import Sink
from tvist_controller.motion.setpoints import Unreadable
from tvist_controller.planning.plan import Plan
from tvist_controller.programs.sockets import SocketEvent, SocketPorts
from tvist_controller.safety.payload_learning import PayloadLearning
from tvist_plant.foreign import told
from tvist_plant.user_file import named
from tvist_protocol.codec import encode
from tvist_protocol.commands import Command, Forget, Setpoint
from tvist_protocol.journal import Entry, entry_of
from tvist_protocol.modes import RobotMode
from tvist_protocol.replies import Done, Refused, Reply
from tvist_protocol.simulation import SimulationReset, SimulationStep
from tvist_protocol.stream import Event

Attend = Callable[[], bool]
"""Function that handles waiting jobs before a tick of a step; returns False to end the step."""
_BUSY = Refused(code="busy", where="", why="a step is in progress: send the next one after its answer")


class Host:
    """One controller, its journal and its sinks.

    Args:
        controller: The robot.
        sinks: Sinks of its output, in this order.
        ports: Network for sockets of programs; None for no network.
        learning: Learning from the robot's motions; None if the robot learns nothing.
        survives: If True, an exception causes a protective stop and goes to the sinks, not to the caller.
    """

    def __init__(
        self,
        controller: Controller,
        *sinks: Sink,
        ports: SocketPorts | None = None,
        learning: PayloadLearning | None = None,
        survives: bool = False,
    ) -> None:
        self.controller, self._learning, self._survives = controller, learning, survives
        self._ports = ports or SocketPorts()
        self.failure: str | None = None  # reason why the controller has stopped ticking; None while it ticks
        self._sinks = sinks
        self._info: tuple[object, bytes] = None, b""
        self._stepping = False

    def request(self, data: bytes, origin: str | None = None) -> Reply:
        """Admit and carry out an encoded command; `origin` is the sender's IP address, if known."""
        admitted = admit(data, *self.standing)
        if isinstance(admitted, Refused):
            return self._turned_away(admitted)
        return self.carry_out(admitted if origin is None else admitted._replace(origin=origin))

    def carry_out(self, admitted: Admitted, plan: Plan | None = None, attend: Attend | None = None) -> Reply:
        """Carry out a command, with a plan made in advance if it is still valid.

        `attend` is called before each tick of a step; it may carry out other commands, but no step.
        """
        command = admitted.command
        if self._stepping and isinstance(command, SimulationStep):
            return self._turned_away(_BUSY)
        session = admitted.session
        entry = Entry(tick=self._next, kind="command", message=admitted.content, session=session)
        try:
            reply = self.controller.receive(command, plan, session, admitted.origin)
        except Exception as error:  # noqa: BLE001  see `survives`
            self._note(entry)  # needed to reproduce the error
            return Refused(code="plant_failure", where="", why=self._stop_for(error))
        self._carry_out_orders()  # socket orders of programs that the command has ended
        # A command of the client in control renews the lease even if it is refused; another client's does not.
        if not isinstance(reply, Refused) or is_holders(
            self.controller.session.lease, getattr(command, "token", None)
        ):
            self._note(entry)
        if self._learning is not None and not isinstance(reply, Refused) and self._forgets(command):
            self._learning.void()
        if isinstance(command, SimulationStep) and isinstance(reply, Done):
            reply = self._step(command, attend)
        return reply

    @property
    def standing(self) -> ControlHolders:
        """Present holders of control and the clock, readable from any thread."""
        return ControlHolders(self.controller.session.lease, self.controller.session.clock)

    def setpoint(self, data: bytes) -> None:
        """Admit and take a set-point."""
        self.receive_setpoint(admit_setpoint(data, self.controller.session.lease))

    def client_gone(self, client: str, session: str) -> None:
        """Handle the end of a client's session if it held control or the clock."""
        if session in self.standing.sessions_of(client):
            self._note(Entry(tick=self._next, kind="client_gone", client=client, session=session))
            self.controller.client_gone(client, session)
            self._carry_out_orders()

    def missed(self, ticks: int) -> None:
        """Count ticks that began late."""
        self._note(Entry(tick=self._next, kind="missed", count=ticks))
        self.controller.counters.missed_ticks += ticks

    def info(self) -> bytes:
        """Return the encoded description of the controller, cached until the next tick or command."""
        now = self.controller.tick_number, self.controller.counters.commands, self.standing
        if self._info[0] != now:
            self._info = now, encode(info_of(self.controller))
        return self._info[1]

    def tick(self) -> None:
        """Compute one control period."""
        try:
            self._tick()
        except Exception as error:  # noqa: BLE001  the second attempt begins with a protective stop
            self._stop_for(error)
            self._tick()

    def _stop_for(self, error: Exception) -> str:
        """Stop the robot in the next tick for `error` and return the reason; raise it unless `survives`."""
        if not self._survives:
            raise error
        why = f"the controller has failed, see the server's log: {named(error)}"
        self.controller.programs.raised.append(error)
        self.controller.fail(why)
        return why

    def _tick(self) -> None:
        controller, learning = self.controller, self._learning
        if learning is not None and controller.cycle.mode.at_rest:
            self._learn(learning)
        controller.begin_tick()
        news = self._carry_out_orders()
        if (io := controller.changed_io()) is not None:
            for sink in self._sinks:
                sink.io(io)
        report, events = controller.complete_tick()
        if learning is not None:
            learning.watch(
                report.sample,
                controller.assumed.present,
                held=controller.motion.robot_mode is RobotMode.RUNNING,
                placements=controller.cycle.placements,
            )
        for sink in self._sinks:
            for event in events:
                sink.event(event)
            sink.report(report)
        self._tell_truth()
        for one in news:
            self.socket(one)
        self.tell_raised()

    def _learn(self, learning: PayloadLearning) -> None:
        for beliefs, lesson, plan in learning.lessons():
            if beliefs.declared != self.controller.assumed.assumed:
                continue  # outdated: another payload was declared, learnt or forgotten since
            self._note(Entry(tick=self._next, kind="lesson", message=msgspec.to_builtins(lesson)))
            self.controller.assumed.learn(lesson, plan)
        for error in learning.raised():
            self.warn(f"a motion has taught nothing: {named(error)}")
            for sink in self._sinks:
                sink.raised(error)

    def _forgets(self, command: Command) -> bool:
        """Return whether a command invalidates what the robot is learning from its motions."""
        if isinstance(command, SimulationReset):
            return command.payload is not None or self.controller.cell is not None
        return isinstance(command, Forget)

    def _tell_truth(self) -> None:
        """Send what a real robot cannot measure, computed once, to the sinks that want it."""
        published, truth = self.controller.setup.truth, None
        for sink in self._sinks:
            if published or sink.wants_truth:
                truth = truth or self.controller.truth()
                if truth is None:
                    return
                sink.truth(truth)

    def tell_raised(self) -> None:
        """Pass exceptions of plant methods and program functions to the sinks."""
        raised = self.controller.programs.raised
        for error in (*told(self.controller.cycle.plant), *raised):
            for sink in self._sinks:
                sink.raised(error)
        raised.clear()

    def fail(self, why: str) -> None:
        """In the next tick, handle a failure outside the controller, such as of the arm's tick source."""
        self.controller.fail(why)

    def leave_arm(self) -> None:
        """Power off an arm that nobody controls any more."""
        if (power := self.controller.motion.power) is not None:
            power.end()
            self.tell_raised()

    def _carry_out_orders(self) -> Sequence[SocketEvent]:
        """Carry out socket orders of programs; return results that are known at once."""
        orders = self.controller.programs.sockets.orders
        if not orders:
            return ()
        news = self._ports.carry_out(orders)
        orders.clear()
        return news

    def socket(self, news: SocketEvent) -> None:
        """Take news about a socket of a program."""
        number, change, data = news
        self._note(Entry(tick=self._next, kind="socket", socket=number, change=change, data=data or None))
        self.controller.programs.sockets.hear(news)

    def ask_gripper(self, request: bytes) -> bytes:
        """Carry out a client's gripper request and return the answer; raise ValueError without a gripper."""
        if self.controller.cell is None:
            raise ValueError("there is no cell")
        if changes(request):
            self._note(Entry(tick=self._next, kind="gripper", data=request))
        return self.controller.cell.answer(request)

    def warn(self, why: str) -> None:
        """Send clients a warning about something outside the controller; a replay does not repeat it."""
        event = Event(tick=self._next, kind="warning", why=why)
        for sink in self._sinks:
            sink.event(event)

    @property
    def _next(self) -> int:
        return self.controller.tick_number + 1

    def _turned_away(self, refusal: Refused) -> Refused:
        self.controller.counters.commands += 1
        self.controller.counters.refused += 1
        return refusal

    def _note(self, entry: Entry) -> None:
        for sink in self._sinks:
            sink.journal(entry)

    def receive_setpoint(self, setpoint: Setpoint | Unreadable | None) -> None:
        """Take an admitted set-point, or None; the controller checks the sender's rights."""

        def note() -> None:
            match setpoint:
                case Setpoint():
                    self._note(entry_of(self._next, setpoint))
                case Unreadable():
                    self._note(Entry(tick=self._next, kind="setpoint_refused", why=setpoint.why))

        self.controller.receive_setpoint(setpoint, note)

    def _step(self, step: SimulationStep, attend: Attend | None) -> Done:
        """Compute the ticks of a step, until its token loses the right to advance time."""
        controller, setpoints = self.controller, iter(step.setpoints or ())
        motion_token = step.token if step.motion_token is None else step.motion_token
        self._stepping = True
        try:
            for _ in range(step.ticks):
                going_on = attend is None or attend()
                if not going_on or not may_step(
                    controller.session.clock, controller.session.lease, step.token
                ):
                    break
                if (setpoint := next(setpoints, None)) is not None:
                    played = Setpoint(token=motion_token, sequence=setpoint.sequence, q=setpoint.q)
                    self.receive_setpoint(played)
                self.tick()
        finally:
            self._stepping = False
        return Done(tick=controller.tick_number)
