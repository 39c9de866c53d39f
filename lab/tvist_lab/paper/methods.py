"""Ways to make a motion: unshaped, the paper's, and the baselines it has to be compared with."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from tvist_client.arm import Arm
from tvist_client.robot import Robot

ACCELERATION, JERK = 2.0, 100.0
"""The paper's limits [rad/s^2, rad/s^3]."""


class Method(ABC):
    """A way to make a motion."""

    name: str
    """In tables and JSON."""
    label: str
    """For people."""

    @abstractmethod
    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:
        """Set the robot up at rest for a motion that ends there; the jerk limit to move with [rad/s^3]."""


class Unshaped(Method):
    """The reference as it is."""

    name, label = "unshaped", "unshaped"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """No shaper; what the estimator would say is still recorded."""
        await arm.set_estimator("polynomial")
        await arm.set_shaper("none")
        return JERK


@dataclass(frozen=True)
class TimeVarying(Method):
    """TVIST with the calibration's polynomials."""

    shaper: str = "zv"
    name: str = "shaped"
    label: str = "TVIST-ZV"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """The polynomial estimator of the robot's own calibration."""
        await arm.set_estimator("polynomial")
        await arm.set_shaper(self.shaper)
        return JERK


class FrozenAtEnd(Method):
    """ZV for the end pose all along: needs the target in advance."""

    name, label = "zv_frozen_at_end", "ZV for the end pose"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:
        """Ask the robot for its estimate at the end, then hold it."""
        start = (await robot.state()).target_q
        await arm.set_estimator("polynomial")
        await arm.reset(q=end)
        await robot.advance(2)
        state = await robot.state()
        await arm.reset(q=start)
        await arm.set_estimator("fixed", f_d=[state.estimated_f_d[0]], zeta=[state.estimated_zeta[0]])
        await arm.set_shaper("zv")
        return JERK


@dataclass(frozen=True)
class FixedShaper(Method):
    """One robust shaper for the whole workspace."""

    shaper: str
    f_d: float
    """Frequency it is designed for [Hz]."""
    zeta: float
    """Damping it is designed for [-]."""
    name: str
    label: str

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """The fixed estimator."""
        await arm.set_estimator("fixed", f_d=[self.f_d], zeta=[self.zeta])
        await arm.set_shaper(self.shaper)
        return JERK


@dataclass(frozen=True)
class EqualDuration(Method):
    """No shaper and no model at all: a longer jerk time, so that the motion takes as long as the shaped one."""

    delay: float
    """Delay of the shaped motion [s]."""
    name: str = "equal_duration_double_s"
    label: str = "longer double S"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """A double S that reaches its limits lasts way/v + v/a + a/j: what a/j gains the motion lasts longer."""
        await arm.set_shaper("none")
        return ACCELERATION / (ACCELERATION / JERK + self.delay)
