"""Actions of the safety system: reduced speed, stops of categories 0, 1 and 2, power, protective stops."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from tvist_controller.events import Emit
from tvist_controller.foresight.stops import StopPlan
from tvist_controller.line.differentiator import Target
from tvist_controller.line.limits import REDUCED_SHARE
from tvist_controller.line.line_tick import Sample
from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.motion.monitors import Monitor
from tvist_controller.motion.safety_system import PUT, Emergency, Latched, at_rest
from tvist_controller.refusal import wrong_mode
from tvist_controller.trajectory import Compliant, SampledPositions
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, payload_inertia, rigid_model
from tvist_plant.plant import PERIOD, Halt, PlantError, SimulatedArm
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.transitions import Activity, after
from tvist_protocol.values import ResetMode

HOLD = 1.25  # least ratio of a brake's torque to the load by gravity and other joints [-]
LONGEST_BRAKING = 5.0  # time after which the arm counts as stopped [s]


class SafetyControl:
    """Carries out safety inputs, reactions to faults, and changes of power."""

    def __init__(self, motion: MotionControl, emit: Emit) -> None:
        self._motion, self._emit = motion, emit
        self.monitors: Sequence[Monitor] = ()
        self._held = True
        self._resumes_by_itself = False  # whether a motion paused by a safeguard resumes when it is released

    def reduce(self, *, reduced: bool) -> None:
        """Begin or end reduced speed; stop a stream that may be too fast, since its client sets the speed."""
        motion, system = self._motion, self._motion.safety
        if reduced == system.reduced:
            return
        system.reduced = reduced
        motion.motions.keep_rate()
        stream, most = motion.streams.stream, motion.motions.slowest
        if stream is not None and most is not None and stream.limits.velocity > most:
            motion.stop(None, "speed was reduced", "limit_velocity")
        share = f"{100 * REDUCED_SHARE:g} % of the joints' limits" if reduced else "no longer reduced"
        self._emit("warning", why=f"safety_mode is {motion.safety_mode.name}: speed is {share}")

    def safeguard(self, *, stopped: bool) -> None:
        """Begin or end a safeguard stop of category 2, which pauses a motion and ends a stream."""
        motion, system = self._motion, self._motion.safety
        if stopped == system.safeguard:
            return
        system.safeguard = stopped
        if not stopped:
            if self._resumes_by_itself and motion.activity is Activity.PAUSED:
                motion.resume()
            self._resumes_by_itself = False
            return
        why = "a safeguard asked for a stop"
        if not motion.activity.moving:
            # No motion ends, but from now on the safeguard blocks motion.
            self._emit("safety_stop", why=why, category=2, duration=0.0, way=0.0)
            return
        if after(motion.activity, "pause") is None:
            motion.end("interruption", why, kind="safety_stop", category=2)
            return
        self._resumes_by_itself = motion.activity is Activity.MOVING
        motion.pause()
        duration, way = motion.ahead.until_rest()
        self._emit("safety_stop", why=why, category=2, duration=duration, way=way)

    def stay_paused(self) -> None:
        """Keep a motion paused until the client's `resume`, even if the safeguard stop ends before."""
        self._resumes_by_itself = False

    def emergency(self, whose: Emergency) -> None:
        """Stop with category 1: on the path, then power off until released."""
        pressed = self._motion.safety.emergencies
        if whose not in pressed:
            pressed.add(whose)
            why = f"the {whose}'s emergency stop was pressed"
            self._motion.end("power_off", why, kind="safety_stop", category=1)

    def release(self) -> None:
        """Release reduced speed, safeguard and emergency stops."""
        self.reduce(reduced=False)
        self.safeguard(stopped=False)
        self._motion.safety.emergencies.clear()

    # ------------------------------------------------------------------ power, brakes and protective stops

    def power_on(self, *, release_brakes: bool = True) -> None:
        """Power the arm and release its brakes, if wanted; raise RefusalError if not possible now."""
        motion = self._motion
        trigger, held = "power_on" if release_brakes else "power", motion.robot_mode is RobotMode.RUNNING
        motion.check(trigger)
        if not held:
            self._hold()
        motion.go(trigger)

    def _hold(self) -> None:
        """Before the drives hold the arm, start the line at its position; RefusalError if impossible."""
        try:
            self._begin_where_it_stands()
        except ValueError as error:
            raise wrong_mode(str(error)) from error
        if self._motion.power is not None:
            self._motion.power.halted = None

    def _begin_where_it_stands(self) -> None:
        """Start the line at the position of an arm that cannot be placed; raise ValueError if unknown.

        Its position may differ from the line's: without power it may be moved or sink, and brakes stop it
        anywhere.
        """
        cycle = self._motion.cycle
        if not isinstance(cycle.plant, SimulatedArm):
            cycle.reset(cycle.position)

    def cut_power(self, why: str, latched: Latched | None = None) -> None:
        """Stop with category 0: power off and brakes closed; latch a violation or fault until a restart."""
        motion, cycle, plan = self._motion, self._motion.cycle, None
        if latched is not None:
            motion.safety.latched = latched
        if motion.power is not None:
            motion.power.stop()
        target = after(motion.activity, "brakes")
        motion.activity = target or motion.activity
        if target is not None and not cycle.mode.at_rest:
            stop = brake(cycle.description, cycle.plant.payload, cycle.newest)
            way = float(np.abs(stop.end - cycle.position).max())
            plan = StopPlan(None, None, limited=False, duration=stop.duration, way=way)
            motion.stopper.brake(stop)
        motion.tell_end(plan, why, None, "safety_stop", 0)

    def unlock(self) -> None:
        """Unlock a protective stop; raise RefusalError without one, or while still stopping."""
        power = self._motion.power
        if power is not None and power.halted is not None:
            self._motion.check("unlock_protective_stop")
            self._hold()
        self._motion.go("unlock_protective_stop")
        for monitor in self.monitors:  # ignore findings before the unlock
            if monitor.needs == "drives":
                monitor.restart()

    def watch(self, sample: Sample) -> None:
        """Let the monitors check the latest tick; warn or stop the arm according to their findings."""
        motion = self._motion
        held = motion.robot_mode is RobotMode.RUNNING
        if held and not self._held:
            self._restart_monitors()
        self._held = held
        for monitor in self.monitors:
            if not monitor.awake and sample.measured.wrench is None:
                continue
            if monitor.needs != "nothing" and (
                not held
                or (monitor.needs == "drives alone" and isinstance(motion.cycle.trajectory, Compliant))
            ):
                continue
            if (found := monitor.look(sample)) is None:
                continue
            if found.then == "protective_stop":
                motion.protect(found.why, found.code)
            elif found.then == "interruption":
                motion.interrupt(found.why, found.code)
            else:
                self._emit("warning", code=found.code, why=found.why)

    def _restart_monitors(self) -> None:
        for monitor in self.monitors:
            monitor.restart()

    def watch_power(self, sample: Sample) -> None:
        """Stop an arm that reports trouble. If drives have just begun to hold it, restart the line there."""
        motion = self._motion
        if motion.power is not None:
            held = motion.power.halted is None
            trouble = motion.power.trouble(motion.robot_mode, sample.measured)
            if held and motion.power.halted is not None:
                self._let_go(motion.power.halted, sample)
            elif trouble is not None and motion.safety.latched is None:
                self.cut_power(trouble, "fault")
            elif motion.power.begun and motion.cycle.mode.at_rest:
                try:
                    self._begin_where_it_stands()
                except ValueError as error:
                    self.cut_power(str(error), "fault")

    def _let_go(self, halt: Halt, sample: Sample) -> None:
        """End all motion at once, because the arm's own controller has stopped it."""
        motion = self._motion
        motion.abandon(halt.why)
        motion.cycle.reset(sample.measured.q, measured=sample.measured)
        protective = halt.safety_mode == SafetyMode.PROTECTIVE_STOP
        motion.activity = Activity.PROTECTIVE_STOP if protective else Activity.POWER_OFF
        self._emit("protective_stop" if protective else "safety_stop", why=halt.why)

    def recover(self, error: PlantError, seed: int) -> Sample:
        """Recover from a failed arm: place a simulated arm at rest at its reference, in a protective stop.

        An arm that cannot be placed or fails again at once has no power until the safety system is restarted.
        """
        motion, cycle = self._motion, self._motion.cycle
        placed = isinstance(cycle.plant, SimulatedArm)
        why, position = str(error), cycle.position
        try:
            sample = cycle.reset(position, seed=seed)
            if placed:
                sample = cycle.step()
        except (ValueError, PlantError):  # still failing; `power_on` tries again
            placed, sample = False, cycle.reset(position, measured=cycle.sample.measured)
        if placed:
            why = f"{why}: the simulation put the arm at rest at its reference"
        motion.abandon(why, "plant_failure")
        self._restart_monitors()
        if not placed:
            if motion.power is not None:
                motion.power.stop()
            motion.activity = Activity.POWER_OFF
            if motion.safety.latched is None:  # while an arm does not answer, every tick fails
                motion.safety.latched = "fault"
                self._emit("safety_stop", code="plant_failure", why=why, category=0)
            return sample
        if after(motion.activity, "plant_failure") is not None:
            motion.go("plant_failure")
        self._emit("protective_stop", code="plant_failure", why=why)
        return sample

    def put(self, mode: ResetMode | None) -> None:
        """Set the robot mode after a reset; None keeps the present mode, at rest."""
        motion = self._motion
        if mode is not None:
            motion.activity = PUT[mode]
            motion.safety.clear()
        else:
            motion.activity = at_rest(motion.activity, emergency=bool(motion.safety.emergencies))
        self._restart_monitors()


def brake(description: RobotDescription, carried: Payload, state: Target) -> SampledPositions:
    """Simulate the rigid arm under its brakes from a state of motion, tick by tick.

    Each joint is slowed down by its brake, assumed as strong as its drive, and stays at rest afterwards. With rotors:

        (M(q) + B) q̈ + C(q, q̇) q̇ + g(q) = -τ_b sgn(q̇)    over the joints that still turn.

    Brakes do not follow a path, so the arm leaves its path.
    """
    model = rigid_model(description, Payload())
    if carried.mass > 0.0:
        flange = model.frames[model.getFrameId(FLANGE)]
        model.inertias[flange.parentJoint] += flange.placement.act(payload_inertia(carried))
    data = model.createData()
    rotor, strength = np.array(description.drives.rotor_inertia), np.array(description.limits.torque)
    q, qd = state.q.copy(), state.qd.copy()
    positions = [q]
    turning = np.abs(qd) > 0.0
    for _ in range(round(LONGEST_BRAKING / PERIOD)):
        if not turning.any():
            break
        mass = np.array(pin.crba(model, data, q, pin.Convention.WORLD)) + np.diag(rotor)
        bias = np.array(pin.nonLinearEffects(model, data, q, qd))
        torque = np.maximum(strength, HOLD * np.abs(bias)) * np.sign(qd) + bias
        free = np.flatnonzero(turning)
        new = np.zeros_like(qd)
        new[free] = qd[free] - PERIOD * np.linalg.solve(mass[np.ix_(free, free)], torque[free])
        turning &= new * qd > 0.0
        new[~turning] = 0.0
        qd = new
        q = q + PERIOD * qd
        positions.append(q)
    return SampledPositions(positions[1:] or positions)
