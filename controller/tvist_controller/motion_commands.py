"""Commands that move, stop and power the arm."""

from typing import Any

from tvist_controller.command_row import Call, Row
from tvist_controller.motion import MotionControl
from tvist_controller.planning.move_planner import PlannedMove
from tvist_controller.planning.plan import MOTIONS
from tvist_controller.programs.player import ProgramPlayer
from tvist_controller.refusal import check_content, check_motion
from tvist_controller.safety_control import SafetyControl
from tvist_controller.trajectory import MotionLimits
from tvist_protocol import commands as c
from tvist_protocol.channels import tag
from tvist_protocol.replies import Accepted, Reply


class MotionCommands:
    """Handlers of the commands for motion.

    Args:
        motion: The robot's motion.
        safety: Carries out the safety system's stops.
        programs: The program, which ends with every stop and loss of power.
    """

    def __init__(self, motion: MotionControl, safety: SafetyControl, programs: ProgramPlayer) -> None:
        self._motion, self._safety, self._programs = motion, safety, programs
        self._description = motion.cycle.description
        self.rows = (
            *(Row(kind, self._move) for kind in MOTIONS),
            Row(c.ServoStart, self._servo_start),
            Row(c.ServoStop, lambda _: motion.end_stream()),
            Row(c.Stop, self._stop, lease="if named"),
            Row(c.Pause, self._pause),
            Row(c.Resume, lambda _: motion.resume()),
            Row(c.SetSpeed, self._set_speed, changes_io=True),
            Row(c.PowerOn, self._power_on),
            Row(c.PowerOff, self._power_off),
            Row(c.UnlockProtectiveStop, lambda _: safety.unlock()),
            Row(c.RestartSafety, lambda _: motion.safety.restart()),
        )

    def _move(self, call: Call[Any]) -> Reply:
        check_content(call.command, self._description)
        trigger = tag(type(call.command))
        self._motion.check(trigger)
        planned: PlannedMove = call.planned()
        limited = None if planned.limited is None else planned.limited[1]
        return Accepted(id=self._motion.move(planned, trigger), limited=limited)

    def _servo_start(self, call: Call[c.ServoStart]) -> None:
        command = call.command
        check_motion(command.velocity, command.acceleration, command.jerk, self._description)
        limits = MotionLimits(command.velocity, command.acceleration, command.jerk)
        self._motion.follow(command.period, limits, call.now)

    def _stop(self, call: Call[c.Stop]) -> None:
        why = "a stop was commanded"
        self._programs.stop_moving(why)
        self._motion.stop(call.command.deceleration, why)

    def _pause(self, _: Call[c.Pause]) -> None:
        self._motion.pause()
        self._safety.stay_paused()

    def _set_speed(self, call: Call[c.SetSpeed]) -> None:
        self._motion.motions.set_speed(call.command.fraction)

    def _power_on(self, call: Call[c.PowerOn]) -> None:
        self._safety.power_on(release_brakes=call.command.release_brakes)

    def _power_off(self, _: Call[c.PowerOff]) -> None:
        why = "power_off was commanded"
        self._programs.end(why)
        self._motion.end("power_off", why, category=1)
