"""Currents, heat and energy of the joints' motors; the ratings are plausible guesses, not measurements.

A robot file does not describe motors. Joints have two sizes, distinguished by their largest torque as in a UR5e: base,
shoulder and elbow, and the wrists.

Torque constants: the currents that UR's simulator shows in its start posture (2.14, 1.49 and 0.23 A at shoulder, elbow
and first wrist) and this model's gravity torques there (21.1, 15.0 and 1.8 N m) give 9.9, 10.0 and 7.9 N m/A. They
scale with the largest torque, so that any joint draws the UR5e's current at its largest torque. The other values keep a
joint at rated load below 80 °C, and let it settle within some twenty minutes.
"""

from dataclasses import dataclass, replace
from math import exp

from tvist_plant.description import RobotDescription
from tvist_plant.plant import PERIOD

AMBIENT = 25.0  # Ambient temperature [°C]
BUS_VOLTAGE = 48.0  # voltage of the supply [V]
STANDBY = 5.0  # power of a joint's electronics when on [W]


@dataclass(frozen=True)
class JointRating:
    """One size of joint."""

    torque_constant: float  # joint torque per motor current [N m/A]
    resistance: float  # motor heat per squared current [Ω]
    thermal_resistance: float  # steady temperature rise per heat [K/W]
    thermal_time: float  # time constant of the temperature [s]
    torque: float  # largest torque [N m]

    @property
    def window(self) -> float:
        """Current at a tenth of the largest torque [A]."""
        return 0.1 * self.torque / self.torque_constant


BIG = JointRating(10.0, resistance=0.4, thermal_resistance=1.0, thermal_time=1200.0, torque=150.0)
"""Base, shoulder and elbow of a UR5e."""
SMALL = JointRating(7.9, resistance=1.2, thermal_resistance=2.0, thermal_time=900.0, torque=28.0)
"""Wrists of a UR5e."""
LARGEST_SMALL = 60.0  # joints with a larger torque limit are big [N m]


def joint_ratings(description: RobotDescription) -> list[JointRating]:
    """Return the rating of each joint of a robot."""
    found = [(BIG if torque > LARGEST_SMALL else SMALL, torque) for torque in description.limits.torque]
    return [
        replace(size, torque=torque, torque_constant=size.torque_constant * (torque / size.torque))
        for size, torque in found
    ]


class Meters:
    """Temperature of each joint, and energy of all joints.

    Each joint is one body: τ dT/dt = T_ambient + R_th (P_standby + R i²) - T, solved exactly for constant
    current. Skipped ticks count as one step with the current at its end.
    """

    def __init__(self, ratings: list[JointRating]) -> None:
        self._ratings = ratings
        self._tick = 0
        self._shares = self._over(PERIOD)
        self.temperatures = [AMBIENT] * len(ratings)  # temperatures of the joints [°C]
        self.power = 0.0  # present power from the supply [W]
        self.consumed = 0.0  # energy from the supply since the first tick [J]
        self.dissipated = 0.0  # braking energy dissipated in a resistor [J]

    def _over(self, seconds: float) -> list[float]:
        """Return the fraction of the way to its steady value that each temperature covers in this time."""
        return [1.0 - exp(-seconds / rating.thermal_time) for rating in self._ratings]

    def update(self, tick: int, current: list[float], mechanical: float, *, powered: bool) -> None:
        """Advance to a later tick with motor currents [A] and mechanical power, negative in braking [W]."""
        standby = STANDBY if powered else 0.0
        heats = [rating.resistance * i * i for rating, i in zip(self._ratings, current, strict=True)]
        net = sum(heats) + mechanical
        self.power = standby * len(heats) + max(net, 0.0)
        ticks = tick - self._tick
        if ticks <= 0:
            return
        self._tick = tick
        seconds = ticks * PERIOD
        shares = self._shares if ticks == 1 else self._over(seconds)
        self.temperatures = [
            old + share * (AMBIENT + rating.thermal_resistance * (standby + heat) - old)
            for old, share, rating, heat in zip(self.temperatures, shares, self._ratings, heats, strict=True)
        ]
        self.consumed += seconds * self.power
        self.dissipated += seconds * max(-net, 0.0)
