"""Unknown parameters of an arm's springs and drives before a measurement, with typical values."""

import dataclasses
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

LARGE = 3
"""Number of joints with large drives, counted from the base, of an arm of up to six; each has its own parameters."""
UNSURE = 0.7
"""Standard deviation of a guess's logarithm: within a factor of four with 95 % probability [-]."""
SET = 0.2
"""The same of a position gain in a robot file, which its maker has set and no joint scatters from [-]."""
ROTOR = 0.2
"""The same of the rotors' inertia, which is nearly proportional to the torque of a kind of drive [-]."""
LINK_MASS = 0.03
"""Standard deviation of each link's mass from the description, relative [-]."""
PAYLOAD_MASS = 0.04
"""Standard deviation of the payload's mass from the declared one, relative to the rated payload [-]."""
SCATTER = 0.12
"""Standard deviation by which each joint of a group that shares a parameter may differ from it, relative [-]."""
NARROWER = 0.5
"""A parameter is identified if measurements reduce its deviation below this share of the guess's [-]."""
FURTHEST = 3.0
"""Number of deviations by which a parameter may differ from what a robot file says; beyond, it would stand for what the
model lacks.
"""
SURE = 1.959963984540054
"""Number of standard deviations that contain a normal variable with 95 % probability [-]."""


@dataclass(frozen=True)
class Unknown:
    """A parameter before it is measured, with a guess."""

    quantity: Quantity
    joints: tuple[int, ...]
    """Joints that share the parameter; links for `bending_stiffness`."""
    guess: float
    """Guessed value [SI]."""
    deviation: float = UNSURE
    """Standard deviation of its logarithm; 0 if it is assumed to be exact [-]."""


def unknowns(description: RobotDescription) -> tuple[Unknown, ...]:
    """Return the parameters of an arm's linear model: one per large joint, and one for all joints of the wrist.

    The guesses are those for an arm of about 5 kg payload, scaled as `Scale` scales springs and drives. The rotors'
    inertia has nearly the same effect on the visible frequencies as more link inertia, so its guess is a close one:
    the description's, as in the drives' feed-forward.
    """
    joints = range(description.joints)
    large = max(LARGE, description.joints - WRIST)
    scale = Scale(description.kinematics, description.limits.torque)
    groups: list[tuple[tuple[int, ...], float, float]] = [
        ((joint,), 24_000.0, 800.0) for joint in joints[:large]
    ]
    if joints[large:]:
        groups.append((tuple(joints[large:]), 8_000.0, 300.0))
    found = []
    for group, stiffness, gain in groups:
        torque = scale.torque[group[0]]
        rotor = float(np.mean([description.drives.rotor_inertia[joint] for joint in group]))
        found += [
            Unknown("gear_stiffness", group, stiffness * torque),
            Unknown("velocity_gain", group, gain * torque * scale.time),
            Unknown("rotor_inertia", group, rotor, ROTOR),
        ]
    found += [
        Unknown("position_gain", tuple(joints), 12.0 / scale.time),
        Unknown("damping_time", tuple(joints), 2e-4 * scale.time),
    ]
    # A beam is stiffer towards the base, where it is thicker.
    links = description.link_flexibility.links
    found += [
        Unknown(
            "bending_stiffness",
            (link,),
            (200_000.0 if link == min(links) else 100_000.0) * scale.torque[link],
        )
        for link in links
    ]
    return tuple(found)


def unknowns_near(description: RobotDescription) -> tuple[Unknown, ...]:
    """Return the same parameters with the robot file's values as guesses, for measurements that were not planned.

    What such measurements do not tell then stays as the file has it. The deviations remain, for springs and drives of a
    file are often assumed. A shared parameter has the geometric mean of its joints.
    """
    drives, flexibility = description.drives, description.link_flexibility
    K_g, D_g = np.array(drives.gear_stiffness), np.array(drives.gear_damping)
    per_joint = {
        "gear_stiffness": K_g,
        "velocity_gain": np.array(drives.velocity_gain),
        "rotor_inertia": np.array(drives.rotor_inertia),
        "position_gain": np.array(drives.position_gain) + np.array(drives.integral_gain),
        "damping_time": D_g / K_g,
    }
    bending = dict(zip(flexibility.links, flexibility.stiffness, strict=True))
    found = []
    for unknown in unknowns(description):
        values = per_joint.get(unknown.quantity)
        own = (
            np.array([bending[link] for link in unknown.joints])
            if values is None
            else values[[*unknown.joints]]
        )
        positive = own[own > 0.0]
        guess = float(np.exp(np.mean(np.log(positive)))) if len(positive) else unknown.guess
        deviation = SET if unknown.quantity == "position_gain" else unknown.deviation
        found.append(dataclasses.replace(unknown, guess=guess, deviation=deviation))
    return tuple(found)


class ArmModes:
    """Modes of an arm as functions of its unknown parameters, with each of several payloads.

    Args:
        description: The robot; only kinematics, masses, rotors and the set of bending links are used.
        payloads: Carried payloads.
        sought: The unknown parameters; None for those of `unknowns`.
    """

    def __init__(
        self,
        description: RobotDescription,
        payloads: Sequence[Payload],
        sought: tuple[Unknown, ...] | None = None,
    ) -> None:
        self.description = description
        self.payloads = tuple(payloads)
        self.unknowns = unknowns(description) if sought is None else sought
        self._flexible: list[FlexibleModel] = [flexible_model(description, body(p)) for p in payloads]
        self._masses = [mass_matrix(flexible) for flexible in self._flexible]
        self.sought = [number for number, unknown in enumerate(self.unknowns) if unknown.deviation > 0.0]
        """Indices of the estimated unknowns, in the order of the parameter vector."""
        self.guess: Floats = np.log([self.unknowns[number].guess for number in self.sought])
        """Logarithms of the guesses, shape (P,)."""
        self.deviation: Floats = np.array([self.unknowns[number].deviation for number in self.sought])
        """Standard deviations of these logarithms, shape (P,)."""
        self.furthest: Floats = (np.inf if sought is None else FURTHEST) * self.deviation
        """Largest differences of these logarithms from the guesses, shape (P,)."""

    def flexible(self, payload: int) -> FlexibleModel:
        """Return the model with one of the payloads."""
        return self._flexible[payload]

    def mass(self, q: Floats, payload: int) -> Floats:
        """M(q), shape (L, L)."""
        return self._masses[payload](q).copy()

    def heavier(self, q: Floats, payload: int) -> list[Floats]:
        """M(q) with each link in turn, and at last the payload, heavier by a standard deviation, each (L, L)."""
        models = (flexible_model(*one) for one in heavier(self.description, body(self.payloads[payload])))
        return [mass_matrix(model)(q).copy() for model in models]

    def drivetrain(self, logarithms: Floats) -> Drivetrain:
        """Return springs and drives for the parameters' logarithms, shape (P,)."""
        return drivetrain(self.parameters(logarithms), self.description, self._flexible[0])

    def parameters(self, logarithms: Floats, deviations: Floats | None = None) -> tuple[ModalParameter, ...]:
        """Convert parameters to the form of a calibration.

        Args:
            logarithms: Logarithms of the estimated parameters, shape (P,).
            deviations: Standard deviations of the logarithms, shape (P,); None if unknown.
        """
        values = {number: float(np.exp(log)) for number, log in zip(self.sought, logarithms, strict=True)}
        errors = dict(zip(self.sought, deviations.tolist(), strict=True)) if deviations is not None else {}
        return tuple(
            parameter(unknown, values[number], errors.get(number, 0.0))
            if number in values
            else parameter(unknown)
            for number, unknown in enumerate(self.unknowns)
        )


def heavier(description: RobotDescription, carried: Body) -> list[tuple[RobotDescription, Body]]:
    """Descriptions and payloads with one mass that is larger by a standard deviation."""
    links, found = description.links, []
    for link in range(description.joints):
        factor = np.ones(description.joints)
        factor[link] += LINK_MASS
        mass = tuple((factor * links.mass).tolist())
        inertia = tuple((factor[:, None] * links.inertia).tolist())
        found.append(
            (
                replace(description, links=replace(links, mass=mass, inertia=tuple(map(tuple, inertia)))),
                carried,
            )
        )
    more = PAYLOAD_MASS * description.limits.payload
    return [*found, (description, replace(carried, mass=carried.mass + more))]


def parameter(unknown: Unknown, value: float | None = None, deviation: float = 0.0) -> ModalParameter:
    """Convert a parameter to the form of a calibration.

    Args:
        unknown: What was known of it.
        value: Its value [SI]; None for the guess, which then is assumed.
        deviation: Standard deviation of its logarithm [-].
    """
    status: Status = "assumed"
    if len(unknown.joints) > 1 and value is not None:
        deviation = math.hypot(deviation, SCATTER)
    if value is not None:
        status = "identified" if deviation < NARROWER * unknown.deviation else "not identifiable"
    value = unknown.guess if value is None else value
    return ModalParameter(
        quantity=unknown.quantity,
        joints=unknown.joints,
        value=value,
        deviation=deviation,
        interval=(value * float(np.exp(-SURE * deviation)), value * float(np.exp(SURE * deviation))),
        status=status,
    )
