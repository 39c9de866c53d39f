"""Moves steered by velocities: those of `servoc`, and all moves in force mode."""

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

ARRIVED = 1e-5  # distance at which a move without blend has arrived [m, and rad times `TURN`]
TURN = 0.25  # length equivalent to a turn by 1 rad [m]
SETTLING = 4.0  # ticks in which the remaining distance decays at the end


class ForceModeMoves:
    """Steers one robot."""

    def __init__(self, access: Access, arm: ProgramArm, kinematics: ProgramKinematics) -> None:
        self._access, self._arm, self._kinematics = access, arm, kinematics

    def follow(self, segment: Segment) -> Turns:
        """Move along a part of a path in the stiff axes; with a blend, return at its radius."""
        if self._access.force.by_hand:
            raise Fault("in freedrive the arm follows no moves: call end_freedrive_mode before")
        if isinstance(segment, ArcSegment):
            raise Fault(
                "force mode allows lines and joint moves, no arcs: call end_force_mode before, or movel"
            )
        guidance, most = self._access.guidance, 2.0 * segment.acceleration
        duration = None if isinstance(segment, ProcessSegment) else segment.duration
        velocity = segment.velocity if duration is None else self._way(segment)[1] / duration
        yield from self.lead(segment, max(velocity, ARRIVED), most, max(segment.blend, ARRIVED))
        if segment.blend == 0.0:
            yield from self._arm.halt(lambda: guidance.stop_joints(guidance.limits.acceleration))

    def lead(self, segment: Segment, velocity: float, most: float, near: float) -> Turns:
        """Steer joints or tool to a move's end, until at most `near` away; the tool accelerates at `most`."""
        guidance, deceleration = self._access.guidance, segment.acceleration

        def start(shaped: bool) -> int:
            away, far = self._way(segment)
            speed = min(velocity, math.sqrt(2.0 * deceleration * far), far / (SETTLING * PERIOD))
            rates = away * (speed / far) if far > 0.0 else away
            if isinstance(segment, JointSegment):
                return guidance.move_joints(rates, guidance.limits.acceleration, shaped=shaped)
            return guidance.move_tool(rates, most, most / TURN, shaped=shaped)

        def wait() -> Turns:
            yield
            while self._way(segment)[1] > near:
                yield from self._arm.regain()
                self._arm.steer(start)
                yield

        return self._arm.guide(start, wait())

    def _way(self, segment: Segment) -> tuple[Floats, float]:
        """Return the remaining way of a move and its length, in joints or of the tool."""
        here = self._access.guidance.reference
        if isinstance(segment, JointSegment):
            turn = np.array(segment.q) - here
            return turn, float(np.abs(turn).max())
        away = self._kinematics.difference(self._kinematics.tool_pose(here), segment.pose)
        return away, max(float(np.linalg.norm(away[:3])), TURN * float(np.linalg.norm(away[3:])))
