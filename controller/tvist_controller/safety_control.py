"""Actions of the safety system: reduced speed, and stops of UR's categories 0, 1 and 2."""

from tvist_controller.events import Emit
from tvist_controller.motion import MotionControl
from tvist_controller.safety import REDUCED_SHARE
from tvist_controller.safety_system import Emergency, Latched
from tvist_protocol.transitions import Activity, after


class SafetyControl:
    """Carries out what the safety system's inputs request and what its faults require.

    Args:
        motion: The robot's motion.
        emit: Emits events.
    """

    def __init__(self, motion: MotionControl, emit: Emit) -> None:
        self._motion, self._emit = motion, emit
        self._goes_on = False
        """Whether the motion that a safeguard has paused resumes by itself when the safeguard is released."""

    def reduce(self, *, reduced: bool) -> None:
        """Slow motions down, or let them speed up again; stop a stream, since its client determines its timing."""
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
        """Stop with category 2, or allow motion again: a motion pauses and later resumes, a stream ends.

        Args:
            stopped: Whether the safeguard requests the stop.
        """
        motion, system = self._motion, self._motion.safety
        if stopped == system.safeguard:
            return
        system.safeguard = stopped
        if not stopped:
            if self._goes_on and motion.activity is Activity.PAUSED:
                motion.resume()
            self._goes_on = False
            return
        why = "a safeguard asked for a stop"
        if not motion.activity.moving:
            # Although nothing moves and nothing ends, this now keeps the robot from moving.
            self._emit("safety_stop", why=why, category=2, duration=0.0, way=0.0)
            return
        if after(motion.activity, "pause") is None:
            motion.end("interruption", why, kind="safety_stop", category=2)
            return
        self._goes_on = motion.activity is Activity.MOVING
        motion.pause()
        duration, way = motion.ahead.until_rest()
        self._emit("safety_stop", why=why, category=2, duration=duration, way=way)

    def stay_paused(self) -> None:
        """Note that a client has paused the motion as well, which then waits for its `resume`."""
        self._goes_on = False

    def emergency(self, whose: Emergency) -> None:
        """Stop with category 1: on the path, then without power until it is released."""
        pressed = self._motion.safety.emergencies
        if whose not in pressed:
            pressed.add(whose)
            why = f"the {whose}'s emergency stop was pressed"
            self._motion.end("power_off", why, kind="safety_stop", category=1)

    def end_emergency(self, whose: Emergency) -> None:
        """Release an emergency stop; the power stays off until it is switched on again."""
        self._motion.safety.emergencies.discard(whose)

    def release(self) -> None:
        """Release all inputs: speed, safeguard and emergency stops."""
        self.reduce(reduced=False)
        self.safeguard(stopped=False)
        self._motion.safety.emergencies.clear()

    def cut_power(self, why: str, latched: Latched | None = None) -> None:
        """Stop with category 0: the brakes close at once.

        Args:
            why: The reason, for people.
            latched: Violation or fault that the safety system latches until it is restarted; None if there is none.
        """
        if latched is not None:
            self._motion.safety.latched = latched
        self._motion.brake(why)
