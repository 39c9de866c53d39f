"""Electrical and thermal ratings of the joints' drives: plausible guesses, not measurements.

A robot file does not describe motors. There are two sizes of joint, distinguished by their largest torque, as in a
UR5e, whose base, shoulder and elbow are of one size and whose wrist joints are of the other.

Torque constants: the currents that UR's own simulator shows in its start posture (2.14, 1.49 and 0.23 A at shoulder,
elbow and first wrist), divided into this model's gravity torques of a UR5e in that posture (21.1, 15.0 and 1.8 N m),
give 9.9, 10.0 and 7.9 N m/A. They grow with the largest torque, so that a joint of another arm draws the UR5e's
current at its own largest torque. All other values are chosen so that a joint under its rated load stays below 80 °C,
and settles within some twenty minutes.
"""

from dataclasses import dataclass

from tvist_plant.description import RobotDescription

BIG = 60.0
"""A joint with a larger torque limit is a big one [N m]."""
AMBIENT = 25.0
"""Ambient temperature [°C]."""
BUS_VOLTAGE = 48.0
"""Voltage of the supply [V]."""
STANDBY = 5.0
"""Power of a joint's electronics while it is on [W]."""


@dataclass(frozen=True)
class JointRating:
    """One size of joint."""

    torque_constant: float
    """Torque on the joint's side over motor current [N m/A]."""
    resistance: float
    """Heat of the motor divided by the square of its current [Ω]."""
    thermal_resistance: float
    """Steady rise of temperature divided by heat [K/W]."""
    thermal_time: float
    """Time after which the temperature has covered 63 % of its way [s]."""
    torque: float
    """Largest torque [N m]."""

    @property
    def window(self) -> float:
        """Current at a tenth of the largest torque [A]."""
        return 0.1 * self.torque / self.torque_constant


def joint_ratings(description: RobotDescription) -> list[JointRating]:
    """Return the rating of each joint of a robot."""
    return [_big(torque) if torque > BIG else _small(torque) for torque in description.limits.torque]


def _big(torque: float) -> JointRating:
    return JointRating(
        torque_constant=10.0 * (torque / 150.0),
        resistance=0.4,
        thermal_resistance=1.0,
        thermal_time=1200.0,
        torque=torque,
    )


def _small(torque: float) -> JointRating:
    return JointRating(
        torque_constant=7.9 * (torque / 28.0),
        resistance=1.2,
        thermal_resistance=2.0,
        thermal_time=900.0,
        torque=torque,
    )
