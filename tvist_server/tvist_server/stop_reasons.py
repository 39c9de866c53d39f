"""Why a robot stands: for who comes after the event that said so."""

from tvist_protocol.info import StopReason
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import Event

_MAY_MOVE = frozenset({SafetyMode.NORMAL, SafetyMode.REDUCED})


class StopReasons:
    """Remembers the event of each stop that holds, by the safety mode it led to."""

    def __init__(self) -> None:
        self._events: dict[SafetyMode, Event] = {}

    def note(self, event: Event, mode: SafetyMode) -> None:
        """Remember a stop.

        Args:
            event: Of kind `protective_stop` or `safety_stop`.
            mode: What the safety system allows from then on; NORMAL where only the power is gone.
        """
        if event.kind == "safety_stop" and mode is SafetyMode.PROTECTIVE_STOP:
            mode = SafetyMode.SAFEGUARD_STOP  # which shows once the protective stop is unlocked
        self._events.pop(mode, None)  # the newest is the last
        self._events[mode] = event

    def update(self, robot: RobotMode, safety: SafetyMode) -> None:
        """Forget what is over: a robot that may move is stopped by nothing any more."""
        if self._events and safety in _MAY_MOVE and robot is RobotMode.RUNNING:
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
        if safety not in _MAY_MOVE:
            event = self._events.get(safety)
        elif robot is not RobotMode.RUNNING and self._events:
            event = list(self._events.values())[-1]
        else:
            event = None
        return None if event is None else StopReason(tick=event.tick, code=event.code, why=event.why or "")
