"""The arm of the paper's Figure 2: one flexible joint whose inertia changes as the arm folds.

Inertia, frequency and damping are given in closed form; plucking the simulated arm confirms them. The inertia
about the shoulder depends on the elbow's angle, but not on the shoulder's own. Both axes are vertical, so
weight loads no joint. With the parallel-axis theorem for each body and the law of cosines for the distance of
the forearm's centre of mass from the shoulder,

    I(q) = J_1 + J_2 + m_2 (l² + 2 l c_2 cos q)

where J_1 is the inertia of the upper arm about the shoulder, J_2 and m_2 c_2 are inertia and first moment of
the forearm with payload about the elbow, l is the length of the upper arm, and q = 0 is the stretched arm.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from tvist_controller.api.line import body, paper_payload
from tvist_lab.metrics import RingDown, fit_ring_down
from tvist_plant.description import Payload, RobotDescription, load
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_shaping import FlexibleJoint, flexible_joint

MASSES = (0.0, 1.0)  # payloads of the figure [kg]
ANGLES = tuple(np.radians(np.arange(0.0, 151.0, 10.0)).tolist())  # elbow angles [rad]
TORQUE = 2.0  # torque that twists the shoulder before it is released [N m]
HELD, LISTENED = 1.0, 1.0  # time for which the torque acts, and recorded after it [s]
GRAVITY = (0.0, 0.0, 9.81)  # reading of the accelerometer of an arm with vertical axes at rest [m/s²]


@dataclass(frozen=True)
class FlexibleShoulder:
    """Parameters of the closed form."""

    middle: float  # i(90°) = J_1 + J_2 + m_2 l² [kg m²]
    change: float  # 2 l m_2 c_2, the additional inertia of the stretched arm [kg m²]
    stiffness: float  # k of the shoulder [N m/rad]
    damping: float  # d of the damper beside it [N m s/rad]

    @classmethod
    def of(cls, description: RobotDescription, payload: Payload) -> "FlexibleShoulder":
        """Derive the parameters from a robot file with two joints; raise ValueError if the closed form does not apply.

        It needs two vertical axes, and masses in line with the links. The drives are assumed rigid: a drive
        of gain K_d adds about √(K I)/(2 K_d) to ζ and lowers f_d by a share of about K K_p/(2 K_d ω²).
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
        """Return I(q) about the shoulder [kg m²] at an elbow angle [rad], 0 for the stretched arm."""
        return self.middle + self.change * float(np.cos(elbow))

    def mode(self, elbow: float) -> tuple[float, float]:
        """Return f_d [Hz] and ζ [-] at an elbow angle [rad]; see `tvist_shaping.flexible_joint`."""
        return flexible_joint(self.inertia(elbow), self.stiffness, self.damping)

    def estimator(self) -> FlexibleJoint:
        """Return the closed form as an estimator for a filter, with the angles of shoulder and elbow as input."""
        ends = (self.middle - abs(self.change), self.middle + abs(self.change))
        return FlexibleJoint(lambda q: self.inertia(float(q[1])), ends, self.stiffness, self.damping)


class Plucked(NamedTuple):
    """The mode at one elbow angle: from the formula, and fitted to the accelerometer after a pluck."""

    mass: float  # mass of the payload [kg]
    elbow: float  # elbow angle [rad]
    inertia: float  # inertia about the shoulder [kg m²]
    f_d: float  # damped frequency [Hz]
    zeta: float  # damping ratio [-]
    simulated_f_d: float
    simulated_zeta: float


@dataclass(frozen=True)
class OneJointModes:
    """The modes of the one-joint arm over its elbow angle."""

    description: RobotDescription
    curve: tuple[Plucked, ...]  # modes over `ANGLES`, with each of `MASSES`
    poses: tuple[Plucked, ...]
    """Modes at Q1 to Q3 of the robot file, the angles of the paper's figure, with its payload."""

    def worst(self, name: str) -> float:
        """Return the largest deviation of the simulated "f_d" or "zeta" from the formula [%]."""
        pairs = ((getattr(one, f"simulated_{name}"), getattr(one, name)) for one in self.curve)
        return max(100.0 * abs(float(simulated / formula) - 1.0) for simulated, formula in pairs)


def pluck_all() -> OneJointModes:
    """Pluck the arm over its whole range."""
    description = load("one-joint")
    curve = [_plucked(description, mass, elbow) for mass in MASSES for elbow in ANGLES]
    elbows = [description.poses[name][1] for name in ("Q1", "Q2", "Q3")]
    poses = [_plucked(description, description.payload.mass, elbow) for elbow in elbows]
    return OneJointModes(description, tuple(curve), tuple(poses))


def _plucked(description: RobotDescription, mass: float, elbow: float) -> Plucked:
    payload = body(paper_payload(description, mass))
    formula = FlexibleShoulder.of(description, payload)
    ring = pluck(description, payload, elbow)
    return Plucked(mass, elbow, formula.inertia(elbow), *formula.mode(elbow), ring.f_d, ring.zeta)


def pluck(description: RobotDescription, payload: Payload, elbow: float) -> RingDown:
    """Twist the shoulder, release it, and fit a damped sine to the accelerometer, without knowledge of the arm."""
    plant = FlexibleArm(description, payload)
    still = DriveCommand(np.array([0.0, elbow]), np.zeros(2), np.zeros(2))
    plant.reset(still, seed=0)
    plant.push(np.array([TORQUE, 0.0]))
    for _ in range(round(HELD / PERIOD)):
        plant.step(still)
    plant.push(np.zeros(2))
    felt = np.array([plant.step(still).accelerometer for _ in range(round(LISTENED / PERIOD))])
    return fit_ring_down(felt - GRAVITY, PERIOD)
