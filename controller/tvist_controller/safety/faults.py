"""Deliberate faults of `simulation.inject`, applied to the arm or the safety system."""

import math
from bisect import insort
from collections.abc import Callable
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np

from tvist_controller.motion.activity_control import MotionControl
from tvist_controller.refusal import RefusalError, invalid, missing
from tvist_controller.safety.safety_control import SafetyControl
from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD, Plant
from tvist_protocol.faults import FAULTS
from tvist_protocol.simulation import SimulationInject


def check_fault(command: SimulationInject, description: RobotDescription) -> None:
    """Refuse a fault that this robot can never have."""
    joints = description.joints
    if (fault := FAULTS.get(command.fault)) is None:
        raise invalid("fault", repr(command.fault), f"one of {', '.join(FAULTS)}", code="unknown_fault")
    for field in ("joint", "value", "seconds"):
        given = getattr(command, field) is not None
        if field in fault.needs and not given:
            raise missing(field, f"fault {command.fault} needs it")
        if given and field not in (*fault.needs, *fault.may):
            raise invalid(field, "given", f"left out for fault {command.fault}")
    if command.joint is not None and command.joint >= joints:
        raise invalid("joint", command.joint, f"from 0 to {joints - 1}", joints - 1)


_NEEDED: dict[str, Callable[..., Any]] = {"torque": Plant.push, "nan": Plant.make_nan}
"""Method of the plant needed by a fault."""


class Faults:
    """Starts faults, and ends those with a duration."""

    def __init__(self, motion: MotionControl, safety: SafetyControl) -> None:
        pressed = motion.safety.emergencies
        self._inputs: dict[str, tuple[Callable[[], None], Callable[[], None]]] = {
            "reduced": (partial(safety.reduce, reduced=True), partial(safety.reduce, reduced=False)),
            "safeguard_stop": (
                partial(safety.safeguard, stopped=True), partial(safety.safeguard, stopped=False),
            ),
            # The power stays off after the release of an emergency stop.
            "emergency_stop": (partial(safety.emergency, "robot"), partial(pressed.discard, "robot")),
            "system_emergency_stop": (partial(safety.emergency, "system"), partial(pressed.discard, "system")),
        }  # fmt: skip
        """Functions that start and end each safety input."""
        self._momentary: dict[str, Callable[[], None]] = {
            "protective_stop": lambda: motion.protect("a protective stop was injected"),
            "normal": safety.release,
            "power_loss": lambda: safety.cut_power("a loss of power was injected"),
            "violation": lambda: safety.cut_power("the safety system found a violation", "violation"),
            "fault": lambda: safety.cut_power("the safety system failed", "fault"),
            "nan": motion.cycle.plant.make_nan,
        }  # functions of faults without duration
        self._plant = motion.cycle.plant
        self._push = np.zeros(motion.cycle.description.joints)
        self._ends: list[tuple[int, str, Callable[[], None]]] = []  # by tick: fault, and what ends it

    def inject(self, command: SimulationInject, tick: int) -> None:
        """Start a fault, or raise RefusalError if the plant does not support it."""
        fault, seconds = command.fault, command.seconds
        needed = _NEEDED.get(fault)
        if needed is not None and not self._plant.can(needed):
            plant, method = type(self._plant).__name__, needed.__name__
            why = f"fault is {fault!r}: the plant {plant} cannot simulate it, since it has no method {method}"
            raise RefusalError("unknown_fault", "fault", why)
        ends = tick + round((seconds or 0.0) / PERIOD)
        if fault == "torque":
            joint, value = command.joint or 0, command.value or 0.0
            self._add(joint, value)
            self._end_at(ends, fault, lambda: self._add(joint, -value))
            return
        # Setting or releasing an input cancels its earlier end time.
        cancelled = {*self._inputs} if fault == "normal" else {fault}
        self._ends = [one for one in self._ends if one[1] not in cancelled]
        if fault in self._inputs:
            begin, end = self._inputs[fault]
            begin()
            if seconds is not None:
                self._end_at(ends, fault, end)
        else:
            self._momentary[fault]()

    @property
    def next_end(self) -> float:
        """Tick in which the next fault ends; infinite if no fault ends by itself."""
        return self._ends[0][0] if self._ends else math.inf

    def end(self, tick: float = math.inf) -> None:
        """End faults that expire before a tick."""
        while self._ends and self._ends[0][0] <= tick:
            self._ends.pop(0)[-1]()

    def clear(self) -> None:
        """End all present faults and external torques."""
        self.end()
        self._push[:] = 0.0
        if self._plant.can(Plant.push):
            self._plant.push(self._push)

    def _end_at(self, tick: int, fault: str, end: Callable[[], None]) -> None:
        insort(self._ends, (tick, fault, end), key=itemgetter(0))

    def _add(self, joint: int, torque: float) -> None:
        self._push[joint] += torque
        self._plant.push(self._push)
