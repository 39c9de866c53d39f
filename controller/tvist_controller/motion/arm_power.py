"""Power, brakes and condition of a real plant; simulated arms have none and are always ready."""

from contextlib import suppress
from typing import Self

import numpy as np

from tvist_plant.plant import PERIOD, Condition, Halt, Measurement, Plant, PlantError, SimulatedArm
from tvist_protocol.modes import RobotMode

STALE = 10  # ticks without a new timestamp after which measurements are stale


class ArmPower:
    """Sets power and brakes of a plant, and reports the plant's condition to the robot."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self.halted: Halt | None = None
        """Stop by the arm's own controller, until the drives are to hold the arm again."""
        self._told: RobotMode | None = None
        self._was_ready = False
        self.begun = False  # whether the drives have started to hold the arm in the last tick
        self._measured: float | None = None
        self._same = 0

    @classmethod
    def of(cls, plant: Plant) -> Self | None:
        """Return a plant's power control; None for a simulated arm without `switch` and `stop`."""
        needs_nothing = isinstance(plant, SimulatedArm) and not (
            plant.can(Plant.switch) or plant.can(Plant.stop)
        )
        return None if needs_nothing else cls(plant)

    @property
    def condition(self) -> Condition:
        """Present condition of the plant; if the plant does not answer, a condition with a fault."""
        try:
            return self._plant.condition
        except PlantError as error:
            return Condition(ready=False, fault=str(error))

    def follow(self, mode: RobotMode) -> None:
        """Switch power and brakes by mode; power stays off while the arm's own controller stops the arm."""
        if self.halted is not None:
            mode = RobotMode.POWER_OFF
        if mode is self._told:
            return
        self._told, self._was_ready = mode, False
        self._plant.switch(power=mode >= RobotMode.POWER_ON, brakes=mode is not RobotMode.RUNNING)

    def stop(self) -> None:
        """Make the plant stop itself, if it can."""
        self._told = None  # the arm has switched itself by its own stop
        with suppress(PlantError):  # the robot stops in any case, and says why
            self._plant.stop()

    def end(self) -> None:
        """Power the arm off because nobody controls it any more."""
        self.stop()
        with suppress(PlantError):
            self._plant.switch(power=False, brakes=True)

    def trouble(self, mode: RobotMode, measured: Measurement) -> str | None:
        """Return why the robot cannot continue, else None; call after every tick."""
        self.begun = False
        if not (np.isfinite(measured.q).all() and np.isfinite(measured.moment).all()):
            return "the arm's measurements are not finite numbers"
        timestamp = measured.timestamp
        self._same = self._same + 1 if timestamp is not None and timestamp == self._measured else 0
        self._measured = timestamp
        if self._same >= STALE:
            return f"the arm has not measured anything for {1e3 * STALE * PERIOD:g} ms"
        condition = self.condition
        if condition.halt is not None and mode is RobotMode.RUNNING:
            self.halted, self._was_ready = self.halted or condition.halt, False
            return None
        if condition.fault is not None:
            return f"the arm reports: {condition.fault}"
        ready = condition.ready and mode is RobotMode.RUNNING
        lost = self._was_ready and not condition.ready and mode is RobotMode.RUNNING
        self.begun, self._was_ready = ready and not self._was_ready, ready
        return "the arm has switched off its drives" if lost else None
