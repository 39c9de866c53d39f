"""Methods for a motion: unshaped, the paper's method, and the baselines it has to be compared with."""

from dataclasses import dataclass

from tvist_client.arm import Arm
from tvist_client.robot import Robot

ACCELERATION, JERK = 2.0, 100.0
"""The paper's limits [rad/s^2, rad/s^3]."""


@dataclass(frozen=True)
class Method:
    """A method for making a motion: a shaper, and the modes that it is designed for."""

    name: str
    """Name in tables and JSON."""
    label: str
    """Name for people."""
    shaper: str = "none"
    modes: tuple[float, float] | None = None
    """Constant design frequency [Hz] and damping ratio [-]; None for the polynomials of the robot's calibration."""
    frozen: bool = False
    """Whether it has the modes of the end pose during the whole motion; requires the target in advance."""
    jerk: float = JERK
    """Limit of the motion [rad/s^3]."""

    async def prepare(self, robot: Robot, arm: Arm, end: tuple[float, ...]) -> None:
        """Set up a robot at rest for a motion that ends at a pose; without a shaper, the estimate is still recorded."""
        modes = self.modes
        await arm.set_estimator("polynomial")
        if self.frozen:
            start = (await robot.state()).target_q
            await arm.reset(q=end)
            await robot.advance(2)
            state = await robot.state()
            await arm.reset(q=start)
            modes = state.estimated_f_d[0], state.estimated_zeta[0]
        if modes is not None:
            await arm.set_estimator("fixed", f_d=[modes[0]], zeta=[modes[1]])
        await arm.set_shaper(self.shaper)


UNSHAPED = Method("unshaped", "unshaped")
"""The unchanged reference."""
SHAPED = Method("shaped", "TVIST-ZV", "zv")
"""TVIST with the calibration's polynomials."""
FROZEN_AT_END = Method("zv_frozen_at_end", "ZV for the end pose", "zv", frozen=True)
"""ZV with the modes of the end pose."""


def fixed(shaper: str, f_d: float, zeta: float) -> Method:
    """Return one shaper for the whole workspace, with a design frequency [Hz] and damping ratio [-]."""
    return Method(f"fixed_{shaper}", f"fixed {shaper.upper()}", shaper, (f_d, zeta))


def equal_duration(delay: float) -> Method:
    """Return a motion without shaper and model that takes as long as a shaped one, whose delay is given [s].

    A double S that reaches its limits lasts way/v + v/a + a/j, so an increase of a/j lengthens it equally.
    """
    jerk = ACCELERATION / (ACCELERATION / JERK + delay)
    return Method("equal_duration_double_s", "longer double S", jerk=jerk)
