"""Values that accumulate over time: temperatures and energies."""

from math import exp

from tvist_controller.instruments.ratings import AMBIENT, STANDBY, JointRating
from tvist_plant.plant import PERIOD


class Meters:
    """Temperature of each joint, and energy of all joints.

    A joint is one body: τ dT/dt = T_ambient + R_th (P_standby + R i²) - T, solved exactly over each step with
    constant current. Ticks that were skipped count as one step with the current at its end.

    Args:
        ratings: Ratings of each joint.
    """

    def __init__(self, ratings: list[JointRating]) -> None:
        self._ratings = ratings
        self._tick = 0
        self._shares = self._over(PERIOD)
        self.temperatures = [AMBIENT] * len(ratings)
        """Temperatures of the joints [°C]."""
        self.power = 0.0
        """Power taken from the supply now [W]."""
        self.consumed = 0.0
        """Energy taken from the supply since the first tick [J]."""
        self.dissipated = 0.0
        """Energy returned by braking and dissipated in a resistor [J]."""

    def _over(self, seconds: float) -> list[float]:
        """Share of the way to its steady value that each temperature covers in this time."""
        return [1.0 - exp(-seconds / rating.thermal_time) for rating in self._ratings]

    def update(self, tick: int, current: list[float], mechanical: float, *, powered: bool) -> None:
        """Advance to a tick.

        Args:
            tick: Number of the control period; one that is not later than the last adds nothing.
            current: Current of each joint's motor [A].
            mechanical: Power that the motors deliver to the arm, negative while they brake [W].
            powered: Whether the arm has power.
        """
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
