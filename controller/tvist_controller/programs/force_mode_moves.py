"""Moves of a program in force mode: the tool or the joints are led to the target, beside the axes that give way."""

import math

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.programs.access import Access
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.journey import Turns
from tvist_controller.programs.kinematics import ProgramKinematics
from tvist_plant.plant import PERIOD
from tvist_protocol.motions import ArcSegment, JointSegment, ProcessSegment, Segment
from tvist_urscript import Fault

ARRIVED = 1e-5
"""Distance at which a move without a blend has arrived [m, and rad times the turn's length]."""
TURN = 0.25
"""Length that a turn of 1 rad counts as [m]."""
SETTLING = 4.0
"""Ticks in which the rest of the way is gone at the end."""


def approach(away: Floats, far: float, velocity: float, acceleration: float) -> Floats:
    """Velocity that lets a motion come to rest at a target; the way to it is `away`, its length `far`.

    It is at most the velocity that is given, and decelerates with the acceleration that is.
    """
    speed = min(velocity, math.sqrt(2.0 * acceleration * far), far / (SETTLING * PERIOD))
    return away * (speed / far) if far > 0.0 else away


class ForceModeMoves:
    """Leads one robot."""

    def __init__(self, access: Access, arm: ProgramArm, kinematics: ProgramKinematics) -> None:
        self._access, self._arm, self._kinematics = access, arm, kinematics

    def follow(self, segment: Segment) -> Turns:
        """Move along a part of a path in the axes that are stiff; with a blend, go on from its radius."""
        if self._access.force.by_hand:
            raise Fault("in freedrive the arm follows no moves: call end_freedrive_mode before")
        if isinstance(segment, ArcSegment):
            raise Fault(
                "force mode allows lines and joint moves, no arcs: call end_force_mode before, or movel"
            )
        guidance, near = self._access.guidance, max(segment.blend, ARRIVED)
        joints = isinstance(segment, JointSegment)
        far = self._way(segment)[1]
        duration = None if isinstance(segment, ProcessSegment) else segment.duration
        velocity = max(segment.velocity if duration is None else far / duration, ARRIVED)

        def start(shaped: bool) -> int:
            away, left = self._way(segment)
            twist = approach(away, left, velocity, segment.acceleration)
            if joints:
                return guidance.move_joints(twist, guidance.limits.acceleration, shaped=shaped)
            most = 2.0 * segment.acceleration
            return guidance.move_tool(twist, most, most / TURN, shaped=shaped)

        def wait() -> Turns:
            yield
            while self._way(segment)[1] > near:
                yield from self._arm.regain()
                self._arm.steer(start)
                yield

        yield from self._arm.guide(start, wait)
        if segment.blend == 0.0:
            yield from self._arm.halt(lambda: guidance.stop_joints(guidance.limits.acceleration))

    def _way(self, segment: Segment) -> tuple[Floats, float]:
        """Way to the end of a move, and its length, in joints or of the tool."""
        here = self._access.guidance.reference
        if isinstance(segment, JointSegment):
            turn = np.array(segment.q) - here
            return turn, float(np.abs(turn).max())
        away = self._kinematics.difference(self._kinematics.tool_pose(here), segment.pose)
        return away, max(float(np.linalg.norm(away[:3])), TURN * float(np.linalg.norm(away[3:])))
