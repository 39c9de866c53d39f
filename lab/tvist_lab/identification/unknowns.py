"""Unknown parameters of an arm's springs and drives before a measurement, with typical values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from msgspec.structs import replace

from tvist_controller.api.line import body, drivetrain, mass_matrix
from tvist_lab.recordings import Floats
from tvist_plant.description import Payload as Body
from tvist_plant.description import RobotDescription
from tvist_plant.model import FlexibleModel, flexible_model
from tvist_plant.similar import WRIST, Scale
from tvist_protocol.calibration import ModalParameter, Quantity, Status
from tvist_protocol.values import Payload
from tvist_shaping.estimators.drivetrain import Drivetrain

LARGE = 3  # number of joints from the base, of up to six, with large drives; each has its own parameters
TYPICAL_GAIN = (800.0, 300.0)
"""Velocity gain over torque of a large and of a wrist joint, for an arm of about 5 kg payload [s/rad]."""
UNSURE = 0.7  # standard deviation of a guess's logarithm [-]: within a factor of four with 95 % probability
SET = 0.2  # deviation of a position gain's logarithm [-]: the maker sets it, and it does not scatter
ROTOR = 0.2  # deviation of a rotor inertia's logarithm [-]: it is nearly proportional to the drive's torque
LINK_MASS = 0.03  # relative standard deviation of each link's mass from the description [-]
PAYLOAD_MASS = 0.04  # standard deviation of the payload's mass, relative to the rated payload [-]
SCATTER = 0.12  # relative standard deviation of joints that share a parameter [-]
NARROWER = 0.5  # a parameter counts as identified if its deviation is below this share of the guess's [-]
FURTHEST = 3.0  # largest change of a parameter from the robot file, in standard deviations [-]
STEEL = 7850.0  # density from which a payload's size is estimated [kg/m³]
Z_95 = 1.959963984540054  # standard deviations that contain 95 % of a normal variable [-]


@dataclass(frozen=True)
class Unknown:
    """A parameter before it is measured, with a guess."""

    quantity: Quantity
    joints: tuple[int, ...]  # joints that share the parameter; links for `bending_stiffness`
    guess: float  # guessed value [SI]
    deviation: float = UNSURE  # standard deviation of its logarithm [-]


def unknowns(description: RobotDescription) -> tuple[Unknown, ...]:
    """Return the parameters of an arm's linear model: one per large joint, one for all joints of the wrist.

    Guesses are the robot file's values (geometric mean for a shared parameter), so that parameters without
    information stay as in the file. Their deviations are wide, since values in a file are often assumed. For
    a gain of zero, the guess is that of an arm of about 5 kg payload. The deviation of rotor inertias is
    small, since they act on the visible frequencies like additional link inertia.
    """
    joints = range(description.joints)
    large = max(LARGE, description.joints - WRIST)
    drives, flexibility = description.drives, description.link_flexibility
    scale = Scale(description.kinematics, description.limits.torque)
    stiffness, gain = np.array(drives.gear_stiffness), np.array(drives.velocity_gain)
    rotor, loop = (
        np.array(drives.rotor_inertia),
        np.array(drives.position_gain) + np.array(drives.integral_gain),
    )
    groups = [(joint,) for joint in joints[:large]] + ([tuple(joints[large:])] if joints[large:] else [])
    found = []
    for group in groups:
        own, typical = [*group], TYPICAL_GAIN[group[0] >= large] * scale.torque[group[0]] * scale.time
        found += [
            Unknown("gear_stiffness", group, _mean(stiffness[own])),
            Unknown("velocity_gain", group, _mean(gain[own], typical)),
            Unknown("rotor_inertia", group, _mean(rotor[own]), ROTOR),
        ]
    return (
        *found,
        Unknown("position_gain", tuple(joints), _mean(loop, 12.0 / scale.time), SET),
        Unknown(
            "damping_time", tuple(joints), _mean(np.array(drives.gear_damping) / stiffness, 2e-4 * scale.time)
        ),
        *(
            Unknown("bending_stiffness", (link,), value)
            for link, value in zip(flexibility.links, flexibility.stiffness, strict=True)
        ),
    )


def _mean(values: Floats, typical: float = 1.0) -> float:
    """Return the geometric mean of the positive values, or `typical` if there is none."""
    positive = values[values > 0.0]
    return float(np.exp(np.mean(np.log(positive)))) if len(positive) else typical


class ArmModes:
    """Modes of an arm as functions of its unknown parameters, with each of several payloads."""

    def __init__(self, description: RobotDescription, payloads: Sequence[Payload]) -> None:
        self.description = description
        self.payloads = tuple(payloads)
        self.unknowns = unknowns(description)
        self.flexible: list[FlexibleModel] = [flexible_model(description, body(p)) for p in payloads]
        self._masses = [mass_matrix(flexible) for flexible in self.flexible]
        self.guess: Floats = np.log([unknown.guess for unknown in self.unknowns])
        """Logarithms of the guesses, shape (P,)."""
        self.deviation: Floats = np.array([unknown.deviation for unknown in self.unknowns])
        """Standard deviations of these logarithms, shape (P,)."""

    def mass(self, q: Floats, payload: int) -> Floats:
        """Return M(q), shape (L, L)."""
        return self._masses[payload](q).copy()

    def heavier(self, q: Floats, payload: int) -> list[Floats]:
        """Return variants of M(q), (L, L), with each link, and last the payload, heavier by a deviation."""
        models = (flexible_model(*one) for one in heavier(self.description, body(self.payloads[payload])))
        return [mass_matrix(model)(q).copy() for model in models]

    def drivetrain(self, logarithms: Floats) -> Drivetrain:
        """Return springs and drives for the parameters' logarithms, shape (P,)."""
        return drivetrain(self.parameters(logarithms), self.description, self.flexible[0])

    def parameters(self, logarithms: Floats, deviations: Floats | None = None) -> tuple[ModalParameter, ...]:
        """Convert logarithms and their standard deviations to parameters of a calibration."""
        errors = np.zeros(len(logarithms)) if deviations is None else deviations
        return tuple(map(parameter, self.unknowns, np.exp(logarithms).tolist(), errors.tolist()))


def heavier(description: RobotDescription, carried: Body) -> list[tuple[RobotDescription, Body]]:
    """Return pairs of description and payload; in each pair, one mass is larger by a standard deviation."""
    links, found = description.links, []
    for factor in 1.0 + LINK_MASS * np.eye(description.joints):
        mass = tuple((factor * links.mass).tolist())
        inertia = tuple(map(tuple, (factor[:, None] * links.inertia).tolist()))
        found.append((replace(description, links=replace(links, mass=mass, inertia=inertia)), carried))
    more = PAYLOAD_MASS * description.limits.payload
    return [*found, (description, replace(carried, mass=carried.mass + more))]


def parameter(unknown: Unknown, value: float, deviation: float) -> ModalParameter:
    """Convert a value [SI] and the standard deviation of its logarithm [-] to a parameter of a calibration."""
    if len(unknown.joints) > 1:
        deviation = math.hypot(deviation, SCATTER)
    status: Status = "identified" if deviation < NARROWER * unknown.deviation else "not identifiable"
    return ModalParameter(
        quantity=unknown.quantity,
        joints=unknown.joints,
        value=value,
        deviation=deviation,
        interval=(value * float(np.exp(-Z_95 * deviation)), value * float(np.exp(Z_95 * deviation))),
        status=status,
    )


def ball(mass: float) -> tuple[float, float, float, float, float, float]:
    """Return a steel ball's inertia [kg m²]: torques cannot tell the payload's inertia from the rotors'."""
    radius = (3.0 * mass / (4.0 * math.pi * STEEL)) ** (1.0 / 3.0)
    moment = 0.4 * mass * radius**2
    return (moment, 0.0, 0.0, moment, 0.0, moment)
