"""Robot mode, safety mode and runtime state, looked up again only when they may have changed."""

from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.safety.stop_reasons import StopReasons
from tvist_protocol.info import StopReason
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity


class RobotModes:
    """The modes of a robot, and the stop that keeps it from moving.

    Args:
        motion: The robot's motion, from which they follow.
    """

    def __init__(self, motion: MotionControl) -> None:
        self._motion, self._reasons = motion, StopReasons()
        self.changed = True
        """Whether a command, an event or a program may have changed them since the last update."""
        self.now = 0, 0, 0
        """Robot mode, safety mode and runtime state."""
        self.update()

    def update(self) -> None:
        """Look them up, if they may have changed; to be called in every tick."""
        motion = self._motion
        if not (self.changed or motion.changed):
            return
        robot, safety = motion.robot_mode, motion.safety_mode
        self._reasons.update(robot, safety)
        self.now = int(robot), int(safety), int(motion.runtime)
        # A paused motion comes to a standstill without any event.
        self.changed, motion.changed = motion.activity is Activity.PAUSED, False

    def hear(self, event: Event) -> None:
        """Take an event, which may be a stop or end one."""
        self.changed = True
        if event.kind in {"protective_stop", "safety_stop"}:
            self._reasons.note(event, self._motion.safety_mode)

    @property
    def stop_reason(self) -> StopReason | None:
        """The stop that keeps the robot from moving; None if there is none."""
        return self._reasons.present(self._motion.robot_mode, self._motion.safety_mode)

    def forget_stops(self) -> None:
        """Discard all stops, since the robot was set to a mode."""
        self._reasons.forget()
