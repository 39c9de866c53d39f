"""The parts of one robot and their connections."""

from abc import ABC, abstractmethod
from functools import cached_property
from typing import Unpack

import numpy as np

from tvist_controller.cell.live_cell import LiveCell
from tvist_controller.dispatch.line_parameters import LineParameters
from tvist_controller.dispatch.rights import Authority
from tvist_controller.events import Counters, Fields
from tvist_controller.foresight.collision import CollisionModel
from tvist_controller.instruments.peripherals import Peripherals
from tvist_controller.instruments.report import Report, truth_of
from tvist_controller.instruments.tool_forces import ToolForces
from tvist_controller.line.cycle import ControlCycle
from tvist_controller.line.line_tick import Sample
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.force_control import ForceControl
from tvist_controller.motion.guidance import Guidance
from tvist_controller.motion.monitors import Monitor, ShaperMonitor, TorqueOverload
from tvist_controller.planning.filter_planner import FilterChoice
from tvist_controller.planning.plan import Order, Plan, PlannerLike, Plans
from tvist_controller.planning.snapshot import PlanningState
from tvist_controller.programs.access import Access
from tvist_controller.programs.player import ProgramPlayer
from tvist_controller.safety.faults import Faults
from tvist_controller.safety.own_controller import Supervision, Watching
from tvist_controller.safety.robot_modes import RobotModes
from tvist_controller.safety.safety_control import SafetyControl
from tvist_controller.setup import Setup, body
from tvist_plant.description import fingerprint
from tvist_plant.plant import PERIOD, Plant, PlantError, RealArm
from tvist_protocol import commands as c
from tvist_protocol.io import Io
from tvist_protocol.replies import Reply
from tvist_protocol.stream import Event, EventKind, State
from tvist_protocol.values import Payload


class RobotParts(ABC):
    """The parts of one robot, on which commands act; a `Controller` creates them."""

    def __init__(self, setup: Setup, plant: Plant | None, planner: PlannerLike, order: Order | None) -> None:
        self.setup = setup  # initial setup; if the arm cannot be placed, `q` is its measured initial posture
        self.tick_number = 0
        self.counters = Counters()
        self.events: list[Event] = []  # events of the present tick, or of the next one between ticks
        self.plans = Plans(planner.plan, self.snapshot, order)  # access to plans
        first, timeouts, description = planner.filters.first(), setup.clock == "realtime", setup.description
        self.cycle = _cycle(setup, first, plant)
        plant = self.cycle.plant
        self.seed = setup.seed  # seed for the next reset of a simulated arm
        # A robot that is only watched cannot be moved.
        mode = "POWER_OFF" if plant.watched else setup.mode
        collisions = CollisionModel(description, body(setup.payload))
        self.motion = motion = MotionControl(self.cycle, collisions, self.emit, mode)
        self.modes = RobotModes(motion)
        self.session = Authority(self._interrupt, self.emit, realtime=timeouts, instance=setup.instance)
        """Rights to control the robot and to advance time."""
        self.safety = safety = SafetyControl(motion, self.emit)
        self.faults = Faults(motion, safety)
        self.peripherals = Peripherals(motion.set_tcp)
        self.watching: Watching | None = None
        self.supervision: Supervision | None = None
        """Interface to the robot's own controller, if it is only watched, or moved through it; else None."""
        if isinstance(plant, RealArm) and plant.watched:
            self.watching = Watching(plant, self.peripherals, self.emit, self.cycle, self.modes)
        elif isinstance(plant, RealArm) and plant.supervised:
            self.supervision = Supervision(plant, self.peripherals, self.emit, motion, safety)
        self.forces = ToolForces(description, self.peripherals, lambda: self.report, lambda: self.declared)
        self.cell = None  # the cell around the robot; None for none
        if setup.cell is not None:
            self.cell = LiveCell(setup.cell, description, plant, self.peripherals, self.emit)
        self.guidance = Guidance(motion)
        self.force_control = ForceControl(self.guidance, self.forces, timeouts=timeouts)
        self.programs = ProgramPlayer(self._access(), safety)
        self.assumed = LineParameters(
            setup.payload, first.source, motion, self.peripherals, planner.for_lesson, self.emit,
            follows=setup.adapt == "payload",
        )  # fmt: skip
        """Payload and filter in use."""
        safety.monitors = self._monitors()
        self.true_modes: dict[str, list[float]] = {}
        """The arm's true modes, computed at intervals; empty to recompute them for the next truth."""
        self.report = self.reported(self.cycle.sample)
        """Report of the last tick, or of the arm at rest if it has not ticked yet or was reset since."""

    def _monitors(self) -> tuple[Monitor, ...]:
        description = self.setup.description
        overload = TorqueOverload(description.robot.joints, description.limits.torque)
        # A driven arm's own controller monitors its torques; those reported here may be estimates from currents.
        drives = () if self.cycle.plant.supervised else (overload,)
        return *drives, ShaperMonitor(self.cycle), self.force_control, self.assumed.monitor

    def _access(self) -> Access:
        return Access(
            description=self.setup.description, motion=self.motion, guidance=self.guidance,
            peripherals=self.peripherals, emit=self.emit, send=self.carry_out, plans=self.plans,
            latest=lambda: self.latest, io=lambda: self.io(wrench=False), declared=lambda: self.declared,
            force=self.force_control, forces=self.forces, shape_guided=self.setup.shape_servo, cell=self.cell,
        )  # fmt: skip

    @abstractmethod
    def carry_out(self, command: c.Command, plan: Plan | None = None) -> Reply | None:
        """Carry out a command of a program; see `Controller.receive`."""

    @property
    def latest(self) -> State:
        """State of the last tick; see `report`."""
        return self.report.state

    @property
    def declared(self) -> Payload:
        """Declared payload; for a watched robot, the payload that it reports, if any."""
        declared = self.assumed.declared
        return declared if self.watching is None else self.watching.declared(declared)

    @property
    def now(self) -> float:
        """Time of the present tick; only ticks advance it [s]."""
        return self.tick_number * PERIOD

    @cached_property
    def arm(self) -> str:
        """Fingerprint of the arm that the robot file describes."""
        return fingerprint(self.setup.description)

    def snapshot(self, time: float | None = None) -> PlanningState:
        """Return the state for plans; if `time` [s] is given, for extending the running motion after it."""
        return self.motion.snapshot(self.assumed.present(), self.programs.statements.last, time)

    def io(self, *, wrench: bool = True) -> Io:
        """Return inputs, outputs and registers for the next tick; the tool wrench costs a third of a tick."""
        said, payload = self.watching or self.supervision, self.assumed
        io = self.peripherals.io(
            self.tick_number + 1, payload.declared, self.motion.motions.asked_speed, self.programs.published,
            self.forces.wrench() if wrench and said is None else None,
            None if payload.assumed == payload.declared else payload.assumed,
        )  # fmt: skip
        return io if said is None else said.io(io, force=wrench)

    def reported(self, sample: Sample) -> Report:
        """Return the report of a tick."""
        motion, cycle, tvist = self.motion, self.cycle, self.cycle.tvist
        stream = motion.streams.stream
        return Report(
            self.tick_number, sample, self.modes.now,
            motion.motions.speed if self.watching is None else self.watching.speed,
            tvist.f_d, tvist.zeta, tvist.delay + cycle.drives.delay, tvist.clipped,
            None if stream is None else stream.sequence,
            self.counters.missed_ticks, motion.tool,
        )  # fmt: skip

    def emit(self, kind: EventKind, **fields: Unpack[Fields]) -> None:
        """Store an event of the present tick; an event between two ticks belongs to the next tick."""
        event = Event(tick=self.tick_number + 1, kind=kind, **fields)
        self.events.append(event)
        self.modes.hear(event)
        self.programs.hear(event)

    def _interrupt(self, why: str) -> None:
        self.programs.end(why)
        self.motion.interrupt(why)


def _cycle(setup: Setup, first: FilterChoice, plant: Plant | None) -> ControlCycle:
    """Create control line and arm; raise ValueError if the start is invalid or no truth can be published."""
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
