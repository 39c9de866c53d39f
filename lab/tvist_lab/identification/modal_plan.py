"""Measurements for a modal calibration, and their configurations."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tvist_controller.api.line import CollisionModel, body
from tvist_lab.identification.identify import IdentificationError
from tvist_lab.identification.ring_downs import Jog
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified, ranges
from tvist_plant.description import RobotDescription
from tvist_plant.similar import Scale
from tvist_protocol.values import Payload

RING_DOWNS = 12
LEAST = 4
"""Number of ring-downs below which the model consists of little more than its guesses."""


@dataclass(frozen=True)
class ModalPlan:
    """Measurements to make."""

    ring_downs: int = RING_DOWNS
    """Total number of ring-downs, divided equally among the payloads, with one more for some if necessary."""
    payloads: tuple[Payload, ...] = ()
    """Payloads that a simulated arm carries one after the other; empty to use the declared one, which the arm
    carries.
    """
    seed: int = 0
    """Seed of the candidate configurations."""
    jog: Jog = field(default_factory=Jog)


def jog_of(description: RobotDescription) -> Jog:
    """Return the jog for an arm: a quicker one if the arm is shorter than the UR5e, so that its tool shakes as much."""
    return Jog(quickness=max(1.0, 1.0 / Scale(description.kinematics, description.limits.torque).time))


def check(plan: ModalPlan, payloads: int) -> None:
    """Check that there are enough ring-downs, before the arm moves.

    Raises:
        IdentificationError: There are too few.
    """
    least = max(LEAST, payloads)
    if plan.ring_downs < least:
        raise IdentificationError(
            f"{plan.ring_downs} ring-downs with {payloads} payloads are too few for springs and drives: "
            f"at least {least} are needed, 12 are recommended"
        )


def free_configurations(
    description: RobotDescription,
    payloads: Sequence[Payload],
    count: int,
    plan: ModalPlan,
    like: Floats | None = None,
) -> list[Floats]:
    """Return configurations in which the arm is clear at both ends of the jog, with every payload.

    Base and outer wrist joints, on which the modes hardly depend, are as in the configuration `like`, or else zero.
    """
    joints = description.joints
    models = [CollisionModel(description, body(payload)) for payload in payloads]
    jog = plan.jog.of(joints)
    found: list[Floats] = []
    region = identified(ranges(description), plan.jog.length)
    aside = np.zeros(joints) if like is None else like * [joint not in (1, 2, 3) for joint in range(joints)]
    for q in region.spread(20 * count, joints, plan.seed) + aside:
        if len(found) == count:
            break
        if all(model.meeting(end) is None for model in models for end in (q, q - jog)):
            found.append(q)
    return found
