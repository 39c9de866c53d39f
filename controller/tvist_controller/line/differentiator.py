"""The shaped reference: filter samples, corresponding joint positions, and their derivatives."""

import copy
from typing import Self

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from tvist_controller._compiled import compiled_for_ticks
from tvist_plant.plant import PERIOD
from tvist_shaping.base import Posture

Floats = npt.NDArray[np.float64]

STILL = 1e-7
"""Change per tick below which a reference is at rest [rad]."""


class Target(Struct, frozen=True, eq=False, gc=False):
    """Shaped reference and its derivatives at the same tick."""

    q: Floats  # q*, shape (n,) [rad]
    qd: Floats  # q̇*, shape (n,) [rad/s]
    qdd: Floats  # q̈*, shape (n,) [rad/s^2]


def rests_at(reference: Floats, target: Target) -> bool:
    """Return whether the shaped reference has come to rest at an unshaped reference."""
    # The central differences' equivalent of q*ᵢ - q*ᵢ₋₁.
    step = PERIOD * (target.qd - 0.5 * PERIOD * target.qdd)
    return bool(max(np.abs(step).max(), np.abs(reference - target.q).max()) <= STILL)


def central_differences(references: Floats) -> tuple[Floats, Floats, Floats]:
    """Return positions, velocities and accelerations of references (k + 2, n), equal to `Differentiator`'s.

    The first and last reference have no result, so each result has shape (k, n).
    """
    qd: Floats = (references[2:] - references[:-2]) / (2.0 * PERIOD)
    qdd: Floats = np.diff(references, 2, axis=0) / PERIOD**2
    return references[1:-1], qd, qdd


@compiled_for_ticks
def extrapolate(before: Floats, middle: Floats, last: Floats, period: float, rates: Floats) -> None:
    """Compute velocity and acceleration at the last of three references on a parabola, (2, n)."""
    for j in range(middle.shape[0]):
        rise, fall = last[j] - middle[j], middle[j] - before[j]
        rates[1, j] = (rise - fall) / (period * period)
        rates[0, j] = rise / period + 0.5 * period * rates[1, j]


@compiled_for_ticks
def differentiate(before: Floats, middle: Floats, last: Floats, period: float, rates: Floats) -> None:
    """Compute velocity and acceleration at the middle of three references by central differences, (2, n)."""
    for j in range(middle.shape[0]):
        # Take differences of neighbours first, so that rounding does not grow with the position.
        rise, fall = last[j] - middle[j], middle[j] - before[j]
        rates[0, j] = (rise + fall) / (2.0 * period)
        rates[1, j] = (rise - fall) / (period * period)


def middle_of(window: tuple[Floats, Floats, Floats]) -> Target:
    """Return the state at the middle of three references, as `differentiate`."""
    rates = np.empty((2, len(window[1])))
    differentiate(*window, PERIOD, rates)
    return Target(window[1], rates[0], rates[1])


class Differentiator:
    """Central differences: q̇ᵢ = (qᵢ₊₁ - qᵢ₋₁)/2h and q̈ᵢ = (qᵢ₊₁ - 2qᵢ + qᵢ₋₁)/h².

    All refer to the same tick without phase shift, at the cost of one tick of delay. The start is at rest.
    """

    def __init__(self, q: Floats) -> None:
        self.reset(q)

    def reset(self, q: Floats) -> None:
        """Restart at rest."""
        at = np.array(q, dtype=float)
        self.window: tuple[Floats, Floats, Floats] = (at, at, at)
        """The last three references, oldest first, each of shape (n,) [rad]; the arrays never change."""

    def push(self, q: Floats) -> None:
        """Take the reference of this tick."""
        _, middle, last = self.window
        self.window = (middle, last, q)

    @property
    def published(self) -> Target:
        """State one tick before the newest reference, where central differences are accurate to order h²."""
        return middle_of(self.window)

    @property
    def position(self) -> Floats:
        """The newest reference, shape (n,) [rad]."""
        return self.window[2]

    @property
    def newest(self) -> Target:
        """State at the newest reference. A motion continued from here starts with the same acceleration."""
        return self._state(*self.window)

    def after(self, q: Floats) -> Target:
        """Return the value that `newest` would have if q were the next reference."""
        return self._state(self.window[1], self.window[2], q)

    def _state(self, before: Floats, middle: Floats, last: Floats) -> Target:
        rates = np.empty((2, len(last)))
        extrapolate(before, middle, last, PERIOD, rates)
        return Target(last, rates[0], rates[1])


class ShapedReference:
    """Converts filter samples (joint positions or a path's parameter) to targets; starts at rest."""

    def __init__(self, q: Floats) -> None:
        self.joints = Differentiator(q)  # state of the joints
        self.reset(q)

    def reset(self, q: Floats) -> None:
        """Restart at rest with joint positions as samples."""
        self.joints.reset(q)
        self.references = self.joints.window
        """The last three unshaped references, as `Differentiator.window`; during a bypass, the shaped ones."""
        self.enter(None, q)

    def enter(self, posture_of: Posture | None, sample: Floats) -> None:
        """Accept samples of another kind, at rest; the joints keep their position."""
        self.posture_of = posture_of
        """Function from samples to joint positions; None if samples are joint positions."""
        self.along = self.joints if posture_of is None else Differentiator(sample)
        """State of the samples; without a path, of the joints."""

    def take(self, x: Floats, x_star: Floats) -> Floats:
        """Take samples before and after the filter (without: one object); return unshaped joint positions."""
        q, q_star, posture_of = x, x_star, self.posture_of
        if posture_of is not None:
            q = posture_of(x)
            q_star = q if x_star is x else posture_of(x_star)
            self.along.push(x_star)
        self.joints.push(q_star)
        if x_star is x:  # without filter, samples continue the shaped reference, so the unshaped one may jump
            self.references = self.joints.window
        else:
            _, middle, last = self.references
            self.references = (middle, last, q)
        return q

    def posture(self, sample: Floats) -> Floats:
        """Return the joint positions of a sample, shape (n,) [rad]."""
        return sample if self.posture_of is None else self.posture_of(sample)

    def fork(self) -> Self:
        """Return an independent copy."""
        other = copy.copy(self)
        other.joints = copy.copy(self.joints)
        other.along = other.joints if self.posture_of is None else copy.copy(self.along)
        return other
