"""Arms and commands for the tests of the plant."""

import msgspec
import numpy as np
import pinocchio as pin

from tvist_plant.description import RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections
from tvist_plant.model import rigid_model


def changed(description: RobotDescription, table: str, **values) -> RobotDescription:
    """The description with other values in one of its tables."""
    replace = msgspec.structs.replace
    return replace(description, **{table: replace(getattr(description, table), **values)})


def quiet(description: RobotDescription) -> RobotDescription:
    """Without noise and gear error; friction stays as it is."""
    without_noise = changed(description, "sensors", accelerometer_noise=0.0)
    return changed(without_noise, "drives", gear_error_amplitude=0.0)


def conservative(description: RobotDescription) -> RobotDescription:
    """Without anything that takes or gives energy: no drives, no damping, no friction, no gear error."""
    zero = (0.0,) * description.joints
    limp = changed(
        quiet(description),
        "drives",
        gear_damping=zero,
        velocity_gain=zero,
        position_gain=zero,
        integral_gain=zero,
        coulomb_friction=zero,
    )
    return changed(limp, "link_flexibility", damping_time=0.0)


def hold(description: RobotDescription, q) -> DriveCommand:
    """Hold a pose, gravity of the rigid arm fed forward."""
    model = rigid_model(description, description.payload)
    q = np.array(q, dtype=float)
    gravity = pin.computeGeneralizedGravity(model, model.createData(), q).copy()
    return DriveCommand(q, np.zeros_like(q), gravity)


def standing(description: RobotDescription, q, *, carries=None, **imperfections):
    """The simulated arm at rest in a pose, the command that holds it, and the first measurement.

    Gravity of the file's payload is fed forward; `carries` is another payload that the arm carries.
    """
    more = {"imperfections": Imperfections(**imperfections), "substeps": 8} if imperfections else {}
    arm, command = FlexibleArm(description, description.payload, **more), hold(description, q)
    return arm, command, arm.reset(command, payload=carries)


def rested(arm, command: DriveCommand, ticks: int):
    """The last measurement of an arm that has been held for some ticks."""
    for _ in range(ticks):
        measured = arm.step(command)
    return measured


def energy(arm: FlexibleArm) -> float:
    """Kinetic, gravitational and elastic energy [J]."""
    model, data, flexible, joints = arm._flexible.model, arm._data, arm._flexible, arm._joints
    kinetic = (
        pin.computeKineticEnergy(model, data, arm._q, arm._qd) + 0.5 * joints.rotor_inertia @ arm._speed**2
    )
    gears = 0.5 * joints.gear_stiffness @ (arm._q[flexible.joints] - arm._motor) ** 2
    links = 0.5 * flexible.flex_stiffness @ arm._q[flexible.flexes] ** 2
    return float(kinetic + pin.computePotentialEnergy(model, data, arm._q) + gears + links)


def chain(joints: int) -> RobotDescription:
    """An arm of equal links, every second joint turned by a right angle, whose first link bends."""

    def each(value):
        return [value] * joints

    return msgspec.convert(
        {
            "robot": {"name": "chain", "model": "Chain", "joints": [f"joint_{i}" for i in range(joints)]},
            "kinematics": {
                "a": each(0.25),
                "d": each(0.1),
                "alpha": [np.pi / 2 * (i % 2) for i in range(joints)],
            },
            "links": {
                "mass": each(2.0),
                "com": each([-0.12, 0.01, 0.02]),
                "inertia": each([0.004, 0.0, 0.0, 0.02, 0.0, 0.02]),
            },
            "limits": {
                "position": each(6.28),
                "velocity": each(3.0),
                "acceleration": each(40.0),
                "jerk": each(2000.0),
                "torque": each(150.0),
                "payload": 3.0,
                "repeatability": 3e-5,
            },
            "payload": {"mass": 1.0, "com": [0.0, 0.0, 0.03], "inertia": [1e-3, 0.0, 0.0, 1e-3, 0.0, 1e-3]},
            "drives": {
                "gear_stiffness": each(20000.0),
                "gear_damping": each(4.0),
                "rotor_inertia": each(0.8),
                "velocity_gain": each(500.0),
                "position_gain": each(18.0),
                "integral_gain": each(2.0),
                "coulomb_friction": each(3.0),
                "friction_width": 0.1,
                "friction_feedforward": 0.8,
                "friction_feedforward_width": 0.02,
                "windup_feedforward": each(0.3),
                "gear_error_amplitude": 2e-5,
                "gear_error_waves": 202.0,
            },
            "link_flexibility": {"links": [0], "stiffness": [1e5], "damping_time": 3e-4},
            "sensors": {"accelerometer_noise": 0.03},
        },
        RobotDescription,
    )


def frames(description: RobotDescription, q) -> list[np.ndarray]:
    """Frames of base and links, 4x4 each, by the textbook's products of Denavit-Hartenberg matrices."""
    kinematics, found = description.kinematics, [np.eye(4)]
    for theta, a, d, alpha in zip(q, kinematics.a, kinematics.d, kinematics.alpha, strict=True):
        ct, st, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
        link = [
            [ct, -st * ca, st * sa, a * ct],
            [st, ct * ca, -ct * sa, a * st],
            [0, sa, ca, d],
            [0, 0, 0, 1],
        ]
        found.append(found[-1] @ np.array(link))
    return found


def forward_kinematics(description: RobotDescription, q) -> np.ndarray:
    """Pose of the flange, 4x4."""
    return frames(description, q)[-1]
