"""The wrench at the tool by a force sensor in the flange, without the weight of the declared payload."""

from collections.abc import Sequence

import numpy as np

from tvist_plant.model import Floats
from tvist_plant.plant import GRAVITY
from tvist_protocol.values import Payload


def without_weight(raw: Floats, rotation: Floats, payload: Payload) -> Floats:
    """Return what a sensor feels beside the weight of the payload, in its own frame, shape (6,) [N, N m].

    As on UR's e-Series, only the weight is taken away, not what it takes to accelerate the payload.

    Args:
        raw: Force and torque about the flange's origin in its frame, shape (6,) [N, N m].
        rotation: Rotation from the flange to the base frame, shape (3, 3).
        payload: Declared payload.
    """
    weight = -payload.mass * GRAVITY * rotation[2]
    felt: Floats = raw - np.concatenate((weight, np.cross(payload.com, weight)))
    return felt


def at_tool(felt: Floats, rotation: Floats, offset: Sequence[float]) -> Floats:
    """Return a wrench at the tool centre point in the base frame, shape (6,) [N, N m].

    Args:
        felt: Force and torque about the flange's origin in its frame, shape (6,) [N, N m].
        rotation: Rotation from the flange to the base frame, shape (3, 3).
        offset: Tool centre point in the flange frame [m, rad].
    """
    force = felt[:3]
    return np.concatenate((rotation @ force, rotation @ (felt[3:] - np.cross(offset[:3], force))))
