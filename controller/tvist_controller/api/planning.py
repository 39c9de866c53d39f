"""Geometry for studies: where the tool is.

The modules behind it may change.
"""

from tvist_controller.kinematics.tool import ToolKinematics, turned
from tvist_controller.paths.poses import placement_vector

__all__ = [
    "ToolKinematics",
    "placement_vector",
    "turned",
]
