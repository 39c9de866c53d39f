"""Methods for a motion: unshaped, the paper's method, and the baselines it has to be compared with."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from tvist_client.arm import Arm
from tvist_client.robot import Robot

ACCELERATION, JERK = 2.0, 100.0
"""The paper's limits [rad/s^2, rad/s^3]."""


class Method(ABC):
    """A method for making a motion."""

    name: str
    """Name in tables and JSON."""
    label: str
    """Name for people."""

    @abstractmethod
    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:
        """Set up a robot at rest for a motion that ends at a pose; return the jerk limit to use [rad/s^3]."""


class Unshaped(Method):
    """The unchanged reference."""

    name, label = "unshaped", "unshaped"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """Select no shaper; the estimate is still recorded."""
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
        """Select the polynomial estimator of the robot's own calibration."""
        await arm.set_estimator("polynomial")
        await arm.set_shaper(self.shaper)
        return JERK


class FrozenAtEnd(Method):
    """ZV with the modes of the end pose during the whole motion; requires the target in advance."""

    name, label = "zv_frozen_at_end", "ZV for the end pose"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:
        """Request the robot's estimate at the end pose, and then use it as a constant."""
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
    """Design frequency [Hz]."""
    zeta: float
    """Design damping ratio [-]."""
    name: str
    label: str

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """Select the fixed estimator."""
        await arm.set_estimator("fixed", f_d=[self.f_d], zeta=[self.zeta])
        await arm.set_shaper(self.shaper)
        return JERK


@dataclass(frozen=True)
class EqualDuration(Method):
    """No shaper and no model: reduced jerk, so that the motion takes as long as the shaped one."""

    delay: float
    """Delay of the shaped motion [s]."""
    name: str = "equal_duration_double_s"
    label: str = "longer double S"

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> float:  # noqa: ARG002
        """A double S that reaches its limits lasts way/v + v/a + a/j, so an increase of a/j lengthens it equally."""
        await arm.set_shaper("none")
        return ACCELERATION / (ACCELERATION / JERK + self.delay)
