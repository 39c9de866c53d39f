"""Lines, arcs and blends of the tool centre point."""

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from tvist_controller.kinematics.pose import Placement, turn, turned
from tvist_controller.trajectory.base import Floats
from tvist_controller.trajectory.spline import evaluate, hermite

PER_RADIAN = 0.25  # length equivalent to a turn by one radian [m]
SHORTEST = 1e-6  # length below which a part of a path is no motion [m]
STRAIGHT = 1e-6  # sine of the angle below which three points are collinear [-]
DIFFERENCE_STEP = 1e-5  # step of numerical differences relative to a blend's length [-]
SLOWEST = 0.25  # tool speed per parameter below which a blend is too sharp to be reparametrized [-]
PIECES = 64  # number of pieces for reparametrizing a blend by arc length
EVEN = 1e-9  # deviation from constant speed at the ends that counts as rounding [-]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class ToolState(NamedTuple):
    """Pose of the tool on a path, with derivatives by length."""

    pose: Placement
    first: Floats  # velocity and angular velocity per unit of length, base frame, shape (6,) [-, rad/m]
    second: Floats  # derivative of `first`, shape (6,) [1/m, rad/m^2]


class ToolCurve(ABC):
    """Path of the tool from s = 0 to its length [m]."""

    length: float

    @abstractmethod
    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""


class BlendableCurve(ToolCurve):
    """Path of the tool that can be blended with the next path."""

    @abstractmethod
    def within(self, radius: float) -> float:
        """Return the length, from either end, within the radius [m]; may exceed the curve or be infinite."""


class ToolLine(BlendableCurve):
    """Straight line with constant rotation by the shortest way."""

    def __init__(self, start: Placement, end: Placement) -> None:
        self._start, self._end = start, end
        way, angle = end.position - start.position, turn(start.rotation, end.rotation)
        self.length = max(float(np.linalg.norm(way)), PER_RADIAN * float(np.linalg.norm(angle)))
        self.first: Floats = np.concatenate((way, angle)) / max(self.length, SHORTEST)
        """Velocity and angular velocity per unit of length, base frame, shape (6,) [-, rad/m]."""

    def within(self, radius: float) -> float:
        """See `BlendableCurve.within`."""
        speed = float(np.linalg.norm(self.first[:3]))
        return radius / speed if speed > 0.0 else np.inf

    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""
        moved = s * self.first
        pose = Placement(turned(self._start.rotation, moved[3:]), self._start.position + moved[:3])
        return ToolState(pose, self.first, np.zeros(6))


class ToolArc(BlendableCurve):
    """Arc of a circle from one pose through a point to another pose.

    The tool turns with the tangent, ignoring the end orientation, or steadily to the end orientation the
    shortest way. Raise ValueError if points coincide or are collinear.
    """

    def __init__(self, start: Placement, via: Floats, end: Placement, *, tangent: bool) -> None:
        self._start = start
        a, b = via - start.position, end.position - start.position
        normal = np.cross(a, b)
        sizes = (float(np.linalg.norm(a)), float(np.linalg.norm(b)), float(np.linalg.norm(b - a)))
        if min(sizes) < SHORTEST:
            raise ValueError("two of its three points are the same")
        if np.linalg.norm(normal) <= STRAIGHT * sizes[0] * sizes[1]:
            raise ValueError("its three points are on a line")
        square = float(normal @ normal)
        centre = (np.cross(normal, a) * sizes[1] ** 2 - np.cross(normal, b) * sizes[0] ** 2) / (2.0 * square)
        self._centre = start.position + centre
        self._axis = normal / np.sqrt(square)
        self._out = -centre
        self._along = np.cross(self._axis, self._out)
        # The axis is chosen so that the arc passes via before its end.
        last = end.position - self._centre
        angle = float(np.arctan2(last @ self._along, last @ self._out) % (2.0 * np.pi))
        radius = float(np.linalg.norm(self._out))
        turning = angle * self._axis if tangent else turn(start.rotation, end.rotation)
        self.length = max(radius * angle, PER_RADIAN * float(np.linalg.norm(turning)))
        self._rate, self._turning = angle / self.length, turning / self.length

    def within(self, radius: float) -> float:
        """See `BlendableCurve.within`."""
        share = radius / (2.0 * float(np.linalg.norm(self._out)))
        return 2.0 * float(np.arcsin(share)) / self._rate if share < 1.0 else np.inf

    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""
        rate, angle = self._rate, self._rate * s
        out = self._out * np.cos(angle) + self._along * np.sin(angle)
        along = self._along * np.cos(angle) - self._out * np.sin(angle)
        pose = Placement(turned(self._start.rotation, s * self._turning), self._centre + out)
        return ToolState(
            pose,
            np.concatenate((rate * along, self._turning)),
            np.concatenate((-rate * rate * out, np.zeros(3))),
        )


class ToolPart(ToolCurve):
    """A part of a tool path, forwards or backwards."""

    def __init__(self, whole: ToolCurve, start: float, end: float) -> None:
        self._whole, self._from = whole, start
        self._sign, self.length = (1.0 if end >= start else -1.0), abs(end - start)

    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""
        state = self._whole.at(self._from + self._sign * s)
        return state._replace(first=self._sign * state.first)


class ToolBlend(ToolCurve):
    """Quintic path of given length between two tool states; position and turn are relative to the corner."""

    def __init__(self, start: ToolState, end: ToolState, corner: Floats, length: float) -> None:
        self.length, self._corner = length, corner
        self._coefficients = hermite(length, _at_corner(start, corner), _at_corner(end, corner))

    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""
        value, first, second = self._polynomial(s)
        step = DIFFERENCE_STEP * self.length
        angular = (self._angular(s + step) - self._angular(s - step)) / (2.0 * step)
        pose = Placement(turned(self._corner, value[3:]), value[:3])
        return ToolState(
            pose,
            np.concatenate((first[:3], self._angular(s))),
            np.concatenate((second[:3], angular)),
        )

    def moved(self, s: Floats) -> tuple[Floats, Floats]:
        """Return dp/ds and d²p/ds² of the tool centre point at k lengths, each of shape (k, 3) [-, 1/m]."""
        _, first, second = self._polynomials(s)
        return first[:, :3], second[:, :3]

    def shape(self, s: Floats) -> tuple[Floats, Floats]:
        """Return |dp/ds| and |d²p/ds²| at k lengths, each of shape (k,) [-, 1/m]."""
        first, second = self.moved(s)
        return np.linalg.norm(first, axis=1), np.linalg.norm(second, axis=1)

    def _angular(self, s: float) -> Floats:
        value, first, _ = self._polynomial(s)
        return np.asarray(pin.Jexp3(-value[3:]) @ first[3:])

    def _polynomial(self, s: float) -> tuple[Floats, Floats, Floats]:
        value, first, second = self._polynomials(np.array([s]))
        return value[0], first[0], second[0]

    def _polynomials(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        n = np.arange(6)
        powers, c = s[:, None] ** n, self._coefficients
        value: Floats = powers @ c
        first: Floats = (n[1:] * powers[:, :-1]) @ c[1:]
        second: Floats = (n[2:] * n[1:-1] * powers[:, :-2]) @ c[2:]
        return value, first, second


def _at_corner(state: ToolState, corner: Floats) -> tuple[Floats, Floats, Floats]:
    """Return position and turn from the corner, with derivatives, each of shape (6,).

    On lines and arcs the tool turns about one axis at a constant rate, so the turn from the corner has this axis, too.
    """
    turned_by, angular = turn(corner, state.pose.rotation), state.second[3:]
    if angular.any():
        angular = np.linalg.solve(np.asarray(pin.Jexp3(-turned_by)), angular)
    value = np.concatenate((state.pose.position, turned_by))
    return value, state.first, np.concatenate((state.second[:3], angular))


def evenly(blend: ToolBlend) -> "ToolBlend | EvenBlend":
    """Return the blend parametrized for constant tool speed; unchanged if the tool nearly stops within it."""
    speeds, _ = blend.shape(np.linspace(0.0, blend.length, PIECES + 1))
    ends = abs(float(speeds[0]) - 1.0) + abs(float(speeds[-1]) - 1.0)
    return blend if float(speeds.min()) < SLOWEST or ends > EVEN else EvenBlend(blend)


class EvenBlend(ToolCurve):
    """A blend parametrized by arc length, so that a constant rate is a constant speed."""

    def __init__(self, blend: ToolBlend) -> None:
        self._blend = blend
        places = np.linspace(0.0, blend.length, PIECES + 1)
        half = 0.5 * np.diff(places)
        inside = (places[:-1] + half)[:, None] + half[:, None] * _NODES
        speeds = blend.shape(inside.reshape(-1))[0].reshape(inside.shape)
        self._lengths = np.concatenate(([0.0], np.cumsum(half * (speeds @ _WEIGHTS))))
        self.length = float(self._lengths[-1])
        first, second = blend.moved(places)
        speed = np.linalg.norm(first, axis=1)
        place, rate, change = places, 1.0 / speed, -(first * second).sum(axis=1) / speed**4
        starts = (place[:-1, None], rate[:-1, None], change[:-1, None])
        ends = (place[1:, None], rate[1:, None], change[1:, None])
        coefficients = hermite(np.diff(self._lengths)[:, None], starts, ends)
        self._coefficients = np.ascontiguousarray(np.moveaxis(coefficients, 0, 1))

    def at(self, s: float) -> ToolState:
        """Return the state at a length from the start [m]."""
        place, rate, change = (float(values[0]) for values in self._places(np.array([s])))
        pose, first, second = self._blend.at(place)
        return ToolState(pose, first * rate, second * rate**2 + first * change)

    def shape(self, s: Floats) -> tuple[Floats, Floats]:
        """Return |dp/ds| and |d²p/ds²| at k lengths, each of shape (k,) [-, 1/m]."""
        places, rates, changes = self._places(s)
        first, second = self._blend.moved(places)
        bent = second * rates[:, None] ** 2 + first * changes[:, None]
        return np.linalg.norm(first, axis=1) * rates, np.linalg.norm(bent, axis=1)

    def _places(self, s: Floats) -> tuple[Floats, Floats, Floats]:
        out = np.empty((4, len(s), 1))
        evaluate(self._lengths, self._coefficients, s, out)
        return out[0, :, 0], out[1, :, 0], out[2, :, 0]
