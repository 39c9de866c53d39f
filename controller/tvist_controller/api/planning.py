"""Planning for studies: paths of the tool, from rest, and where the tool is.

The modules behind it may change.
"""

from tvist_controller.dispatch.from_rest import plan_from_rest
from tvist_controller.kinematics.tool import ToolKinematics, turned
from tvist_controller.paths.poses import placement_vector

__all__ = [
    "ToolKinematics",
    "placement_vector",
    "plan_from_rest",
    "turned",
]
