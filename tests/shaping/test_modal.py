"""Modes out of a mass matrix: they are the eigenvalues of the whole system, and none ever jumps."""

import msgspec
import numpy as np
import pytest

from tvist_controller.sources.calibrations import mass_matrix
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import flexible_model
from tvist_shaping.errors import EstimatorError
from tvist_shaping.estimators.drivetrain import Drivetrain
from tvist_shaping.estimators.modal import Modal

ROBOT = load("ur5e")
Q1 = np.array(ROBOT.poses["Q1"])
LOW, HIGH = np.array([-3, -3, -2.6, -3, -2, -2]), np.array([3, 0, 2.6, 0, 2, 2])


def ur5e(payload=ROBOT.payload, *, damping=True):
    """Mass matrix and drivetrain of the arm, of its own parameters but those that `Drivetrain` does not know."""
    flexible, drives = flexible_model(ROBOT, payload), ROBOT.drives
    K, B, K_d, K_p, D = np.zeros((5, flexible.model.nv))
    joints, flexes = flexible.joints, flexible.flexes
    K[joints], K[flexes] = drives.gear_stiffness, flexible.flex_stiffness
    B[joints] = drives.rotor_inertia
    # Friction about rest is viscous, in parallel with the velocity loop.
    K_d[joints] = np.array(drives.velocity_gain) + np.array(drives.coulomb_friction) / drives.friction_width
    K_p[joints] = np.array(drives.velocity_gain) * np.array(drives.position_gain) / K_d[joints]
    D[joints], D[flexes] = drives.gear_damping, flexible.flex_damping
    rows = [tuple(row) for row in (K, B, K_d, K_p, D)]
    return mass_matrix(flexible), Drivetrain(*(rows if damping else rows[:4]))


def arm(modes=4, **changes):
    mass, drivetrain = ur5e()
    return Modal(mass, drivetrain, modes=modes, **changes), mass, drivetrain


def paths(count, seed, steps=400):
    """Straight lines of up to five radians a joint, at most 15 mrad a step."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        a, b = rng.uniform(LOW, HIGH, (2, 6))
        yield a + np.linspace(0.0, 1.0, steps)[:, None] * (b - a)


def crossing(x):
    """Two coordinates that know nothing of each other, whose frequencies cross at x = 1."""
    return np.diag([1.0 + x[0], 2.0])


TWO = Drivetrain((9e3, 9e3), (0.3, 0.3), (150.0, 150.0), (15.0, 15.0))


def test_poles_are_eigenvalues_of_the_system_along_any_path():
    estimator, mass, drivetrain = arm()
    for path in paths(8, seed=1):
        for number, q in enumerate(path):
            found = estimator.poles(q)
            if number % 20 == 0:
                every, _ = drivetrain.poles(mass(q))
                apart = np.abs(every[:, None] - found) / np.abs(found)
                assert apart.min(axis=0).max() < 1e-6
                # and no two are one
                assert len(set(apart.argmin(axis=0))) == len(found)


def test_first_estimate_is_the_lowest_modes_in_order():
    rng = np.random.default_rng(2)
    for q in rng.uniform(LOW, HIGH, (20, 6)):
        estimator, mass, drivetrain = arm()
        np.testing.assert_array_equal(estimator.poles(q), drivetrain.poles(mass(q))[0][:4])


def test_modes_change_continuously_with_the_configuration():
    changes = []
    for steps in (400, 800):
        largest = 0.0
        for path in paths(5, seed=3, steps=steps):
            estimator, *_ = arm()
            found = np.array([estimator.poles(q) for q in path])
            largest = max(largest, float(np.max(np.abs(np.diff(found, axis=0)) / np.abs(found[1:]))))
        changes.append(largest)
    assert changes[0] < 0.06
    assert changes[1] < 0.6 * changes[0]


def test_crossing_modes_keep_their_identity():
    estimator = Modal(crossing, TWO, modes=2)
    for x in np.linspace(0.0, 2.5, 200):  # q in radians: no step is a jump
        poles = estimator.poles(np.array([x]))
        own = [TWO.poles(np.diag([m, m]))[0][0] for m in (1.0 + x, 2.0)]
        # at the start the first coordinate is the lighter one, so the second mode
        np.testing.assert_allclose(poles, own[::-1], rtol=1e-6)
    assert poles.imag[0] > poles.imag[1]


def test_nearly_equal_modes_of_the_stretched_arm_stay_distinct():
    estimator, mass, drivetrain = arm()
    rng = np.random.default_rng(4)
    for _ in range(5):
        away = rng.uniform(-0.4, 0.4, 6)
        for share in np.linspace(-1.0, 1.0, 300):
            q = Q1 + share * away
            f_d, _ = estimator.estimate(q)
        expected = np.sort(drivetrain.poles(mass(q))[0][:2].imag) / (2.0 * np.pi)
        np.testing.assert_allclose(np.sort(f_d[:2]), expected, rtol=1e-6)


def test_step_away_from_nearly_equal_modes_finds_both():
    """There the shapes turn by a right angle in one step, and Newton's first step may vanish by chance."""
    rng = np.random.default_rng(4)
    for away in [np.full(6, 0.01), *rng.uniform(-0.02, 0.02, (50, 6))]:
        estimator, mass, drivetrain = arm()
        estimator.poles(Q1)
        found, exact = estimator.poles(Q1 + away), drivetrain.poles(mass(Q1 + away))[0][:4]
        np.testing.assert_allclose(found[np.argsort(found.imag)], exact, rtol=1e-6)


def test_modes_with_the_plants_parameters_are_the_plants_modes():
    # without what the estimator leaves out: the integrator and gravity's little stiffness
    drives = msgspec.structs.replace(ROBOT.drives, integral_gain=(0.0,) * 6)
    plant = FlexibleArm(msgspec.structs.replace(ROBOT, drives=drives), ROBOT.payload)
    rng = np.random.default_rng(5)
    for q in [Q1, *rng.uniform(LOW, HIGH, (15, 6))]:
        estimator, *_ = arm(modes=3)
        f_d, zeta = estimator.estimate(q)
        true = plant.modes(q)
        np.testing.assert_allclose(f_d, true.f_d[:3], rtol=0.01)
        np.testing.assert_allclose(zeta, true.zeta[:3], rtol=0.03)


def test_only_settle_switches_to_the_lowest_modes():
    estimator, there = Modal(crossing, TWO, modes=1), np.array([2.0])
    for x in np.linspace(0.0, 2.0, 200):
        following = estimator.poles(np.array([x]))[0]
    assert [estimator.poles(there)[0] for _ in range(3)] == [following] * 3
    estimator.settle(there)
    settled = estimator.poles(there)[0]
    assert settled.imag < 0.95 * following.imag  # the other coordinate is the lower one now
    assert settled == Modal(crossing, TWO, modes=1).poles(there)[0]
    assert [estimator.poles(there)[0] for _ in range(3)] == [settled] * 3


def vanishing(x):
    """One coordinate that vibrates while it is light; a motor with little inertia damps it the more, the heavier."""
    return np.array([[x[0]]])


DAMPED = Drivetrain((9e3,), (1e-3,), (40.0,), (1e-3,))


def test_overdamped_mode_is_held_until_it_vibrates_again():
    estimator = Modal(vanishing, DAMPED, modes=1)
    out, lost = np.linspace(0.3, 1.2, 200), []
    for x in [*out, *out[::-1]]:
        kept = None if x == out[0] else estimator._poles.copy()
        f_d, zeta = estimator.estimate(np.array([x]))
        true, _ = DAMPED.poles(vanishing([x]))
        lost.append(estimator.clipped)
        if lost[-1]:
            np.testing.assert_array_equal(estimator._poles, kept)
            np.testing.assert_array_equal(estimator._poles, estimator.poles(np.array([x])))
        else:
            np.testing.assert_allclose(estimator._poles, true[:1], rtol=1e-6)
    assert 100 < sum(lost) < 300
    assert not lost[0]
    assert not lost[-1]
    assert np.isfinite([f_d, zeta]).all()


def test_lost_pole_leaves_all_poles_and_shapes_unchanged_until_it_is_found():
    """The last of three poles leads nowhere: the two before it have been moved by then."""
    estimator, mass, drivetrain = arm(modes=3)
    last = estimator.poles(Q1)[2]
    estimator._poles[2] = np.nan
    before = estimator._poles.copy(), estimator._shapes.copy()
    estimator.estimate(Q1 + 0.01)
    assert estimator.clipped
    np.testing.assert_array_equal(estimator._poles, before[0])
    np.testing.assert_array_equal(estimator._shapes, before[1])
    estimator._poles[2] = last
    found, exact = estimator.poles(Q1 + 0.01), drivetrain.poles(mass(Q1 + 0.01))[0][:3]
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(exact), rtol=1e-6)
    estimator.estimate(Q1 + 0.01)
    assert not estimator.clipped


def test_modes_beyond_the_bounds_are_clamped_and_reported():
    estimator, *_ = arm(f_d_min=8.0, zeta_max=0.2)
    f_d, zeta = estimator.estimate(Q1)
    assert estimator.clipped
    assert f_d.min() == 8.0
    assert zeta.max() == 0.2
    free, *_ = arm()
    free.estimate(Q1)
    assert not free.clipped


def test_equal_paths_give_equal_bits_and_estimates_are_copies():
    path = next(paths(1, seed=7))
    first, second = (arm()[0] for _ in range(2))
    estimates = [first.estimate(q) for q in path]
    kept = [np.copy(estimate) for estimate in estimates]
    np.testing.assert_array_equal(kept, [second.estimate(q) for q in path])
    np.testing.assert_array_equal(kept, estimates)


def test_invalid_mass_matrix_is_refused():
    with pytest.raises(EstimatorError, match="of shape"):
        Modal(lambda _: np.eye(3), TWO, modes=1).estimate(np.zeros(1))
    estimator = Modal(crossing, TWO, modes=1)
    with pytest.raises(EstimatorError, match="finite"):
        estimator.estimate(np.array([np.nan]))
    assert np.isfinite(estimator.estimate(np.zeros(1))).all()  # nothing of it is left


def test_more_modes_than_vibrate_are_refused():
    # A light motor with K_d = √(Km)/2.4 takes all there is of a vibration.
    overdamped = Drivetrain((9e3, 9e3), (0.3, 1e-3), (150.0, 40.0), (15.0, 1e-3))
    with pytest.raises(EstimatorError, match="at most 1"):
        Modal(lambda _: np.eye(2), overdamped, modes=2).estimate(np.zeros(1))
