"""Robot mode, safety mode and runtime state, and why a robot stands, for clients that connect after the event."""

from tvist_controller.motion.activity_control import MotionControl
from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import Event
from tvist_protocol.transitions import Activity

_MAY_MOVE = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED})
_EMERGENCIES = frozenset({SafetyMode.ROBOT_EMERGENCY_STOP, SafetyMode.SYSTEM_EMERGENCY_STOP})
_LATCHED = frozenset({SafetyMode.VIOLATION, SafetyMode.FAULT})
_KEEP_POWER = frozenset({SafetyMode.PROTECTIVE_STOP, SafetyMode.SAFEGUARD_STOP})


class RobotModes:
    """The modes of a robot, looked up when they may have changed, and the stop that keeps it from moving."""

    def __init__(self, motion: MotionControl) -> None:
        self._motion = motion
        self._stops: dict[SafetyMode, Event] = {}
        """Event of each stop that may still hold, by the safety mode that it caused, the newest last."""
        self.now = 0, 0, 0
        """Robot mode, safety mode and runtime state."""
        self.update()

    def update(self) -> None:
        """Look them up; to be called in every tick in which they may have changed."""
        motion = self._motion
        robot, safety = motion.robot_mode, motion.safety_mode
        if safety in _MAY_MOVE and robot is RobotMode.RUNNING:
            self._stops.clear()
        self.now = int(robot), int(safety), int(motion.runtime)
        # A paused motion comes to a standstill without any event.
        motion.changed = motion.activity is Activity.PAUSED

    def hear(self, event: Event) -> None:
        """Take an event, which may be a stop or end one."""
        self._motion.changed = True
        if event.kind not in {"protective_stop", "safety_stop"}:
            return
        cause = _cause(event, self._motion.safety_mode)
        if cause is not None:
            self._stops.pop(cause, None)  # moves the newest to the end
            self._stops[cause] = event

    @property
    def stop_reason(self) -> StopReason | None:
        """The stop that keeps the robot from moving; None if there is none, or it had no event.

        If the safety system allows motion again and the power is still off, that is the last stop that cut the power.
        """
        robot, safety, event = self._motion.robot_mode, self._motion.safety_mode, None
        if safety not in _MAY_MOVE:
            event = self._stops.get(safety)
        elif robot is not RobotMode.RUNNING:
            took_power = [event for mode, event in self._stops.items() if mode not in _KEEP_POWER]
            event = took_power[-1] if took_power else None
        return None if event is None else StopReason(tick=event.tick, code=event.code, why=event.why or "")

    def forget_stops(self) -> None:
        """Discard all stops, since the robot was set to a mode."""
        self._stops.clear()


def _cause(event: Event, mode: SafetyMode) -> SafetyMode | None:
    """Safety mode that an event explains, NORMAL for a loss of power alone; None if it is not known.

    The present mode is the most severe of all conditions; another stop may have caused it.
    """
    if event.kind == "protective_stop":
        return SafetyMode.PROTECTIVE_STOP
    if event.category == 2:
        return SafetyMode.SAFEGUARD_STOP
    if event.category == 1:
        return mode if mode in _EMERGENCIES else None
    if mode in _LATCHED:
        return mode
    return None if mode in _EMERGENCIES else SafetyMode.NORMAL
