"""Faults caused on purpose: what `simulation.inject` asks for, done to the arm or the safety system."""

import heapq
from collections.abc import Callable
from itertools import count

import numpy as np

from tvist_plant.plant import PERIOD
from tvist_protocol.commands import SimulationInject
from tvist_protocol.faults import FAULTS
from tvist_server.motion import MotionControl
from tvist_server.refusal import RefusalError
from tvist_server.safety_control import SafetyControl
from tvist_server.safety_system import Emergency

_EMERGENCIES: dict[str, Emergency] = {"emergency_stop": "robot", "system_emergency_stop": "system"}


class Faults:
    """Begins faults, and ends those that last.

    Args:
        motion: What they happen to.
        safety: Its safety system.
    """

    def __init__(self, motion: MotionControl, safety: SafetyControl) -> None:
        self._motion, self._safety = motion, safety
        self._momentary: dict[str, Callable[[], None]] = {
            "protective_stop": lambda: motion.protect("a protective stop was injected"),
            "normal": safety.release,
            "power_loss": lambda: safety.cut_power("a loss of power was injected"),
            "violation": lambda: safety.cut_power("the safety system found a violation", "violation"),
            "fault": lambda: safety.cut_power("the safety system failed", "fault"),
            "nan": lambda: motion.cycle.arm.spoil(),  # noqa: PLW0108  the line may get another arm
        }
        self._push = np.zeros(motion.cycle.description.joints)
        self._ends: list[tuple[int, int, str, Callable[[], None]]] = []
        self._number = count()

    def inject(self, command: SimulationInject, tick: int) -> None:
        """Begin a fault.

        Args:
            command: Which one.
            tick: The next one.

        Raises:
            RefusalError: There is none of that name, a field it needs is missing, or one it has not is there.
        """
        _check(command, self._motion.cycle.description.joints)
        ticks = None if command.seconds is None else round(command.seconds / PERIOD)
        safety = self._safety
        self._forget(command.fault)
        match command.fault:
            case "reduced":
                safety.reduce(reduced=True)
                self._release(tick, ticks, command.fault, lambda: safety.reduce(reduced=False))
            case "safeguard_stop":
                safety.safeguard(stopped=True)
                self._release(tick, ticks, command.fault, lambda: safety.safeguard(stopped=False))
            case "emergency_stop" | "system_emergency_stop" as name:
                whose = _EMERGENCIES[name]
                safety.emergency(whose)
                self._release(tick, ticks, command.fault, lambda: safety.end_emergency(whose))
            case "torque":
                joint, value = command.joint or 0, command.value or 0.0
                self._add(joint, value)
                self._at(tick + (ticks or 0), "torque", lambda: self._add(joint, -value))
            case name:
                self._momentary[name]()

    def end(self, tick: int) -> None:
        """End those that are over before a tick."""
        while self._ends and self._ends[0][0] <= tick:
            heapq.heappop(self._ends)[-1]()

    def clear(self) -> None:
        """End all that last now, and let go of the arm."""
        while self._ends:
            heapq.heappop(self._ends)[-1]()
        self._push[:] = 0.0
        self._motion.cycle.arm.push(self._push)

    def _forget(self, fault: str) -> None:
        """An input that is set anew, or released, does not end by what it was set to before."""
        if fault != "torque":  # pushes add up, and each ends by itself
            ended = {fault} if fault != "normal" else {"reduced", "safeguard_stop", *_EMERGENCIES}
            self._ends = [one for one in self._ends if one[2] not in ended]
            heapq.heapify(self._ends)

    def _release(self, tick: int, ticks: int | None, fault: str, end: Callable[[], None]) -> None:
        if ticks is not None:
            self._at(tick + ticks, fault, end)

    def _at(self, tick: int, fault: str, end: Callable[[], None]) -> None:
        heapq.heappush(self._ends, (tick, next(self._number), fault, end))

    def _add(self, joint: int, torque: float) -> None:
        self._push[joint] += torque
        self._motion.cycle.arm.push(self._push)


def _check(command: SimulationInject, joints: int) -> None:
    fault = FAULTS.get(command.fault)
    if fault is None:
        why = f"fault is {command.fault!r}: there is {', '.join(FAULTS)}"
        raise RefusalError("unknown_fault", "fault", why)
    for field in ("joint", "value", "seconds"):
        given = getattr(command, field) is not None
        if field in fault.needs and not given:
            raise RefusalError("missing_field", field, f"{field} is missing: fault {command.fault} needs it")
        if given and field not in (*fault.needs, *fault.may):
            why = f"{field} does not belong to fault {command.fault}"
            raise RefusalError("out_of_range", field, why)
    if command.joint is not None and command.joint >= joints:
        why = f"joint is {command.joint}; the arm's joints are 0 to {joints - 1}"
        raise RefusalError("out_of_range", "joint", why, joints - 1)
