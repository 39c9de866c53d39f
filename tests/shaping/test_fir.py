import numpy as np
import pytest

from tvist_shaping import fir
from tvist_shaping.fir import EDGE, ENERGY, SCALE, FirDesign, solve

H = 0.002
WANTED = FirDesign()
N = int(WANTED.longest / H) + 1


def modes(random):
    """Four modes of an arm, one above the other."""
    f_d = np.cumprod(random.uniform((5.0, 1.05, 1.5, 1.2), (12.0, 2.0, 3.0, 2.5)))
    return f_d, random.uniform(0.03, 0.25, 4)


class Programme:
    """The programme in arrays, and what `solve` makes of it."""

    def __init__(self, f_d, zeta, length, mean):
        self.f_d, self.zeta, self.length, self.mean = f_d, zeta, length, mean
        self.t = H * np.arange(N)
        self.room = np.clip((length - self.t) / EDGE, 0.0, 1.0) * H / (ENERGY * length)
        rows, weights = [], []
        for f, z, spread, weight in zip(f_d, zeta, WANTED.spread, WANTED.weight, strict=True):
            for factor in [1.0] if spread == 0.0 else [1.0 - spread, 1.0 + spread]:
                s = 2.0 * np.pi * f * factor * (z / np.sqrt(1.0 - z**2) + 1j)
                wave = np.exp(s * self.t - s.real * length)
                rows += [wave.real, wave.imag]
                weights += [weight, weight]
        self.rows, self.weights = np.array(rows), np.array(weights)
        self.dual = np.zeros(2 + len(rows))

    def solve(self):
        programme = fir.QuadraticProgramme.of(WANTED, N)
        programme.dual[:] = self.dual
        solved = solve(self.f_d, self.zeta, self.length, self.mean, H, programme)
        self.dual[:] = programme.dual
        return programme.taps, programme.remains, solved


@pytest.mark.parametrize("seed", range(20))
def test_solution_is_optimal(seed):
    """Karush, Kuhn and Tucker: feasible, and every weight is what its price allows, none where that is negative."""
    random = np.random.default_rng(seed)
    mean = random.uniform(0.026, 0.034)
    programme = Programme(*modes(random), random.uniform(0.05, 0.15), mean)
    taps, remains, solved = programme.solve()
    assert solved
    assert taps.min() >= 0.0
    assert taps.sum() == pytest.approx(1.0, abs=1e-14)
    assert programme.t @ taps == pytest.approx(mean, abs=1e-10)
    # The multipliers of what remains are what remains itself, times its price.
    np.testing.assert_allclose(programme.dual[2:], -programme.weights * (programme.rows @ taps), atol=1e-5)
    slope = (
        programme.dual[0]
        + programme.dual[1] * (programme.t - mean) / SCALE
        + programme.dual[2:] @ programme.rows
    )
    np.testing.assert_allclose(taps, programme.room * np.maximum(slope, 0.0), atol=1e-9)
    left = np.split((programme.rows @ taps) ** 2, np.cumsum([2 * (1 + (s > 0)) for s in WANTED.spread])[:-1])
    np.testing.assert_allclose(remains, [np.sqrt(part.sum()) for part in left], atol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_solution_does_not_depend_on_the_initial_guess(seed):
    """From the solution for any other arm, and from nothing: the dual has one maximum."""
    random = np.random.default_rng(seed)
    arm, length = modes(random), random.uniform(0.055, 0.15)
    cold, warm = (Programme(*arm, length, 0.028) for _ in range(2))
    elsewhere = Programme(*modes(random), 0.1, 0.028)
    elsewhere.solve()
    warm.dual[:] = elsewhere.dual
    (cold_taps, cold_left, _), (warm_taps, warm_left, solved) = cold.solve(), warm.solve()
    assert solved
    np.testing.assert_allclose(warm_taps, cold_taps, atol=1e-9)
    np.testing.assert_allclose(warm_left, cold_left, atol=1e-9)


def test_solver_recovers_from_a_non_finite_initial_guess():
    programme = Programme(np.array([7.0, 9.0, 20.0, 40.0]), np.full(4, 0.05), 0.1, 0.028)
    right, _, _ = programme.solve()
    for wrong in (np.nan, np.inf, 1e300):
        programme.dual[:] = wrong
        taps, _, solved = programme.solve()
        assert solved
        np.testing.assert_allclose(taps, right, atol=1e-9)


def test_infeasible_programme_is_reported_as_not_solved():
    """A mean delay behind the last weight."""
    programme = Programme(np.array([7.0, 9.0, 20.0, 40.0]), np.full(4, 0.05), 0.05, 0.06)
    _, _, solved = programme.solve()
    assert not solved
