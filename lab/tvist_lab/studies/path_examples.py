"""Two paths that show what shaping joint by joint does to a path: a circle, and a corner with a blend."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tvist_lab.recordings import Floats
from tvist_lab.studies.path_shaping import ALONG, JOINTS, Reference, planned, shaped
from tvist_lab.studies.random_paths import Kind, ToolMove, pose_of
from tvist_lab.studies.tool_path import ToolPath, poses
from tvist_lab.study.measures import kinematics
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_protocol.motions import ArcSegment, LineSegment, MovePath, Segment
from tvist_shaping.base import Filter
from tvist_shaping.catalogue import shaper
from tvist_shaping.estimators.fixed import Fixed
from tvist_shaping.filter import TvistFilter

POSTURE = (0.3, -1.5, 1.7, -1.7, -1.5, 0.3)
"""Posture of a UR arm at which both begin, away from singular ones [rad]."""
RADIUS, SPEED, ANGLE = 0.05, 0.25, np.radians(300.0)
"""Radius of the circle [m], speed of the tool on it [m/s], and the angle that it covers [rad]."""
F_D, ZETA = 6.7, 0.34
"""Mode for which `zv` is designed on the circle: the paper's lowest one at Q1, the arm stretched out [Hz, -]."""
CORNER_SPEED, CORNER_ACCELERATION, BLEND, LEG = 0.5, 3.0, 0.03, 0.2
"""Speed [m/s] and acceleration [m/s²] of the tool, blend [m] and length of both lines [m] of the corner."""
CORNER_SHAPER = "auto"
"""Shaper of the corner."""


@dataclass(frozen=True)
class Corner:
    """A right-angled corner with a blend, as seen from above."""

    path: Floats
    """Positions of the tool on its path, shape (k, 2) [m], from the corner."""
    shaped: dict[str, Floats]
    """Positions of the shaped reference in each tick, by way, shape (T, 2) [m]."""
    off: dict[str, Floats]
    """Distances of the shaped reference from the path in each tick, by way, shape (T,) [m]."""


def circle(description: RobotDescription, calibration: Calibration) -> dict[str, Any]:
    """Return how far the tool leaves a circle with `zv` for one mode, in both ways.

    At constant speed, the impulses A_j at τ_j average places of the circle that are ω τ_j apart, ω = v/r, so joint by
    joint the radius decreases by r (1 - |Σ A_j e^(-i ω τ_j)|) as far as the joints move in proportion to the tool.
    """
    position, rotation = _begin(description)

    def at(angle: float) -> Floats:
        moved: Floats = position + RADIUS * np.array([1.0 - np.cos(angle), -np.sin(angle), 0.0])
        return moved

    segment = ArcSegment(
        via=pose_of(at(0.5 * ANGLE), rotation), pose=pose_of(at(ANGLE), rotation), velocity=SPEED
    )
    reference, _ = _planned(description, calibration, "arc", (segment,), "zv")
    made = shaper("zv")
    tvist = TvistFilter(made, Fixed([F_D], [ZETA]), joints=description.joints)
    impulses = made.impulses(F_D, ZETA)
    turned = np.exp(-1j * SPEED / RADIUS * impulses.tau)
    off = {way: 1e3 * _off(description, reference, tvist, way) for way in (ALONG, JOINTS)}
    return {
        "radius_mm": 1e3 * RADIUS,
        "speed_m_s": SPEED,
        "shaper": "zv",
        "f_d_hz": F_D,
        "zeta": ZETA,
        "predicted_mm": 1e3 * RADIUS * float(1.0 - abs(impulses.A @ turned)),
        "at_constant_speed_mm": {way: float(found[len(found) // 2]) for way, found in off.items()},
        "largest_distance_mm": {way: float(found.max()) for way, found in off.items()},
    }


def circle_in_words(circle: dict[str, Any]) -> str:
    """Say how far the circle is left in both ways."""
    constant, largest = circle["at_constant_speed_mm"], circle["largest_distance_mm"]
    return (
        f"On a circle with a radius of {circle['radius_mm']:g} mm at {circle['speed_m_s']:g} m/s, "
        f"`{circle['shaper']}` for {circle['f_d_hz']:g} Hz and ζ = {circle['zeta']:g}, joint by joint, leaves the path "
        f"by {constant['joints']:.2f} mm at constant speed and by {largest['joints']:.2f} mm at most. Averaging the "
        f"circle itself would lose {circle['predicted_mm']:.2f} mm of its radius. Along the path it is left by "
        f"{1e6 * largest['along']:.0f} nm."
    )


def corner(description: RobotDescription, calibration: Calibration) -> Corner:
    """Return a corner of two lines in a horizontal plane, in both ways."""
    position, rotation = _begin(description)
    bend = position + np.array([LEG, 0.0, 0.0])
    ends = (bend, bend + np.array([0.0, LEG, 0.0]))
    segments = tuple(
        LineSegment(
            pose=pose_of(end, rotation), blend=BLEND, velocity=CORNER_SPEED, acceleration=CORNER_ACCELERATION
        )
        for end in ends
    )
    reference, tvist = _planned(description, calibration, "blends", segments, CORNER_SHAPER)
    at = kinematics(description)

    def seen(q: Floats) -> Floats:
        found: Floats = (poses(at, q)[0] - bend)[:, :2]
        return found

    ways = {way: shaped(reference, tvist, way) for way in (ALONG, JOINTS)}
    return Corner(
        seen(reference.sampled()),
        {way: seen(q) for way, q in ways.items()},
        {way: _off(description, reference, tvist, way) for way in ways},
    )


def _begin(description: RobotDescription) -> tuple[Floats, Rotation]:
    position, rotation = kinematics(description)(np.array(POSTURE))
    return position, Rotation.from_matrix(rotation)


def _planned(
    description: RobotDescription,
    calibration: Calibration,
    kind: Kind,
    segments: tuple[Segment, ...],
    name: str,
) -> tuple[Reference, Filter]:
    move = ToolMove(kind, POSTURE, description.payload.mass, MovePath(token="", segments=segments))
    found = planned(description, calibration, name, move)
    assert found is not None, "the blend fits"
    return found


def _off(description: RobotDescription, reference: Reference, tvist: Filter, way: str) -> Floats:
    path = ToolPath(kinematics(description), reference.sampled())
    return path.off(shaped(reference, tvist, way))[0]
