"""What is not known of an arm's springs and drives before it is measured, and what such arms have."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tvist_controller.api import body, drivetrain, mass_matrix
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription
from tvist_plant.model import FlexibleModel, flexible_model
from tvist_protocol.calibration import ModalParameter, Quantity, Status
from tvist_protocol.values import Payload
from tvist_shaping.estimators.drivetrain import Drivetrain

LARGE = 3
"""Joints from the base on that have the large drives, each with parameters of its own."""
UNSURE = 0.7
"""Standard deviation of a guess's logarithm: within a factor of four with 95 % [-]."""
NARROWER = 0.5
"""A parameter is identified where measurements leave less than this share of the guess's deviation [-]."""
SURE = 1.959963984540054
"""Standard deviations within which a normal variable lies with 95 % [-]."""


@dataclass(frozen=True)
class Unknown:
    """A parameter before it is measured: guessed for robot arms of 5 kg payload in general."""

    quantity: Quantity
    joints: tuple[int, ...]
    """Joints it is the same for; links for `bending_stiffness`."""
    guess: float
    """[SI]."""
    deviation: float = UNSURE
    """Standard deviation of its logarithm; 0: assumed [-]."""


def unknowns(description: RobotDescription) -> tuple[Unknown, ...]:
    """Parameters of an arm's linear model: one a large joint, one for all joints of the wrist.

    Rotors' inertia is assumed: in the frequencies that ring it hardly differs from a little more link inertia.
    """
    joints = range(description.joints)
    wrist = tuple(joints[LARGE:])
    found = []
    for joint in joints[:LARGE]:
        found += [
            Unknown("gear_stiffness", (joint,), 24_000.0),
            Unknown("velocity_gain", (joint,), 800.0),
            Unknown("rotor_inertia", (joint,), 1.0, 0.0),
        ]
    if wrist:
        found += [
            Unknown("gear_stiffness", wrist, 8_000.0),
            Unknown("velocity_gain", wrist, 300.0),
            Unknown("rotor_inertia", wrist, 0.2, 0.0),
        ]
    found += [Unknown("position_gain", tuple(joints), 12.0), Unknown("damping_time", tuple(joints), 2e-4)]
    # A beam gets stiffer towards the base, where it is thicker.
    links = description.link_flexibility.links
    found += [
        Unknown("bending_stiffness", (link,), 200_000.0 if link == min(links) else 100_000.0)
        for link in links
    ]
    return tuple(found)


class ArmModes:
    """Modes of an arm as functions of what is unknown of it, with each of several payloads.

    Args:
        description: The robot; of it only kinematics, masses and which links bend are used.
        payloads: What it carries.
    """

    def __init__(self, description: RobotDescription, payloads: Sequence[Payload]) -> None:
        self.description = description
        self.payloads = tuple(payloads)
        self.unknowns = unknowns(description)
        self._flexible: list[FlexibleModel] = [flexible_model(description, body(p)) for p in payloads]
        self._masses = [mass_matrix(flexible) for flexible in self._flexible]
        self.sought = [number for number, unknown in enumerate(self.unknowns) if unknown.deviation > 0.0]
        """Numbers of the unknowns that are sought, in the order of the parameter vector."""
        self.guess: Floats = np.log([self.unknowns[number].guess for number in self.sought])
        """Logarithms, shape (P,)."""
        self.deviation: Floats = np.array([self.unknowns[number].deviation for number in self.sought])
        """Deviations of the initial guess, shape (P,)."""

    def flexible(self, payload: int) -> FlexibleModel:
        """Model with one of the payloads."""
        return self._flexible[payload]

    def mass(self, q: Floats, payload: int) -> Floats:
        """M(q), shape (L, L)."""
        return self._masses[payload](q).copy()

    def drivetrain(self, logarithms: Floats) -> Drivetrain:
        """Springs and drives, of the parameters' logarithms, shape (P,)."""
        return drivetrain(self.parameters(logarithms), self.description, self._flexible[0])

    def parameters(self, logarithms: Floats, deviations: Floats | None = None) -> tuple[ModalParameter, ...]:
        """Parameters as a calibration says them.

        Args:
            logarithms: Logarithms of the sought parameters, shape (P,).
            deviations: Standard deviations of the logarithms, shape (P,); None if unknown.
        """
        values = {number: float(np.exp(log)) for number, log in zip(self.sought, logarithms, strict=True)}
        errors = dict(zip(self.sought, deviations.tolist(), strict=True)) if deviations is not None else {}
        found = []
        for number, unknown in enumerate(self.unknowns):
            value, error = values.get(number, unknown.guess), errors.get(number, 0.0)
            status: Status = "assumed"
            if number in values:
                status = "identified" if error < NARROWER * unknown.deviation else "not identifiable"
            found.append(
                ModalParameter(
                    quantity=unknown.quantity,
                    joints=unknown.joints,
                    value=value,
                    deviation=error,
                    interval=(value * float(np.exp(-SURE * error)), value * float(np.exp(SURE * error))),
                    status=status,
                )
            )
        return tuple(found)
