"""Electrical and thermal figures of the joints' drives: guesses of the right size, no measurements.

A robot's file says nothing of motors. There are two sizes of joint, told apart by the torque they may give, as
in a UR5e, whose base, shoulder and elbow are of one size and whose wrist joints are of another.

Torque constants: currents that UR's own simulator shows at its start posture (2.14, 1.49, 0.23 A at shoulder, elbow
and first wrist) over the gravity of this model of a UR5e there (21.1, 15.0, 1.8 N m): 9.9, 10.0 and 7.9 N m/A.
Everything else is chosen: so that a joint that carries its rated load for long stays below 80 °C, within some
twenty minutes.
"""

from dataclasses import dataclass

from tvist_plant.description import RobotDescription

BIG = 60.0
"""A joint that may give more torque is a big one [N m]."""
AMBIENT = 25.0
"""Temperature around the arm [°C]."""
BUS_VOLTAGE = 48.0
"""Voltage of the supply [V]."""
STANDBY = 5.0
"""What the electronics of a joint take as long as it has power [W]."""


@dataclass(frozen=True)
class JointRating:
    """One size of joint."""

    torque_constant: float
    """Torque on the joint's side over motor current [N m/A]."""
    resistance: float
    """Heat of the motor over the square of its current [Ω]."""
    thermal_resistance: float
    """Steady rise of temperature over heat [K/W]."""
    thermal_time: float
    """Time in which temperature comes to 63 % of its way [s]."""
    torque: float
    """Largest torque [N m]."""

    @property
    def window(self) -> float:
        """Current of a tenth of the largest torque [A]."""
        return 0.1 * self.torque / self.torque_constant


def joint_ratings(description: RobotDescription) -> list[JointRating]:
    """Return the rating of each joint of a robot."""
    return [_big(torque) if torque > BIG else _small(torque) for torque in description.limits.torque]


def _big(torque: float) -> JointRating:
    return JointRating(
        torque_constant=10.0, resistance=0.4, thermal_resistance=1.0, thermal_time=1200.0, torque=torque
    )


def _small(torque: float) -> JointRating:
    return JointRating(
        torque_constant=7.9, resistance=1.2, thermal_resistance=2.0, thermal_time=900.0, torque=torque
    )
