"""A planned path, unshaped and shaped in two ways: along its parameter, and joint by joint."""

from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import PlannedMotion, Setup, paper_payload
from tvist_controller.api.planning import plan_from_rest
from tvist_lab.recordings import Floats
from tvist_lab.studies.random_paths import ToolMove
from tvist_lab.study.shaping import Running, shape
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter

ALONG, JOINTS, UNSLOWED = "along", "joints", "joints_unslowed"
WAYS = {
    ALONG: "along the path",
    JOINTS: "joint by joint",
    UNSLOWED: "joint by joint, not slowed down",
}
"""Ways to shape a path, by name. The first two shape the reference that the robot plans for the shaper; the third one
shapes what it plans without a shaper, which is quicker in bends.
"""
SPACING = 5e-5
"""Distance of the postures at which a path is sampled, in units of its parameter [m]."""


@dataclass(frozen=True)
class Reference:
    """A path with its time law."""

    motion: PlannedMotion
    """The motion, which has not begun."""
    s: Floats
    """The path's parameter in each tick until its end, shape (T, 1) [m]."""
    q: Floats
    """Postures in these ticks, shape (T, n) [rad]."""

    def sampled(self) -> Floats:
        """Postures along the whole path at small distances, shape (k, n) [rad]."""
        end = float(self.motion.path.end[0])
        places = np.linspace(0.0, end, max(int(np.ceil(end / SPACING)), 2) + 1)
        return np.array([self.motion.path.posture(np.array([s])) for s in places])


def planned(
    description: RobotDescription, calibration: Calibration, shaper: str, move: ToolMove
) -> tuple[Reference, Filter] | None:
    """Plan a path as a robot does that uses a shaper and knows its payload.

    Returns:
        The reference, and the filter at rest at q = 0; None if the path has a stop on its way, since a blend is left
        out.

    Raises:
        RefusalError: The robot refuses the path, or has no such shaper.
    """
    payload = paper_payload(description, move.mass)
    setup = Setup(
        description=description, q=move.start, payload=payload, calibration=calibration, shaper=shaper
    )
    plan, tvist = plan_from_rest(setup, move.command)
    return (reference_of(plan.parts[0]), tvist) if len(plan.parts) == 1 else None


def reference_of(motion: PlannedMotion) -> Reference:
    """Return the samples of a motion at full speed."""
    playing, s = motion.fork(), []
    while not playing.finished:
        s.append(playing.next())
    return Reference(motion, np.array(s), np.array([motion.path.posture(x) for x in s]))


def shaped(reference: Reference, tvist: Filter, way: str) -> Floats:
    """Shape a reference from rest.

    Args:
        reference: The reference, planned for the shaper or without one, whichever the way asks for.
        tvist: The filter; it is not changed.
        way: Name of one of `WAYS`.

    Returns:
        Postures up to the end and a few ticks more, shape (T', n) [rad].

    Raises:
        ShaperFaultError: The shaper's function fails.
    """
    path, mine = reference.motion.path, tvist.fork()
    if way != ALONG:
        mine.reset(path.posture(path.start))
        mine.aim(path.posture(path.end))
        return shape(Running(mine), reference.q, watched=False).q
    mine.reset(path.start, path.posture_of)
    mine.aim(path.end)
    samples = shape(Running(mine), reference.s, watched=False).q
    return np.array([path.posture(x) for x in samples])
