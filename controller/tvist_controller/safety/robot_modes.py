"""Robot mode, safety mode, runtime state, and the reason for a stop, for clients that connect later."""

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
    """The robot's modes, updated when they may have changed, and the stop that blocks the robot."""

    def __init__(self, motion: MotionControl) -> None:
        self._motion = motion
        self.stops: dict[SafetyMode, Event] = {}
        """Events of stops that may still hold, by resulting safety mode, newest last."""
        self.now = 0, 0, 0
        self.update()

    def update(self) -> None:
        """Update the modes; call in every tick in which they may have changed."""
        motion = self._motion
        robot, safety = motion.robot_mode, motion.safety_mode
        if safety in _MAY_MOVE and robot is RobotMode.RUNNING:
            self.stops.clear()
        self.now = int(robot), int(safety), int(motion.runtime)
        # A paused motion stops without an event.
        motion.changed = motion.activity is Activity.PAUSED

    def hear(self, event: Event) -> None:
        """Take an event, which may start or end a stop."""
        self._motion.changed = True
        if event.kind not in {"protective_stop", "safety_stop"}:
            return
        if (cause := _cause(event, self._motion.safety_mode)) is not None:
            self.stops.pop(cause, None)  # moves the newest to the end
            self.stops[cause] = event

    @property
    def stop_reason(self) -> StopReason | None:
        """The stop that blocks the robot or has cut its power; None without one, or without its event."""
        robot, safety, event = self._motion.robot_mode, self._motion.safety_mode, None
        if safety not in _MAY_MOVE:
            event = self.stops.get(safety)
        elif robot is not RobotMode.RUNNING:
            took_power = [event for mode, event in self.stops.items() if mode not in _KEEP_POWER]
            event = took_power[-1] if took_power else None
        return None if event is None else StopReason(tick=event.tick, code=event.code, why=event.why or "")


def _cause(event: Event, mode: SafetyMode) -> SafetyMode | None:
    """Return the safety mode whose cause an event is, NORMAL for a mere loss of power, None if unknown."""
    if event.kind == "protective_stop":
        return SafetyMode.PROTECTIVE_STOP
    if event.category == 2:
        return SafetyMode.SAFEGUARD_STOP
    if event.category == 1:
        return mode if mode in _EMERGENCIES else None
    if mode in _LATCHED:
        return mode
    return None if mode in _EMERGENCIES else SafetyMode.NORMAL
