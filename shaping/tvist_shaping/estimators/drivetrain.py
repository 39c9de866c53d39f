"""Springs and motors of an arm; with its mass matrix they give all poles of the linearised equations.

A flexible joint is the textbook model: a motor under P control of position and velocity, in series with its gear.
"""

from dataclasses import dataclass

import numpy as np

from tvist_shaping._types import Floats
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.poles import DAMPED, LOWEST, Complex


@dataclass(frozen=True)
class Drivetrain:
    """Springs and motors, with one entry for each coordinate of the mass matrix.

    Raises:
        EstimatorError: A value is not positive and finite, or the lengths differ.
    """

    stiffness: tuple[float, ...]
    """Stiffness K of gears and bends [N m/rad]."""
    rotor_inertia: tuple[float, ...]
    """Inertia B of the motor behind the gear; 0 at a bend, which has no motor [kg m^2]."""
    velocity_gain: tuple[float, ...]
    """Gain K_d [N m s/rad]; not used at a bend."""
    position_gain: tuple[float, ...]
    """Gain K_p [1/s]; not used at a bend."""
    damping: tuple[float, ...] = ()
    """Damping D of gears and bends [N m s/rad]; empty for none."""

    def __post_init__(self) -> None:
        size = len(self.stiffness)
        if not self.damping:
            object.__setattr__(self, "damping", (0.0,) * size)
        for name in ("stiffness", "rotor_inertia", "velocity_gain", "position_gain", "damping"):
            values = np.array(getattr(self, name), dtype=float)
            if values.shape != (size,) or size == 0:
                raise EstimatorError(name, values.tolist(), f"a list of {size} numbers, at least one")
            positive = values > 0.0 if name == "stiffness" else values >= 0.0
            if not (np.isfinite(values) & positive).all():
                raise EstimatorError(name, values.tolist(), "positive and finite")
        if not any(self.rotor_inertia):
            raise EstimatorError("rotor_inertia", self.rotor_inertia, "positive at one coordinate at least")

    @property
    def rows(self) -> Floats:
        """The five properties as rows, shape (5, L)."""
        return np.array(
            [self.stiffness, self.rotor_inertia, self.velocity_gain, self.position_gain, self.damping]
        )

    def system(self, mass: Floats) -> tuple[Floats, Floats, Floats]:
        """Return inertia, damping and stiffness matrices of L coordinates, then n motors, (L+n, L+n) each.

        Args:
            mass: M(q), shape (L, L) [kg m^2].
        """
        K, B, K_d, K_p, D = self.rows
        driven = np.flatnonzero(B)
        L, n = len(K), len(driven)
        stiffness, damping, inertia = np.zeros((3, L + n, L + n))
        coordinates, motors = np.arange(L), L + np.arange(n)
        inertia[:L, :L], inertia[motors, motors] = mass, B[driven]
        for matrix, spring in ((stiffness, K), (damping, D)):
            matrix[coordinates, coordinates] = spring
            matrix[motors, motors] = spring[driven]
            matrix[driven, motors] = matrix[motors, driven] = -spring[driven]
        stiffness[motors, motors] += K_d[driven] * K_p[driven]
        damping[motors, motors] += K_d[driven]
        return inertia, damping, stiffness

    def poles(self, mass: Floats) -> tuple[Complex, Complex]:
        """Return all vibrating poles, as eigenvalues of the whole linear system, and their shapes.

        Poles are in the order of frequency, shape (k,) [1/s]; shapes are (k, L) with largest entry 1.

        Args:
            mass: M(q), shape (L, L) [kg m^2].
        """
        inertia, damping, stiffness = self.system(mass)
        L, N = len(self.stiffness), len(inertia)
        system = np.zeros((2 * N, 2 * N))
        system[:N, N:] = np.eye(N)
        system[N:, :N], system[N:, N:] = (-np.linalg.solve(inertia, part) for part in (stiffness, damping))
        values, vectors = np.linalg.eig(system)
        vibrates = (values.imag > 2.0 * np.pi * LOWEST) & (-values.real < DAMPED * np.abs(values))
        chosen = np.flatnonzero(vibrates)
        chosen = chosen[np.argsort(values[chosen].imag)]
        shapes = vectors[:L, chosen].T
        largest = np.abs(shapes).argmax(axis=1)
        return values[chosen], shapes / shapes[np.arange(len(chosen)), largest][:, None]
