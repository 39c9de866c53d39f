"""Geometry for studies: the pose of the tool."""

from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import turned
from tvist_controller.paths.poses import placement_vector

__all__ = ["Arm", "placement_vector", "turned"]
