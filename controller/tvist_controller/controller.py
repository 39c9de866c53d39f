"""The controller: messages in; replies, states and events out; no clock, socket, thread or log."""

import math
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from tvist_controller.dispatch.planner import Planner
from tvist_controller.dispatch.rights import is_holders
from tvist_controller.dispatch.robot import RobotParts
from tvist_controller.dispatch.table import COMMANDS, HARMLESS
from tvist_controller.instruments.report import TRUE_MODES_EVERY, Report, true_modes, truth_message
from tvist_controller.line.line_tick import Sample
from tvist_controller.motion.setpoints import Unreadable
from tvist_controller.planning.plan import CommandCall, Order, Plan
from tvist_controller.refusal import RefusalError, wrong_mode
from tvist_controller.safety.own_controller import REFUSED
from tvist_controller.setup import Setup
from tvist_plant.foreign import arm_of
from tvist_plant.plant import PERIOD, Plant, PlantError
from tvist_protocol import commands as c
from tvist_protocol.io import Io
from tvist_protocol.replies import Done, Refused, Reply
from tvist_protocol.simulation import SimulationStep
from tvist_protocol.stream import Event, State, Truth


class Controller(RobotParts):
    """One robot.

    Args:
        setup: Initial setup.
        plant: Plant to control; None for the setup's plant, or the flexible arm if the setup has none.
        order: Callback that plans commands of programs outside the ticks; None to plan within the ticks.

    Raises:
        ValueError: The setup is invalid, or the plant does not fit it.
    """

    def __init__(self, setup: Setup, plant: Plant | None = None, order: Order | None = None) -> None:
        plant = setup.made_plant() if plant is None else arm_of(plant)
        setup = setup.standing(plant)
        setup.check(placed=plant is None or not (plant.watched or plant.supervised))
        self._failed: PlantError | None = None
        """Failure of the plant between two ticks, handled in the next one."""
        self._next_timeout = -math.inf  # time of the next possible timeout [s]
        super().__init__(setup, plant, Planner(setup), order)

    # ------------------------------------------------------------------ inputs

    def receive(
        self,
        command: c.Command,
        plan: Plan | None = None,
        session: str | None = None,
        origin: str | None = None,
    ) -> Reply:
        """Carry out a command between two ticks; a refused command changes nothing.

        Args:
            command: The command.
            plan: Plan made in advance, used if still valid.
            session: Session of a client that takes control, if `client_gone` will report its end.
            origin: IP address of the sender, if known.
        """
        self.counters.commands += 1
        row = COMMANDS[type(command)]
        try:
            token: Any = getattr(command, "token", None)
            if row.lease == "needed" or (row.lease == "if named" and token is not None):
                self.session.renew(token, self.now)
            reply = self.carry_out(command, plan, session, origin)
        except RefusalError as refusal:
            self.counters.refused += 1
            return refusal.reply
        except PlantError as error:
            self._failed = error
            self.counters.refused += 1
            return Refused(code="plant_failure", where="", why=str(error))
        return Done() if reply is None else reply

    def carry_out(
        self,
        command: c.Command,
        plan: Plan | None = None,
        session: str | None = None,
        origin: str | None = None,
    ) -> Reply | None:
        """Carry out a command; return None for the reply `Done`; raise RefusalError."""
        if self.watching is not None and type(command) not in HARMLESS:
            raise wrong_mode(REFUSED)
        if self.supervision is not None:
            self.supervision.check(command)
        if not isinstance(command, SimulationStep):  # a step changes nothing before its ticks
            self._look_again()
        row, planned = COMMANDS[type(command)], partial(self.plans.found, command, plan)
        if row.check is not None:
            row.check(command, self.setup.description)
        reply = row.handle(
            self, CommandCall(command, self.tick_number + 1, self.now, session, planned, origin)
        )
        self.peripherals.changed |= row.changes_io
        return reply

    def receive_setpoint(
        self, setpoint: c.Setpoint | Unreadable | None, note: Callable[[], None] | None = None
    ) -> None:
        """Take a set-point, or count a refused one (None). `note` journals it if its sender has control."""
        self.counters.setpoints_received += 1
        if setpoint is None or not is_holders(self.session.lease, setpoint.token):
            self.counters.setpoints_refused += 1  # not part of the stream or the journal
            return
        if note is not None:
            note()
        if self.motion.streams.take(setpoint, self.now) and setpoint.token is not None:
            self.session.renew(setpoint.token, self.now)
        else:
            self.counters.setpoints_refused += 1

    def client_gone(self, client: str, session: str) -> None:
        """End the rights of a client whose session has ended."""
        self._look_again()
        self.session.end_rights(client, session)

    def fail(self, why: str) -> None:
        """In the next tick, handle a plant failure that was detected outside the controller."""
        self._failed = PlantError(why)

    # ------------------------------------------------------------------ ticks

    def tick(self) -> tuple[State, list[Event]]:
        """Compute one control period."""
        self.begin_tick()
        report, events = self.complete_tick()
        return report.state, events

    def begin_tick(self) -> None:
        """Begin a control period: take a watched robot's tick number, handle timeouts, and run programs."""
        if self.watching is not None:
            tick = self.watching.look()
            self.tick_number = max(self.tick_number, 0 if tick is None else tick - 1)
            self.counters.missed_ticks = self.watching.missed
            self.watching.tell_cycle()
        if self.supervision is not None:
            try:
                self.supervision.look()
            except PlantError as error:  # leases still expire while the plant does not answer
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
        sample = self._step() if self.watching is None else self.watching.sample()
        self.tick_number += 1
        events, self.events = self.events, []
        self.report = self.reported(sample)
        return self.report, events

    def _step(self) -> Sample:
        motion, failed, self._failed = self.motion, self._failed, None
        try:
            if failed is not None:
                raise failed
            force = self.force_control
            sample = motion.step(None if force.external.latest is None else force.sensed())
            self.safety.watch_power(sample)
            if self.cell is not None:
                self.cell.tick(self.tick_number + 1, sample.measured.q)
        except PlantError as error:
            with suppress(PlantError):
                self.faults.clear()
            sample = self.safety.recover(error, self.seed)
            motion.changed = True
        self.safety.watch(sample)
        if motion.changed:
            self.modes.update()
        motion.note(sample)
        return sample

    def _look_again(self) -> None:
        """Check timeouts and modes in the next tick, since a command may have changed them."""
        self._next_timeout, self.motion.changed = -math.inf, True

    def _watch_time(self) -> None:
        """End everything that has timed out, and store the time of the next timeout."""
        self.faults.end(self.tick_number + 1)
        self.session.watch(self.now)
        self._next_timeout = min(PERIOD * (self.faults.next_end - 1), self.session.ends)
        if self.setup.clock == "realtime":
            self.motion.watch(self.now)
            self._next_timeout = min(self._next_timeout, self.motion.streams.silent_at)
        self.motion.changed = True

    # ------------------------------------------------------------------ outputs

    def changed_io(self) -> Io | None:
        """Return inputs, outputs and registers if they changed since the last call, else None."""
        if not self.peripherals.changed:
            return None
        self.peripherals.changed = False
        return self.io(wrench=False)

    def truth(self) -> Truth | None:
        """Return what a real robot cannot measure; None if the plant has failed.

        Raises:
            ValueError: The plant does not provide it.
        """
        plant = self.cycle.plant
        try:
            if self.setup.truth and (not self.true_modes or self.tick_number % TRUE_MODES_EVERY == 0):
                self.true_modes = true_modes(plant, self.setup.description.joints)
            return truth_message(plant, self.tick_number, self.true_modes)
        except PlantError as error:
            self._failed = error
            return None
