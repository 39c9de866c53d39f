"""Geometry for studies: where the tool is.

The modules behind it may change.
"""

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import turned
from tvist_controller.paths.poses import placement_vector

__all__ = [
    "Arm",
    "placement_vector",
    "turned",
]
