"""Curved paths for tests: an arc in joint space, and a circle of the flange approximated by a spline of joints."""

from functools import cache

import numpy as np
import pinocchio as pin
from scipy.interpolate import make_interp_spline
from scipy.optimize import least_squares

from tvist_controller.trajectory import MotionLimits, PlannedMotion, quickest_motion
from tvist_controller.trajectory.spline import Knots, SplineCurve, kept_by
from tvist_plant.description import Payload
from tvist_plant.model import FLANGE, rigid_model

from .robots import Q1, UR5E, H

BENT = np.array([0.2, -1.4, 1.7, -1.8, -1.5, 0.3])
"""A posture far from any singular one [rad]."""
ENOUGH = 1.02
"""What a bound by sampling is widened by."""


class Arc(SplineCurve):
    """q(s) = c + R (u cos s/R + v sin s/R): a circle's arc, in a plane of joint space that u and v span."""

    def __init__(self, start, u, v, radius: float, angle: float) -> None:
        swing = np.hypot(u, v)
        self.u, self.v, self.radius = u / swing.max(), v / swing.max(), radius
        centre, turns = np.array(start) - radius * self.u, np.linspace(0.0, angle, 200)[:, None]
        out, along = (
            self.u * np.cos(turns) + self.v * np.sin(turns),
            self.v * np.cos(turns) - self.u * np.sin(turns),
        )
        super().__init__(Knots(radius * turns[:, 0], centre + radius * out, along, -out / radius))


def through(postures) -> SplineCurve:
    """A spline of degree five through postures, scaled so that no joint turns farther than its parameter goes."""
    chords = np.abs(np.diff(postures, axis=0)).max(axis=1)
    u = np.concatenate([[0.0], np.cumsum(chords)])
    fine = np.linspace(0.0, u[-1], 4000)
    scale = ENOUGH * np.abs(make_interp_spline(u, postures, k=5)(fine, 1)).max()
    spline = make_interp_spline(scale * u, postures, k=5)
    s = scale * np.linspace(0.0, u[-1], 400)
    return SplineCurve(Knots(s, spline(s), spline(s, 1), spline(s, 2)))


def quickest_on(curve: SplineCurve, limits: MotionLimits, speed: float = 1.0) -> PlannedMotion:
    """A motion with one velocity for the whole curve; its tightest bend uses half of the joints' limits."""
    slope, second, third = float(curve.bends.slope.max()), curve.bends.second, curve.bends.third
    velocity = min(
        limits.velocity / slope,
        np.sqrt(0.5 * limits.acceleration / second),
        np.cbrt(0.25 * limits.jerk / third),
        0.25 * limits.jerk * slope / (3.0 * second * limits.acceleration),
    )
    kept = kept_by(curve.bends, limits, float(velocity))
    assert kept is not None, "this velocity leaves room for acceleration and jerk"
    return quickest_motion(curve, kept, H, speed)


def random_arc(random, start=Q1) -> Arc:
    u, v = random.uniform(-1.0, 1.0, (2, 6)) * [0.6, 0.6, 0.6, 1.0, 1.0, 1.0]
    return Arc(start, u, v, float(random.uniform(0.2, 0.8)), float(random.uniform(0.8, 4.0)))


@cache
def tool_circle(radius: float = 0.08, points: int = 41) -> SplineCurve:
    """Most of a circle of the flange in a vertical plane, its orientation held."""
    model = rigid_model(UR5E, Payload())
    data, frame = model.createData(), model.getFrameId(FLANGE)

    def flange(q):
        pin.framesForwardKinematics(model, data, q)
        return data.oMf[frame].copy()

    placed, q, postures = flange(BENT), BENT, []
    for angle in np.linspace(0.0, 1.6 * np.pi, points):
        centre = np.array([0.0, 0.0, -radius])
        goal = pin.SE3(
            placed.rotation,
            placed.translation + centre + radius * np.array([np.sin(angle), 0.0, np.cos(angle)]),
        )
        found = least_squares(
            lambda q, goal=goal: np.array(pin.log6(goal.actInv(flange(q))).vector),
            q,
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
        )
        assert np.abs(found.fun).max() < 1e-9
        q = found.x
        postures.append(q)
    return through(np.array(postures))


def progress(curve: SplineCurve, references) -> tuple[np.ndarray, float]:
    """Where references are on a curve, by what is nearest, and the farthest that they are off it [rad]."""
    length = float(curve.end[0])
    places = np.linspace(0.0, length, 800)
    coarse = curve.derivatives(places)[0]
    found = np.array([places[np.argmin(((coarse - q) ** 2).sum(axis=1))] for q in references])
    for _ in range(30):  # Gauss and Newton; a curve that crosses itself would need more care
        q, slope, _ = curve.derivatives(found)
        step = ((references - q) * slope).sum(axis=1) / (slope**2).sum(axis=1)
        found = found + np.clip(step, -0.01, 0.01)
    return found, float(np.abs(curve.derivatives(found)[0] - references).max())
