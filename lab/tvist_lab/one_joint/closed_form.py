"""Inertia, frequency and damping of an arm with a flexible shoulder and a rigid elbow, in closed form.

A joint's own rotation does not change the inertia about it, so the angle that does is the elbow's. Both axes are
vertical; then the arm's weight loads no joint. With the parallel-axis theorem for each body and the law of cosines
for the distance of the forearm's centre of mass from the shoulder,

    I(q) = J_1 + J_2 + m_2 (l² + 2 l c_2 cos q)

where J_1 is the inertia of the upper arm about the shoulder, J_2 and m_2 c_2 are inertia and first moment of the
forearm with its payload about the elbow, l is the length of the upper arm, and q = 0 is the stretched arm.
"""

from dataclasses import dataclass

import numpy as np

from tvist_lab.recordings import Floats
from tvist_plant.description import Payload, RobotDescription
from tvist_shaping import FlexibleJoint, flexible_joint


@dataclass(frozen=True)
class FlexibleShoulder:
    """What the closed form is made of."""

    middle: float
    """I(90°) = J_1 + J_2 + m_2 l² [kg m²]."""
    change: float
    """2 l m_2 c_2, the inertia by which the stretched arm differs from that [kg m²]."""
    stiffness: float
    """K of the shoulder [N m/rad]."""
    damping: float
    """D of the damper beside it [N m s/rad]."""

    @classmethod
    def of(cls, description: RobotDescription, payload: Payload) -> "FlexibleShoulder":
        """Take it from a robot file.

        The drives are taken as rigid. A drive of gain K_d yields, which adds about √(K I)/(2 K_d) to ζ and lowers f_d
        by a share of about K K_p/(2 K_d ω²).

        Args:
            description: An arm with two joints.
            payload: What it carries.

        Raises:
            ValueError: The arm has not two vertical axes with the masses in line with its links.
        """
        kinematics, links = description.kinematics, description.links
        aside = [com[1] for com in links.com] + [payload.com[1]]
        if len(kinematics.a) != 2 or any(kinematics.alpha) or any(aside):
            raise ValueError(
                f"robot {description.robot.name}: the closed form is for two vertical axes with masses in line"
            )
        length, forearm = kinematics.a
        J_1 = links.inertia[0][5] + links.mass[0] * (length + links.com[0][0]) ** 2
        c, c_payload = forearm + links.com[1][0], forearm + payload.com[0]
        mass, moment = links.mass[1] + payload.mass, links.mass[1] * c + payload.mass * c_payload
        J_2 = links.inertia[1][5] + links.mass[1] * c**2 + payload.inertia[5] + payload.mass * c_payload**2
        return cls(
            middle=J_1 + J_2 + mass * length**2,
            change=2.0 * length * moment,
            stiffness=description.drives.gear_stiffness[0],
            damping=description.drives.gear_damping[0],
        )

    def inertia(self, elbow: float) -> float:
        """I(q) about the shoulder [kg m²].

        Args:
            elbow: Angle of the elbow, 0 where the arm is stretched [rad].
        """
        return self.middle + self.change * float(np.cos(elbow))

    def mode(self, elbow: float) -> tuple[float, float]:
        """Return f_d [Hz] and ζ [-]; see `tvist_shaping.flexible_joint`.

        Args:
            elbow: Angle of the elbow [rad].
        """
        return flexible_joint(self.inertia(elbow), self.stiffness, self.damping)

    def estimator(self) -> FlexibleJoint:
        """Return the closed form as an estimator for a filter, which takes the angles of shoulder and elbow."""

        def inertia(q: Floats) -> float:
            return self.inertia(float(q[1]))

        ends = (self.middle - abs(self.change), self.middle + abs(self.change))
        return FlexibleJoint(inertia, ends, self.stiffness, self.damping)
