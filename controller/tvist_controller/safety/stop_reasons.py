"""Reason why a robot is stopped, for clients that connect after the event."""

from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import Event

_MAY_MOVE = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED})
_EMERGENCIES = frozenset({SafetyMode.ROBOT_EMERGENCY_STOP, SafetyMode.SYSTEM_EMERGENCY_STOP})
_LATCHED = frozenset({SafetyMode.VIOLATION, SafetyMode.FAULT})
_KEEP_POWER = frozenset({SafetyMode.PROTECTIVE_STOP, SafetyMode.SAFEGUARD_STOP})


class StopReasons:
    """Remembers the event of each stop that may still hold, by the safety mode that it caused."""

    def __init__(self) -> None:
        self._events: dict[SafetyMode, Event] = {}

    def note(self, event: Event, mode: SafetyMode) -> None:
        """Remember a stop.

        Args:
            event: Event of kind `protective_stop` or `safety_stop`.
            mode: Present safety mode, the most severe of all conditions; another stop may have caused it.
        """
        cause = _cause(event, mode)
        if cause is not None:
            self._events.pop(cause, None)  # moves the newest to the end
            self._events[cause] = event

    def update(self, robot: RobotMode, safety: SafetyMode) -> None:
        """Discard stops that are over: if the robot may move, no stop holds any more."""
        if self._events and safety in _MAY_MOVE and robot is RobotMode.RUNNING:
            self._events.clear()

    def forget(self) -> None:
        """Discard all stops, since the robot was set to a mode."""
        self._events.clear()

    def present(self, robot: RobotMode, safety: SafetyMode) -> StopReason | None:
        """Return the stop that keeps the robot from moving.

        If the safety system allows motion again and the power is still off, that is the last stop that cut the power.

        Args:
            robot: Present robot mode.
            safety: Present safety mode.

        Returns:
            None if there is none, or it had no event.
        """
        event = None
        if safety not in _MAY_MOVE:
            event = self._events.get(safety)
        elif robot is not RobotMode.RUNNING:
            took_power = [event for mode, event in self._events.items() if mode not in _KEEP_POWER]
            event = took_power[-1] if took_power else None
        return None if event is None else StopReason(tick=event.tick, code=event.code, why=event.why or "")


def _cause(event: Event, mode: SafetyMode) -> SafetyMode | None:
    """Safety mode that an event explains, NORMAL for a loss of power alone; None if it is not known."""
    if event.kind == "protective_stop":
        return SafetyMode.PROTECTIVE_STOP
    if event.category == 2:
        return SafetyMode.SAFEGUARD_STOP
    if event.category == 1:
        return mode if mode in _EMERGENCIES else None
    if mode in _LATCHED:
        return mode
    return None if mode in _EMERGENCIES else SafetyMode.NORMAL
