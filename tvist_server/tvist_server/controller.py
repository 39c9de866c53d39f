"""The controller: messages in, replies, states and events out. It has no clock, socket, thread or log.

It owns a `Session` (who may) and a `ControlCycle` (what moves), which do not know each other.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Unpack

import numpy as np

from tvist_plant.fingerprint import fingerprint
from tvist_plant.plant import PERIOD, PlantError
from tvist_protocol import commands as c
from tvist_protocol.info import StopReason
from tvist_protocol.io import Io, SetIo, SetRegisters, SetTcp, SimulationSetInputs
from tvist_protocol.modes import RobotMode
from tvist_protocol.replies import Accepted, Done, Reply
from tvist_protocol.stream import Event, EventKind, State, Truth
from tvist_protocol.values import PROTOCOL_VERSION
from tvist_server.collision import CollisionModel
from tvist_server.cycle import ControlCycle, Sample
from tvist_server.events import Fields
from tvist_server.faults import Faults
from tvist_server.filters import Filters
from tvist_server.motion import MotionControl
from tvist_server.payload_monitor import PayloadMonitor
from tvist_server.peripherals import Peripherals
from tvist_server.planning.basis import Basis
from tvist_server.planning.filter_planner import PlannedFilter
from tvist_server.planning.planner import Plan, Planner
from tvist_server.refusal import RefusalError, check_content, check_joints, check_motion, payload_of
from tvist_server.reporting import Reporter
from tvist_server.safety_control import SafetyControl
from tvist_server.session import NoControlError, Session
from tvist_server.setup import Setup, body
from tvist_server.stepping import Stepping, check_step
from tvist_server.stop_reasons import StopReasons
from tvist_server.trajectory import Limits
from tvist_shaping.base import Filter


@dataclass
class Counters:
    """What was counted since the start."""

    commands: int = 0
    refused: int = 0
    setpoints_received: int = 0
    setpoints_refused: int = 0
    missed_ticks: int = 0


class Controller:
    """One robot.

    Args:
        setup: How it starts.

    Raises:
        ValueError: The setup is wrong.
    """

    def __init__(self, setup: Setup) -> None:
        setup.check()
        self.setup = setup
        self.tick_number = 0
        self.counters = Counters()
        self.declared = setup.payload
        self._events: list[Event] = []
        self._stop_reasons = StopReasons()
        self.session = Session(timeouts=setup.clock == "realtime")
        self.stepping = Stepping()
        self._planner = Planner(setup)
        self._plan: Plan | None = None
        self._client_session: str | None = None
        self.filters = Filters(setup, self._planner.filters, self._emit)
        self.cycle = ControlCycle(
            setup.description,
            self.filters.first,
            q=np.array(setup.q, dtype=float),
            declared=body(setup.payload),
            carried=body(setup.carried or setup.payload),
            seed=setup.seed,
        )
        self.filters.attach(self.cycle)
        self._reporter = Reporter(setup.description)
        self._seed = setup.seed
        collisions = CollisionModel(setup.description, body(setup.payload))
        self.motion = MotionControl(self.cycle, collisions, self._emit, setup.mode)
        self.safety = SafetyControl(self.motion, self._emit)
        self._faults = Faults(self.motion, self.safety)
        self._payload_monitor = PayloadMonitor(setup.description, body(setup.payload))
        self.peripherals = Peripherals()
        self._io_changed = True
        self.latest = self._state(self.cycle.standing)
        """State of the last tick; before the first, and where the arm was put somewhere since, how it stands there."""
        self.filters.warn_of_payload(self.declared)
        self.filters.warn_of_arm()

    @property
    def now(self) -> float:
        """Time of the present tick [s]; it passes by ticks alone."""
        return self.tick_number * PERIOD

    @cached_property
    def arm(self) -> str:
        """Fingerprint of the arm that the robot file describes."""
        return fingerprint(self.setup.description)

    @property
    def stop_reason(self) -> StopReason | None:
        """The stop that keeps the robot from moving; None: there is none."""
        return self._stop_reasons.present(self.motion.activity.robot_mode, self.motion.safety_mode)

    # ------------------------------------------------------------------ what comes in

    @property
    def basis(self) -> Basis:
        """What plans for commands depend on, as it is now."""
        on = self.filters.basis(self.declared)
        return Basis(on, self.motion.basis(on))

    def receive(self, command: c.Command, plan: Plan | None = None, session: str | None = None) -> Reply:
        """Carry out a command between two ticks. A refused one changes nothing.

        Args:
            command: The command.
            plan: For it, where it was planned beforehand; it must hold on `basis`.
            session: Of the client that it gives control to, where its going is told by `client_gone`.
        """
        self.counters.commands += 1
        self._plan, self._client_session = plan, session
        try:
            reply = _HANDLERS[type(command)](self, command)
        except RefusalError as refusal:
            reply = refusal.reply
        except NoControlError as refusal:
            reply = refusal.reply
        else:
            self._io_changed |= type(command) in _TOLD_IN_IO
            return reply
        self.counters.refused += 1
        return reply

    def receive_setpoint(self, setpoint: c.Setpoint) -> None:
        """Take a set-point; one that is not for us is counted and dropped: nobody waits for an answer."""
        lease = self.session.lease
        if lease is None or setpoint.token != lease.token:
            self._count_refused()  # a stranger's: it says nothing of the stream, and no journal has it
            return
        try:
            check_joints(setpoint.q, self.setup.description)
        except RefusalError as refusal:
            self.refuse_setpoint(refusal.reply.why)
            return
        if not self.motion.streaming:
            self.refuse_setpoint("no stream is running")
            return
        self.counters.setpoints_received += 1
        self.session.renew(setpoint.token, self.now)
        self.motion.offer(setpoint.sequence, np.array(setpoint.q, dtype=float), self.now)

    def refuse_setpoint(self, why: str) -> None:
        """Count and drop a set-point of the lease's holder; should the stream fall silent, its end names the reason."""
        self._count_refused()
        self.motion.refuse_setpoint(why)

    def _count_refused(self) -> None:
        self.counters.setpoints_received += 1
        self.counters.setpoints_refused += 1

    def client_gone(self, client: str, session: str) -> None:
        """A client's session has ended; where it held control, motion ends with it, and its hold of the clock ends."""
        self.stepping.client_gone(client, session)
        if self.session.client_gone(client, session):
            self._lose_lease(f"client {client!r} is gone")

    def missed(self, ticks: int) -> None:
        """Ticks have begun too late."""
        self.counters.missed_ticks += ticks

    # ------------------------------------------------------------------ what goes out

    def tick(self) -> tuple[State, list[Event]]:
        """One control period."""
        self._watch_time()
        try:
            sample = self.motion.step()
        except PlantError as error:
            self._faults.clear()
            sample = self.motion.recover(error, self._seed)
            self._payload_monitor.reset()
        self._watch_payload(sample)
        self.filters.watch()
        self._stop_reasons.update(self.motion.activity.robot_mode, self.motion.safety_mode)
        self.tick_number += 1
        events, self._events = self._events, []
        self.latest = self._state(sample)
        return self.latest, events

    def _state(self, sample: Sample) -> State:
        return self._reporter.state(
            self.tick_number,
            sample,
            self.cycle.tvist,
            robot_mode=self.motion.activity.robot_mode,
            safety_mode=self.motion.safety_mode,
            runtime=self.motion.runtime,
            speed=self.motion.speed,
            setpoint_sequence=self.motion.sequence,
            missed_ticks=self.counters.missed_ticks,
        )

    def io(self) -> Io:
        """Inputs, outputs and registers as they are for the next tick."""
        return self.peripherals.io(self.tick_number + 1, self.declared, self.motion.wanted_speed)

    def changed_io(self) -> Io | None:
        """Inputs, outputs and registers where they changed since this was asked last, before a tick; else None."""
        if not self._io_changed:
            return None
        self._io_changed = False
        return self.io()

    def truth(self) -> Truth:
        """What no robot can know, after a tick."""
        return self._reporter.truth(self.tick_number, self.cycle.arm)

    def _emit(self, kind: EventKind, **fields: Unpack[Fields]) -> None:
        """Put down an event of the tick that is being made; of the next one between two."""
        event = Event(tick=self.tick_number + 1, kind=kind, **fields)
        self._events.append(event)
        if kind in {"protective_stop", "safety_stop"}:
            self._stop_reasons.note(event, self.motion.safety_mode)

    def _watch_time(self) -> None:
        """End what is over, and what nobody keeps up."""
        self._faults.end(self.tick_number + 1)
        if self.session.expired(self.now):
            self._lose_lease("the lease ran out: no command renewed it")
        if self.setup.clock == "realtime":
            self.motion.watch(self.now)

    def _watch_payload(self, sample: Sample) -> None:
        """Say when the arm does not carry what was declared; where the brakes hold it, nobody can tell."""
        if self.motion.activity.robot_mode is RobotMode.RUNNING:
            why = self._payload_monitor.update(sample.target, sample.fed_forward, sample.measured.moment)
            if why is not None:
                self._emit("warning", code="payload_mismatch", why=why)

    def _lose_lease(self, why: str) -> None:
        self.session.release()
        self._emit("lease_lost", why=why)
        self.motion.interrupt(why)

    # ------------------------------------------------------------------ commands

    def take_control(self, command: c.TakeControl) -> Reply:
        """Give a lease."""
        _check_version(command.protocol)
        lease = self.session.take(command.client, command.lease_s, self.now, self._client_session)
        return Accepted(token=lease.token, lease_s=lease.seconds)

    def keep_alive(self, command: c.KeepAlive) -> Reply:
        """Renew the lease."""
        self._authorize(command.token)
        return Done()

    def hand_over(self, command: c.HandOver) -> Reply:
        """Give the lease to another client, who then takes control and gets a token of its own."""
        self._authorize(command.token)
        self.session.hand_over(command.client, self.now, self._client_session)
        return Done()

    def release_control(self, command: c.ReleaseControl) -> Reply:
        """End the lease, and motion with it."""
        self._authorize(command.token)
        self.session.release()
        self.motion.interrupt("control was released")
        return Done()

    def take_clock(self, command: c.TakeClock) -> Reply:
        """Give the clock, where time does not pass by itself."""
        _check_version(command.protocol)
        self._check_steppable()
        return Accepted(token=self.stepping.take(command.client, self._client_session).token)

    def release_clock(self, command: c.ReleaseClock) -> Reply:
        """Take it back."""
        self.stepping.release(command.token)
        return Done()

    def move_j(self, command: c.MoveJ) -> Reply:
        """Start a point-to-point motion."""
        self._authorize(command.token)
        check_content(command, self.setup.description)
        self.motion.check_move()
        return Accepted(id=self.motion.move(self._planned(command)))

    def servo_start(self, command: c.ServoStart) -> Reply:
        """Start to follow set-points."""
        self._authorize(command.token)
        check_motion(command.velocity, command.acceleration, command.jerk, self.setup.description)
        limits = Limits(command.velocity, command.acceleration, command.jerk)
        self.motion.follow(command.period, limits, self.now)
        return Done()

    def servo_stop(self, command: c.ServoStop) -> Reply:
        """Bring the stream to rest."""
        self._authorize(command.token)
        self.motion.end_stream()
        return Done()

    def stop(self, command: c.Stop) -> Reply:
        """Stop; anyone may."""
        if command.token is not None:
            self._authorize(command.token)
        self.motion.stop(command.deceleration, "a stop was commanded")
        return Done()

    def pause(self, command: c.Pause) -> Reply:
        """Bring the motion to a standstill on its way."""
        self._authorize(command.token)
        self.motion.pause()
        self.safety.stay_paused()
        return Done()

    def resume(self, command: c.Resume) -> Reply:
        """Go on with it."""
        self._authorize(command.token)
        self.motion.resume()
        return Done()

    def set_speed(self, command: c.SetSpeed) -> Reply:
        """Scale the time of motions."""
        self._authorize(command.token)
        self.motion.set_speed(command.fraction)
        return Done()

    def set_io(self, command: SetIo) -> Reply:
        """Set outputs."""
        self._authorize(command.token)
        self.peripherals.set_outputs(command)
        return Done()

    def set_registers(self, command: SetRegisters) -> Reply:
        """Write registers; input registers anyone may."""
        if command.token is not None:
            self._authorize(command.token)
        elif command.bank.startswith("output"):
            why = f"token is missing: {command.bank} registers are the robot's own, and take control to write"
            raise RefusalError("missing_field", "token", why)
        self.peripherals.set_registers(command)
        return Done()

    def set_tcp(self, command: SetTcp) -> Reply:
        """Say where the tool centre point is."""
        self._authorize(command.token)
        self.peripherals.tcp_offset = command.offset
        self._reporter.set_tcp(command.offset)
        return Done()

    def simulation_set_inputs(self, command: SimulationSetInputs) -> Reply:
        """Put signals on inputs."""
        self._authorize(command.token)
        self.peripherals.set_inputs(command)
        return Done()

    def power_on(self, command: c.PowerOn) -> Reply:
        """Power the arm, and release its brakes where that is wanted."""
        self._authorize(command.token)
        self.motion.power_on(release_brakes=command.release_brakes)
        self._payload_monitor.reset()
        return Done()

    def power_off(self, command: c.PowerOff) -> Reply:
        """Stop, then take the arm's power."""
        self._authorize(command.token)
        self.motion.power_off()
        return Done()

    def unlock_protective_stop(self, command: c.UnlockProtectiveStop) -> Reply:
        """Leave a protective stop."""
        self._authorize(command.token)
        self.motion.unlock()
        return Done()

    def restart_safety(self, command: c.RestartSafety) -> Reply:
        """Restart the safety system."""
        self._authorize(command.token)
        self.motion.safety.restart()
        return Done()

    def set_shaper(self, command: c.SetShaper) -> Reply:
        """Choose the shaper."""
        self._authorize(command.token)
        chosen: PlannedFilter = self._planned(command)
        self.motion.ahead.check_filter(chosen[1])
        self.filters.use(chosen)
        return Done()

    def set_estimator(self, command: c.SetEstimator) -> Reply:
        """Choose the estimator."""
        self._authorize(command.token)
        chosen: PlannedFilter = self._planned(command)
        self.motion.ahead.check_filter(chosen[1])
        self.filters.use(chosen)
        self.filters.warn_of_payload(self.declared)
        return Done()

    def set_payload(self, command: c.SetPayload) -> Reply:
        """Change what the controller believes that the arm carries."""
        self._authorize(command.token)
        check_content(command, self.setup.description)
        payload = payload_of(command)
        tvist: Filter | None = self._planned(command)
        self.motion.ahead.check_payload(body(payload), tvist)
        self.declared = payload
        self.cycle.declare(body(payload))
        self.filters.declare(payload, tvist)
        self._payload_monitor.declare(body(payload))
        return Done()

    def simulation_reset(self, command: c.SimulationReset) -> Reply:
        """Put the simulated arm somewhere at rest."""
        self._authorize(command.token)
        check_content(command, self.setup.description)
        chosen: PlannedFilter | None = self._planned(command)
        self.motion.abandon("simulation.reset")
        self._faults.clear()
        q = self.cycle.position if command.q is None else np.array(command.q, dtype=float)
        carried = None if command.payload is None else body(command.payload)
        if chosen is not None:
            self.filters.use(chosen)
        if command.seed is not None:
            self._seed = command.seed
        self.cycle.reset(q, carried=carried, seed=self._seed)
        self.motion.put(command.mode)
        if command.mode is not None:
            self._stop_reasons.forget()
        self.latest = self._state(self.cycle.standing)
        self._payload_monitor.reset()
        self._reporter.forget_modes()
        return Done(tick=self.tick_number)

    def simulation_step(self, command: c.SimulationStep) -> Reply:
        """Check that a client may let time pass; the driver then does."""
        check_step(self.stepping.hold, self.session.lease, command)
        if self.stepping.hold is None:
            self._authorize(command.token)
        self._check_steppable()
        if command.setpoints is not None and not self.motion.streaming:
            raise RefusalError("wrong_mode", "setpoints", "no stream is running: send servo_start first")
        setpoints = command.setpoints or ()
        if len(setpoints) > command.ticks:
            why = f"setpoints has {len(setpoints)} entries, one a tick; ticks is {command.ticks}"
            raise RefusalError("out_of_range", "setpoints", why, command.ticks)
        for number, setpoint in enumerate(setpoints):
            check_joints(setpoint.q, self.setup.description, f"setpoints[{number}].q")
        return Done(tick=self.tick_number + command.ticks)

    def _check_steppable(self) -> None:
        if self.setup.clock == "realtime":
            why = "time passes by itself here: start with --clock lockstep to step"
            raise RefusalError("wrong_mode", "type", why)

    def simulation_inject(self, command: c.SimulationInject) -> Reply:
        """Cause a fault."""
        self._authorize(command.token)
        self._faults.inject(command, self.tick_number + 1)
        return Done()

    def _authorize(self, token: str) -> None:
        self.session.renew(token, self.now)

    def _planned(self, command: c.Command) -> Any:
        """What was planned for a command, or is now.

        Raises:
            RefusalError: It cannot be done.
        """
        found = (self._plan or self._planner.plan(command, self.basis)).found
        if isinstance(found, RefusalError):
            raise found
        return found


def _check_version(protocol: int) -> None:
    if protocol != PROTOCOL_VERSION:
        why = f"protocol is {protocol}; this server speaks {PROTOCOL_VERSION}"
        raise RefusalError("unsupported_version", "protocol", why, PROTOCOL_VERSION)


_HANDLERS: dict[type, Callable[[Controller, Any], Reply]] = {
    c.TakeControl: Controller.take_control,
    c.TakeClock: Controller.take_clock,
    c.ReleaseClock: Controller.release_clock,
    c.KeepAlive: Controller.keep_alive,
    c.ReleaseControl: Controller.release_control,
    c.MoveJ: Controller.move_j,
    c.ServoStart: Controller.servo_start,
    c.ServoStop: Controller.servo_stop,
    c.Stop: Controller.stop,
    c.SetShaper: Controller.set_shaper,
    c.SetEstimator: Controller.set_estimator,
    c.SetPayload: Controller.set_payload,
    c.SimulationReset: Controller.simulation_reset,
    c.SimulationStep: Controller.simulation_step,
    c.HandOver: Controller.hand_over,
    c.Pause: Controller.pause,
    c.Resume: Controller.resume,
    c.SetSpeed: Controller.set_speed,
    c.PowerOn: Controller.power_on,
    c.PowerOff: Controller.power_off,
    c.UnlockProtectiveStop: Controller.unlock_protective_stop,
    c.RestartSafety: Controller.restart_safety,
    c.SimulationInject: Controller.simulation_inject,
    SetIo: Controller.set_io,
    SetRegisters: Controller.set_registers,
    SetTcp: Controller.set_tcp,
    SimulationSetInputs: Controller.simulation_set_inputs,
}
_TOLD_IN_IO = frozenset({c.SetPayload, c.SetSpeed, SetIo, SetRegisters, SetTcp, SimulationSetInputs})
"""Commands that change what `io` tells."""
