"""Why a robot stands: for who comes after the event that said so."""

from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import Event

_MAY_MOVE = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED})
_EMERGENCIES = frozenset({SafetyMode.ROBOT_EMERGENCY_STOP, SafetyMode.SYSTEM_EMERGENCY_STOP})
_LATCHED = frozenset({SafetyMode.VIOLATION, SafetyMode.FAULT})
_KEEP_POWER = frozenset({SafetyMode.PROTECTIVE_STOP, SafetyMode.SAFEGUARD_STOP})


class StopReasons:
    """Remembers the event of each stop that may still hold, by the safety mode that it is the reason of."""

    def __init__(self) -> None:
        self._events: dict[SafetyMode, Event] = {}

    def note(self, event: Event, mode: SafetyMode) -> None:
        """Remember a stop.

        Args:
            event: Event of kind `protective_stop` or `safety_stop`.
            mode: What the safety system allows now: the gravest of what holds, which another stop may have led to.
        """
        cause = _cause(event, mode)
        if cause is not None:
            self._events.pop(cause, None)  # the newest is the last
            self._events[cause] = event

    def update(self, robot: RobotMode, safety: SafetyMode) -> None:
        """Forget what is over: a robot that may move is stopped by nothing any more."""
        if self._events and safety in _MAY_MOVE and robot is RobotMode.RUNNING:
            self._events.clear()

    def forget(self) -> None:
        """Forget everything: the robot was put into a mode."""
        self._events.clear()

    def present(self, robot: RobotMode, safety: SafetyMode) -> StopReason | None:
        """The stop that keeps the robot from moving.

        Where the safety system allows motion again and the power is still off, that is the last one that took it.

        Args:
            robot: The robot's mode.
            safety: What the safety system allows.

        Returns:
            None where there is none, or no event told of it.
        """
        event = None
        if safety not in _MAY_MOVE:
            event = self._events.get(safety)
        elif robot is not RobotMode.RUNNING:
            took_power = [event for mode, event in self._events.items() if mode not in _KEEP_POWER]
            event = took_power[-1] if took_power else None
        return None if event is None else StopReason(tick=event.tick, code=event.code, why=event.why or "")


def _cause(event: Event, mode: SafetyMode) -> SafetyMode | None:
    """The safety mode that an event is the reason of, NORMAL for a loss of power alone; None: it cannot be told."""
    if event.kind == "protective_stop":
        return SafetyMode.PROTECTIVE_STOP
    if event.category == 2:
        return SafetyMode.SAFEGUARD_STOP
    if event.category == 1:
        return mode if mode in _EMERGENCIES else None
    if mode in _LATCHED:
        return mode
    return None if mode in _EMERGENCIES else SafetyMode.NORMAL
