"""The controller: messages in, replies, states and events out. It has no clock, socket, thread or log.

It puts the rooms together: each part knows those below it, and the controller what they need of one another.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property, partial
from typing import Any, Unpack

import numpy as np

from tvist_controller.authority.rights import Authority
from tvist_controller.authority.session import NoControlError
from tvist_controller.cell.live_cell import LiveCell
from tvist_controller.commands.counters import Counters
from tvist_controller.commands.events import Fields
from tvist_controller.commands.refusal import RefusalError
from tvist_controller.dispatch.guided_commands import ForceCommands, GuidedCommands
from tvist_controller.dispatch.motion_commands import MotionCommands
from tvist_controller.dispatch.payload_control import PayloadControl
from tvist_controller.dispatch.planner import Planner
from tvist_controller.dispatch.program_commands import ProgramCommands
from tvist_controller.dispatch.setpoints import Setpoints, Unreadable
from tvist_controller.dispatch.table import COMMANDS, HARMLESS, WholeRobot
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.instruments.tool_forces import ToolForces
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.sample import Sample
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.filter_control import Filters
from tvist_controller.motion.force_control import ForceControl
from tvist_controller.motion.guidance import Guidance
from tvist_controller.motion.monitor import Monitor
from tvist_controller.planning.command_row import Call
from tvist_controller.planning.filter_planner import PlannedFilter
from tvist_controller.planning.plan import Order, Plan, Plans
from tvist_controller.planning.snapshot import Snapshot
from tvist_controller.programs.access import Access
from tvist_controller.programs.player import ProgramPlayer
from tvist_controller.reporting.report import Report, Reporter, truth_of
from tvist_controller.safety.faults import Faults
from tvist_controller.safety.monitors import Overload, ShaperMonitor
from tvist_controller.safety.own_controller import REFUSED, Supervision, Watching
from tvist_controller.safety.robot_modes import RobotModes
from tvist_controller.safety.safety_control import SafetyControl
from tvist_controller.setup import Setup, body
from tvist_plant.fingerprint import fingerprint
from tvist_plant.foreign import arm_of
from tvist_plant.plant import PERIOD, Plant, PlantError, RealArm, SimulatedArm
from tvist_protocol import commands as c
from tvist_protocol.io import Io
from tvist_protocol.replies import Done, Refused, Reply
from tvist_protocol.simulation import SimulationReset, SimulationStep
from tvist_protocol.stream import Event, EventKind, State, Truth
from tvist_protocol.values import Payload


class Controller(WholeRobot):
    """One robot.

    Args:
        setup: Initial setup.
        plant: Plant to control; None for the setup's own, or else the flexible arm that it describes.
        order: Has commands of programs planned beside the ticks; None to plan them in the ticks.

    Raises:
        ValueError: The setup is invalid, or the plant does not fit it.
    """

    def __init__(self, setup: Setup, plant: Plant | None = None, order: Order | None = None) -> None:
        plant = setup.made_plant() if plant is None else arm_of(plant)
        setup = setup.standing(plant)
        setup.check(placed=plant is None or not (plant.watched or plant.supervised))
        self.setup = setup
        """Initial setup; of an arm that cannot be placed, with the posture in which it stood."""
        self.tick_number = 0
        self.counters = Counters()
        self._events: list[Event] = []
        planner = Planner(setup)
        self._failed: PlantError | None = None
        """Failure of the plant between two ticks, with which the next one deals."""
        self._next_timeout = -math.inf
        """Time at which something may time out next [s]."""
        self.plans = Plans(planner.plan, self.snapshot, order)
        """The way to plans."""
        first = planner.filters.first()
        self.cycle = _cycle(setup, first, plant)
        self._seed = setup.seed
        self._reporter = Reporter(setup.description, self.cycle.plant)
        # What only watches has no power to move anything, whatever is asked of it.
        mode = "POWER_OFF" if self.cycle.plant.watched else setup.mode
        collisions = CollisionModel(setup.description, body(setup.payload))
        self.motion = MotionControl(self.cycle, collisions, self._emit, mode)
        self.modes = RobotModes(self.motion)
        """Robot mode, safety mode and runtime state."""
        self.session = Authority(
            self._interrupt, self._emit, realtime=setup.clock == "realtime", instance=setup.instance
        )
        """Rights to control the robot and to advance time."""
        self.stepping = self.session.stepping
        self._setpoints = Setpoints(self.session, self.motion, self.counters)
        self._safety = safety = SafetyControl(self.motion, self._emit)
        self._faults = Faults(self.motion, safety)
        self.peripherals = Peripherals(self._reporter.set_tcp, self.motion.set_tcp)
        self.watching, self.supervision = self._own_controller()
        """The robot's own controller, which is only watched, or through which the robot is moved; None for neither."""
        self.forces = ToolForces(
            setup.description, self.peripherals, lambda: self.latest, lambda: self.declared
        )
        """Forces and torques on the arm."""
        self.cell = (
            None
            if setup.cell is None
            else LiveCell(setup.cell, setup.description, self.cycle.plant, self.peripherals, self._emit)
        )
        """What stands around the robot; None for nothing."""
        self._force_control = ForceControl(
            Guidance(self.motion), self.forces, timeouts=setup.clock == "realtime"
        )
        self.programs = ProgramPlayer(self._access(), safety)
        self._told_program = self.programs.progress
        self.filters = Filters(self.motion, first.source, setup.payload, self._emit)
        self.payload = PayloadControl(
            setup.payload, self.motion, self.filters, self.peripherals, planner.for_lesson, self._emit,
            follows=setup.adapt == "payload",
        )  # fmt: skip
        """What it carries."""
        safety.monitors = self._monitors()
        parts = (
            self.session, MotionCommands(self.motion, safety, self.programs),
            GuidedCommands(self._force_control.guidance, self.programs),
            ForceCommands(self._force_control, self.forces), self.filters, self.payload, self.peripherals,
            self._faults, ProgramCommands(self.programs, self.motion), self,
        )  # fmt: skip
        self._parts: dict[type[c.Command], Any] = {row.message: part for part in parts for row in part.rows}
        """The part that carries out each command."""
        self.report = self._report(self.cycle.sample)
        """Report of the last tick, or of the arm at rest if it has not ticked yet or was placed somewhere since."""

    @property
    def declared(self) -> Payload:
        """Declared payload; that of a robot that is watched, if it says so."""
        declared = self.payload.declared
        return declared if self.watching is None else self.watching.declared(declared)

    @property
    def now(self) -> float:
        """Time of the present tick [s], which only ticks advance."""
        return self.tick_number * PERIOD

    @cached_property
    def arm(self) -> str:
        """Fingerprint of the arm that the robot file describes."""
        return fingerprint(self.setup.description)

    # ------------------------------------------------------------------ inputs

    def snapshot(self, time: float | None = None) -> Snapshot:
        """The present state that plans depend on; for a time, that of a path that goes on from the running motion."""
        return self.motion.snapshot(self.filters.present, self.programs.statements.last, time)

    def receive(
        self,
        command: c.Command,
        plan: Plan | None = None,
        session: str | None = None,
        origin: str | None = None,
    ) -> Reply:
        """Carry out a command between two ticks. A refused command changes nothing.

        Args:
            command: The command.
            plan: Plan for the command, if it was made beforehand; it is used if it still holds.
            session: Session of the client that gets control, if `client_gone` will report its end.
            origin: IP address of the machine that sent it, if known.
        """
        self.counters.commands += 1
        row = COMMANDS[type(command)]
        try:
            token: Any = getattr(command, "token", None)
            if row.lease == "needed" or (row.lease == "if named" and token is not None):
                self.session.renew(token, self.now)
            reply = self._carry_out(command, plan, session, origin)
        except (RefusalError, NoControlError) as refusal:
            self.counters.refused += 1
            return refusal.reply
        except PlantError as error:
            self._failed = error
            self.counters.refused += 1
            return Refused(code="plant_failure", where="", why=str(error))
        return Done() if reply is None else reply

    def _carry_out(
        self,
        command: c.Command,
        plan: Plan | None = None,
        session: str | None = None,
        origin: str | None = None,
    ) -> Reply | None:
        """Carry out a command of a client, or of a program; return None if its reply is `Done`.

        Raises:
            RefusalError: It cannot be carried out, and has changed nothing.
            NoControlError: Its sender may not send it.
        """
        if self.watching is not None and type(command) not in HARMLESS:
            raise RefusalError("wrong_mode", "", REFUSED)
        if self.supervision is not None:
            self.supervision.check(command)
        self._look_again()
        row, planned = COMMANDS[type(command)], partial(self.plans.found, command, plan)
        if row.check is not None:
            row.check(command, self.setup.description)
        call = Call(command, self.tick_number + 1, self.now, session, planned, origin)
        reply = row.handle(self._parts[type(command)], call)
        self.peripherals.changed |= row.changes_io
        return reply

    def receive_setpoint(
        self, setpoint: c.Setpoint | Unreadable | None, note: Callable[[], None] | None = None
    ) -> None:
        """Take a set-point. If it is not accepted, it is counted and dropped, since its sender expects no answer.

        Args:
            setpoint: The set-point; None for one that was not admitted.
            note: Notes it in the journal; called if it is of the client in control.
        """
        self._setpoints.receive(setpoint, self.now, note)

    def refuse_setpoint(self, why: str) -> None:
        """Count and drop a set-point of the client in control; if the stream falls silent, its end gives the reason."""
        self._setpoints.refuse(why)

    def client_gone(self, client: str, session: str) -> None:
        """Handle the end of a client's session, which ends the rights it held."""
        self._look_again()
        self.session.end_rights(client, session)

    def missed(self, ticks: int) -> None:
        """Count ticks that began too late."""
        self.counters.missed_ticks += ticks

    # ------------------------------------------------------------------ outputs

    @property
    def latest(self) -> State:
        """State of the last tick; see `report`."""
        return self.report.state

    def tick(self) -> tuple[State, list[Event]]:
        """Compute one control period."""
        self.begin_tick()
        report, events = self.complete_tick()
        return report.state, events

    def begin_tick(self) -> None:
        """Begin a control period: what has timed out ends, and programs have their turn.

        Its number is the next one, or that which a robot that is watched gives it.
        """
        if self.watching is not None:
            tick = self.watching.look()
            self.tick_number = max(self.tick_number, 0 if tick is None else tick - 1)
            self.counters.missed_ticks = self.watching.missed
            self.watching.tell_cycle()
        if self.supervision is not None:
            try:
                self.supervision.look()
            except PlantError as error:
                self._failed = error
            self.counters.missed_ticks = self.supervision.missed
        if self.now >= self._next_timeout:
            try:
                self._watch_time()
            except PlantError as error:  # a push that ends
                self._failed = error
        if not self.programs.idle:
            self._look_again()
            self.programs.advance(self.tick_number + 1)

    def complete_tick(self) -> tuple[Report, list[Event]]:
        """Compute the rest of a control period that has begun."""
        if self.watching is not None:
            return self._complete_watched(self.watching)
        failed, self._failed = self._failed, None
        try:
            if failed is not None:
                raise failed
            sensor = self._force_control.external
            sample = self.motion.step(None if sensor.latest is None else sensor.next())
            self._safety.watch_power(sample)
            if self.cell is not None:
                self.cell.tick(self.tick_number + 1, sample.measured.q)
        except PlantError as error:
            with suppress(PlantError):
                self._faults.clear()
            sample = self._safety.recover(error, self._seed)
            self.modes.changed = True
        self._safety.watch(sample)
        self.modes.update()
        self.tick_number += 1
        events, self._events = self._events, []
        self.report = self._report(sample)
        self.programs.steadiness.note(sample.measured.q, at_rest=self.cycle.mode.at_rest)
        return self.report, events

    def _complete_watched(self, watching: Watching) -> tuple[Report, list[Event]]:
        """Report what a robot that is watched said; nothing here judges it, since nothing here could stop it."""
        sample = watching.sample()
        self.tick_number += 1
        events, self._events = self._events, []
        self.report = self._report(sample)
        return self.report, events

    def _report(self, sample: Sample) -> Report:
        motion, cycle = self.motion, self.cycle
        return self._reporter.report(
            self.tick_number, sample, cycle.tvist, cycle.drives.delay, self.modes.now,
            motion.motions.speed if self.watching is None else self.watching.speed,
            motion.streams.sequence, self.counters.missed_ticks,
        )  # fmt: skip

    def _look_again(self) -> None:
        """Let the next tick see what has timed out, and what modes have become: a command may have changed both."""
        self._next_timeout, self.modes.changed = -math.inf, True

    def io(self, *, wrench: bool = True) -> Io:
        """Return inputs, outputs and registers as they are for the next tick.

        Args:
            wrench: Whether to compute the wrench at the tool, which takes a third of a tick.
        """
        said = self.watching or self.supervision
        estimated = wrench and said is None
        io = self.peripherals.io(
            self.tick_number + 1,
            self.payload.declared,
            self.motion.motions.asked_speed,
            self.programs.published,
            self.forces.wrench() if estimated else None,
            None if self.payload.assumed == self.payload.declared else self.payload.assumed,
        )
        return io if said is None else said.io(io, force=wrench)

    def changed_io(self) -> Io | None:
        """Return inputs, outputs and registers before a tick, if they changed since the last call; else None."""
        program, peripherals = self.programs.progress, self.peripherals
        if not peripherals.changed and program == self._told_program:
            return None
        peripherals.changed, self._told_program = False, program
        return self.io(wrench=False)

    def truth(self) -> Truth | None:
        """Return what a real robot cannot measure, after a tick; None if the plant has failed.

        Raises:
            ValueError: The plant does not provide it.
        """
        try:
            return self._reporter.truth(self.tick_number, with_modes=self.setup.truth)
        except PlantError as error:
            self._failed = error
            return None

    def fail(self, why: str) -> None:
        """Let the next tick deal with a failure of the plant that something outside the controller has seen."""
        self._failed = PlantError(why)

    def _emit(self, kind: EventKind, **fields: Unpack[Fields]) -> None:
        """Store an event of the tick that is being computed, or of the next one between two ticks."""
        event = Event(tick=self.tick_number + 1, kind=kind, **fields)
        self._events.append(event)
        self.modes.hear(event)
        self.programs.hear(event)

    def _watch_time(self) -> None:
        """End what has timed out or run its course, and note when something will next."""
        self._faults.end(self.tick_number + 1)
        self.session.watch(self.now)
        self._next_timeout = min(PERIOD * (self._faults.next_end - 1), self.session.ends)
        if self.setup.clock == "realtime":
            self.motion.watch(self.now)
            self._next_timeout = min(self._next_timeout, self.motion.streams.silent_at)
        self.modes.changed = True

    def _interrupt(self, why: str) -> None:
        """End the activities that need control, when no client has control any more."""
        self.programs.end(why)
        self.motion.interrupt(why)

    def _own_controller(self) -> tuple[Watching | None, Supervision | None]:
        """Return what follows a robot's own controller; see `watching` and `supervision`."""
        tools, set_tcp, plant = self.peripherals, self._reporter.set_tcp, self.cycle.plant
        if isinstance(plant, RealArm) and plant.watched:
            return Watching(plant, self.cycle, self.modes, tools, set_tcp, self._emit), None
        if isinstance(plant, RealArm) and plant.supervised:
            return None, Supervision(plant, self.motion, self._safety, tools, tools.set_tcp, self._emit)
        return None, None

    def _monitors(self) -> Sequence[Monitor]:
        """Return all that judges the signals of a tick, in this order."""
        description = self.setup.description
        overload = Overload(description.robot.joints, description.limits.torque)
        # An arm with a controller of its own is watched by that; here its torques may be guessed from currents.
        drives = () if self.cycle.plant.supervised else (overload,)
        return *drives, ShaperMonitor(self.cycle), self._force_control, self.payload.monitor

    def _access(self) -> Access:
        """What programs may use of the robot."""
        return Access(
            description=self.setup.description,
            motion=self.motion,
            guidance=self._force_control.guidance,
            peripherals=self.peripherals,
            emit=self._emit,
            send=self._carry_out,
            plans=self.plans,
            latest=lambda: self.latest,
            io=lambda: self.io(wrench=False),
            declared=lambda: self.declared,
            force=self._force_control,
            forces=self.forces,
            shape_guided=self.setup.shape_servo,
            cell=self.cell,
        )

    # ------------------------------------------------------------------ commands that concern the whole robot

    def place(self, call: Call[SimulationReset]) -> Reply:
        """Place the simulated arm somewhere at rest."""
        command, chosen, plant = call.command, call.planned(), self.cycle.plant
        if not isinstance(plant, SimulatedArm):
            name = type(plant).__name__
            raise RefusalError(
                "unknown_type", "type", f"the plant {name} cannot be put anywhere: it has no reset"
            )
        q = self.cycle.position if command.q is None else np.array(command.q, dtype=float)
        carried = None if command.payload is None else body(command.payload)
        if self.cell is not None:
            carried = carried or self.cell.empty
        placed = [] if carried is None else [carried]
        if command.q is not None:
            placed = [self.motion.collisions.declared, *(placed or [plant.payload])]
        blamed = "payload" if command.q is None and command.payload is not None else "q"
        self.motion.collisions.check_place(q, placed, blamed)
        met = plant.obstacle(q, carried)
        if met is not None:
            raise RefusalError("collision", blamed, f"{met}: choose a posture in which the arm is clear")
        self.programs.end("simulation.reset")
        self.motion.abandon("simulation.reset")
        self._faults.clear()
        if chosen is not None:
            self.filters.use(chosen)
        if command.seed is not None:
            self._seed = command.seed
        self.cycle.reset(q, carried=carried, seed=self._seed)
        if self.cell is not None and carried is not None:
            self.cell.begin(carried)
        self._safety.put(command.mode)
        if command.mode is not None:
            self.modes.forget_stops()
        self._reporter.forget_modes()
        self.modes.update()
        self.report = self._report(self.cycle.sample)
        self._force_control.begin_anew()
        self.programs.steadiness.forget()
        return Done(tick=self.tick_number)

    def check_step(self, call: Call[SimulationStep]) -> Reply:
        """Check that a client may advance time; the host then does so."""
        self.session.check_step(call.command, call.now)
        self._setpoints.check(call.command)
        return Done(tick=self.tick_number + call.command.ticks)


def _cycle(setup: Setup, first: PlannedFilter, plant: Plant | None) -> ControlCycle:
    """The control line with its arm.

    Raises:
        ValueError: The arm cannot be where it is to begin, or has no truth to report.
    """
    try:
        cycle = ControlCycle(
            setup.description, first.tvist, elastic=first.elastic, q=np.array(setup.q, dtype=float),
            declared=body(setup.payload), carried=body(setup.carried or setup.payload), seed=setup.seed, plant=plant,
            compensate_sag=setup.compensate_sag, law=first.law,
        )  # fmt: skip
    except PlantError as error:
        raise ValueError(str(error)) from error
    if setup.truth:
        truth_of(cycle.plant)  # raises now, not at the first tick
    return cycle
