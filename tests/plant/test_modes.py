"""The modes that the plant declares as the truth: the paper's table, and what the moving arm does."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import least_squares

from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.model import rigid_model

from .arms import hold

TABLE_1 = {"Q1": (6.7, 0.34), "Q2": (6.7, 0.34), "Q3": (15.0, 0.14)}


@pytest.fixture(scope="module")
def plant(ur5e):
    return FlexibleArm(ur5e.clean(), ur5e.payload)


def modes(plant, q):
    return plant.modes(np.array(q, dtype=float))


def oscillations(t, f_d, zeta):
    """Decaying cosine and sine of each mode, [T, 2 x modes]."""
    omega = 2 * np.pi * np.array(f_d)
    sigma = omega * np.array(zeta) / np.sqrt(1 - np.array(zeta) ** 2)
    decay = np.exp(-np.outer(t, sigma))
    return np.hstack([decay * np.cos(np.outer(t, omega)), decay * np.sin(np.outer(t, omega))])


@pytest.mark.parametrize("pose", TABLE_1)
def test_modes_match_table_1_of_the_paper(ur5e, plant, pose, measured):
    """Calibrated to it; the pair of coinciding modes at Q1 and Q2 lies there as a whole."""
    f_d, zeta = TABLE_1[pose]
    found = modes(plant, ur5e.poses[pose])
    measured("f_d [Hz], zeta", (found.f_d[:3].tolist(), found.zeta[:3].tolist()))
    first = np.flatnonzero(np.abs(found.f_d - found.f_d[0]) < 0.1)
    assert np.argmax(found.participation) in first
    np.testing.assert_allclose(found.f_d[first], f_d, rtol=0.02)
    np.testing.assert_allclose(found.zeta[first], zeta, rtol=0.03)


def ring_down(plant, pose, joint, push, pulse, ticks=400):
    """Acceleration of the flange after a soft torque pulse on one joint [ticks, 3]."""
    still = hold(plant.description, pose)
    plant.reset(still)
    rest = plant.truth().specific_force
    rows = []
    for tick in range(1, ticks):
        time = tick * plant.period
        torque = still.torque.copy()
        torque[joint] += push * np.sin(np.pi * time / pulse) ** 2 if time < pulse else 0.0
        plant.step(DriveCommand(still.q, still.qd, torque))
        if time >= pulse + 0.02:
            rows.append(plant.truth().specific_force - rest)
    return np.array(rows)


def fitted(alpha, guess, period):
    """f_d and ζ of the first of the damped sines (and two creeping decays) that fit three axes best."""
    t = np.arange(len(alpha)) * period
    count = len(guess) // 2

    def residual(x):
        f_d, zeta, rates = x[:count], x[count:-2], x[-2:]
        basis = np.hstack([oscillations(t, f_d, zeta), np.exp(-np.outer(t, rates)), np.ones((len(t), 1))])
        weights = np.linalg.lstsq(basis, alpha, rcond=None)[0]
        return (alpha - basis @ weights).ravel() / np.max(np.abs(alpha))

    start = np.array([*guess, 17.5, 2.2])
    best = least_squares(residual, start, x_scale=start, xtol=1e-12, ftol=1e-14).x
    return best[0], best[count]


@pytest.mark.parametrize(("pose", "joint", "push", "pulse", "guess"), [
    ("Q1", 0, 20.0, 0.15, (7.5, 0.4)), ("Q1", 1, 20.0, 0.15, (7.5, 0.4)), ("Q2", 0, 20.0, 0.15, (7.5, 0.4)),
    ("Q3", 2, 40.0, 0.08, (17.0, 22.0, 0.2, 0.2)),
])  # fmt: skip
def test_ring_down_of_the_simulated_arm_has_the_declared_mode(
    ur5e, plant, pose, joint, push, pulse, guess, measured
):
    """The base rings the horizontal mode of Q1, the shoulder its vertical one."""
    f_d, zeta = fitted(ring_down(plant, ur5e.poses[pose], joint, push, pulse), guess, plant.period)
    declared = modes(plant, ur5e.poses[pose])
    measured("f_d [Hz], zeta from the ring-down", (f_d, zeta))
    assert np.min(np.abs(declared.f_d - f_d) / f_d) < 0.003
    nearest = np.argmin(np.abs(declared.f_d - f_d))
    assert nearest <= 1
    assert declared.zeta[nearest] == pytest.approx(zeta, rel=0.01)


def test_modes_without_a_pose_are_those_of_the_present_one(ur5e, plant):
    plant.reset(hold(plant.description, ur5e.poses["Q3"]))
    here, there = plant.modes(), modes(plant, ur5e.poses["Q3"])
    assert plant.modes(np.array(ur5e.poses["Q1"])).f_d[0] < 0.5 * here.f_d[0]
    np.testing.assert_allclose(here.f_d, there.f_d, rtol=5e-3)


def reference_step(description, pose, joint, period, ticks):
    """Commands, with all feed-forward, of a reference whose acceleration is 0.02 rad/s² from t = 0 on."""
    model, drives = rigid_model(description, description.payload), description.drives
    data, start = model.createData(), np.array(pose)
    compliance = np.array(drives.windup_feedforward) / drives.gear_stiffness
    viscous = np.array(drives.coulomb_friction) / drives.friction_width
    along, last = 0.02 * np.eye(len(start))[joint], np.zeros(len(start))
    drive = []
    for tick in range(-1, ticks):
        time, qdd = max(tick, 0) * period, along * (tick >= 1)
        q, qd = start + along * time**2 / 2, along * time
        torque = pin.rnea(model, data, q, qd, qdd).copy()
        windup = compliance * (torque - pin.computeGeneralizedGravity(model, data, q))
        feedforward = torque + np.array(drives.rotor_inertia) * qdd + viscous * qd
        drive.append(DriveCommand(q + windup, qd + (windup - last) / period, feedforward))
        last = windup
    return drive


def simulated_participation(description, pose, joint, found):
    """Amplitude of the first two modes that a step of the reference acceleration excites, simulated."""
    period = 0.0005
    plant = FlexibleArm(description, description.payload, period=period, substeps=2)
    drive = reference_step(description, pose, joint, period, 1500)
    plant.reset(drive[0])
    rest = plant.truth().specific_force
    alpha = []
    for command in drive[1:]:
        plant.step(command)
        alpha.append((plant.truth().specific_force - rest) / 0.02)
    t = (np.arange(len(alpha)) - 0.5) * period  # the step is a ramp between two commands
    creep = np.exp(-np.outer(t, [2.2, 12.0, 17.5, 25.0]))
    drift = np.vander(t, 3)
    basis = np.hstack([oscillations(t, found.f_d[:5], found.zeta[:5]), creep, drift])[40:]
    weights = np.linalg.lstsq(basis, np.array(alpha)[40:], rcond=None)[0]
    return [np.linalg.norm(weights[[k, 5 + k]]) for k in range(2)]


def test_participation_is_the_response_to_a_step_of_acceleration(ur5e, plant, measured):
    pose, clean = ur5e.poses["Q3"], plant.description
    found = modes(plant, pose)
    simulated = np.array([simulated_participation(clean, pose, joint, found) for joint in range(6)])
    total = np.linalg.norm(simulated, axis=0)
    measured("declared, simulated [m/s^2 per rad/s^2]", (found.participation[:2].tolist(), total.tolist()))
    np.testing.assert_allclose(found.participation[:2], total, rtol=0.03)
