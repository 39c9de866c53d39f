"""The arm as the controller believes it to be, moved by the commands that the real one got."""

import numpy as np
from msgspec.structs import replace

from tvist_controller.calibrations.modal import drivetrain
from tvist_controller.experience.motion_record import Beliefs, MotionRecord
from tvist_controller.setup import body
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import Floats, Integers, flexible_model
from tvist_plant.plant import Response
from tvist_protocol.calibration import Calibration


class Twin:
    """A flexible arm without noise, gear errors or imperfections.

    Args:
        description: The robot file, for masses, geometry and friction.
        beliefs: Payload and, of a modal calibration, springs and drives; those of the robot file without one.
    """

    def __init__(self, description: RobotDescription, beliefs: Beliefs) -> None:
        calibration = beliefs.calibration
        if calibration is not None and calibration.modal is not None:
            description = identified_arm(description, calibration)
        drives = replace(description.drives, gear_error_amplitude=0.0)
        # Nobody has told a controller what the robot file says of its simulated arm alone.
        self.description = replace(description, drives=drives, imperfections={})
        """The arm."""
        self.arm = FlexibleArm(self.description, body(beliefs.payload))

    def play(
        self, motion: MotionRecord, more: Floats | None = None, payload: Payload | None = None
    ) -> Response:
        """Make a motion.

        Args:
            motion: The motion.
            more: What is added to its commands, shape (T, 3, n); None for nothing.
            payload: Payload to carry from now on; None for the last one.

        Raises:
            PlantError: The state is no longer finite.
        """
        rest = DriveCommand(motion.rest.q, np.zeros_like(motion.rest.q), motion.rest.torque)
        self.arm.reset(rest, payload=payload)
        return self.arm.play(motion.commands if more is None else motion.commands + more)


def identified_arm(description: RobotDescription, calibration: Calibration) -> RobotDescription:
    """Return a robot file's arm with springs and drives from a modal calibration.

    Raises:
        EstimatorError: The calibration has no modal model, or lacks a parameter.
    """
    assert calibration.modal is not None, "only a modal calibration has springs"
    flexible = flexible_model(description, Payload())
    springs = drivetrain(calibration.modal.parameters, description, flexible)
    stiffness, rotors, speeds, positions, damping = springs.rows

    def of(row: Floats, places: Integers = flexible.joints) -> tuple[float, ...]:
        return tuple(row[places].tolist())

    drives = replace(
        description.drives, gear_stiffness=of(stiffness), gear_damping=of(damping), rotor_inertia=of(rotors),
        velocity_gain=of(speeds), position_gain=of(positions),
    )  # fmt: skip
    links = description.link_flexibility
    if len(flexible.flexes):
        first = flexible.flexes[::2]
        links = replace(
            links, stiffness=of(stiffness, first), damping_time=float(damping[first[0]] / stiffness[first[0]])
        )
    return replace(description, drives=drives, link_flexibility=links)
