"""Cells for tests: a gripper at the end of the arm, and parts where it is at the start."""

import msgspec
import numpy as np

from tvist_controller.cell.description import Cell, as_declared
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import Placement, placement

from .robots import UR5E
from .scripts import URSIM, a_robot

TOOL = {"name": "2F-85", "mass": 0.9, "cog": (0, 0, 0.06), "tcp": (0, 0, 0.163, 0, 0, 0)}
HERE = Placement(*Arm(UR5E, TOOL["tcp"]).pose(np.array(URSIM)))
"""Pose of the tool centre point at the start."""


def part(away=(0,) * 6, **changes):
    """A part at a pose relative to the tool centre point at the start."""
    pose = (HERE @ placement(away)).vector
    return {"name": "box", "mass": 1.5, "size": (0.06, 0.05, 0.08), "pose": pose} | changes


def a_cell(*parts, **changes):
    """A cell with an active gripper."""
    content = {"tools": [TOOL], "gripper": {"model": "2F-85", "activated": True}, "parts": parts}
    return msgspec.convert(content | changes, Cell)


def in_cell(*parts, robot=None, **changes):
    """A robot in this cell, with the first tool declared."""
    cell = a_cell(*parts, **changes)
    return a_robot(**({"cell": cell, "payload": as_declared(cell.tools[0])} | (robot or {})))
