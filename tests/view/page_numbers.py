"""Numbers that the packages compute, to compare with those of the interactive shaping page."""

import numpy as np
from scipy.signal import TransferFunction, lsim

from tvist_controller.api.line import DrivenLine, respond
from tvist_lab.one_joint import FlexibleShoulder
from tvist_lab.study.line import RESTING, point_to_point
from tvist_plant.description import load
from tvist_plant.flexible_arm import FlexibleArm
from tvist_shaping import Fixed, TvistFilter, residual, shaper
from tvist_shaping.catalogue import SHAPERS

MODES = ((1.0, 0.0), (6.7, 0.034), (14.3, 0.11), (4.2, 0.19))
"""Modes at which every shaper is compared: f_d [Hz] and ζ [-], within the range of all."""
RATIOS = (0.5, 0.8, 0.93, 1.0, 1.1, 1.37)
"""True frequencies over assumed ones at which the residual is compared [-]."""
AFTER = 350  # ticks at rest at the end of a motion of the arm
MOTIONS = (
    ("none", "following", (-1.3, 2.6), (0.0, 0.52)),
    ("zv", "following", (-1.3, 2.6), (0.0, 0.52)),
    ("zv", "fixed", (0.4, 0.5), (-0.7, 2.4)),
    ("ei", "following", (0.0, 2.6), (1.0, 1.57)),
    ("um_zv", "following", (0.2, 1.0), (0.25, 0.9)),
)
"""Shaper, estimator, and the angles at which a motion begins and ends [rad]."""
STEP = 0.002  # time between two samples of the mass [s]
TURN = 1.0  # angle of its motion [rad]
MOTION_S = 0.6  # duration of the motion before it is shaped [s]
JERK_S = 0.04  # time over which its acceleration rises [s]
LENGTH_S = 2.0  # duration that is computed [s]
SWING = (4.3, 0.05), (5.0, 0.05)  # f_d [Hz] and ζ of the mass, and those for which its shaper is designed


def of_shaper(name, f_d, zeta):
    """Return some true frequencies, and a shaper's impulses with its residual at these frequencies."""
    made, true = SHAPERS[name].impulses(f_d, zeta), f_d * np.array(RATIOS)
    return true.tolist(), {"A": made.A, "tau": made.tau, "residual": residual(true, zeta, made)}


def filtered():
    """Samples of two joints, and the same shaped by a filter whose mode follows them."""
    description = load("one-joint")
    estimator = FlexibleShoulder.of(description, description.payload).estimator()
    tvist = TvistFilter(shaper("zvd"), estimator, joints=2)
    tvist.reset([0.1, 2.5])
    time = np.linspace(0.0, 1.0, 200)
    samples = np.stack([0.1 + np.sin(3.0 * time), 2.5 - 2.0 * time**2], axis=1)
    return samples.tolist(), [tvist.filter(sample).tolist() for sample in samples]


def swung():
    """Reference and deflection of a mass: δ'' + 2ζω δ' + ω² δ = -q̈, with q̈ constant between samples."""
    (f_d, zeta), believed = SWING
    time, impulses = np.arange(0.0, LENGTH_S, STEP), shaper("zv").function(*believed)
    acceleration = sum(A * _profile(time - tau) for A, tau in zip(impulses.A, impulses.tau, strict=True))
    omega = 2.0 * np.pi * f_d / np.sqrt(1.0 - zeta**2)
    mass = TransferFunction([-1.0], [1.0, 2.0 * zeta * omega, omega**2])
    _, deflection, _ = lsim(mass, acceleration, time, interp=False)
    return {"reference": np.cumsum(np.cumsum(acceleration) * STEP) * STEP, "deflection": deflection}


def _profile(time):
    """Acceleration of the motion: up, then down, each with finite jerk."""
    half = MOTION_S / 2.0

    def pulse(t):
        return np.clip(np.minimum(t, half - t) / JERK_S, 0.0, 1.0)

    return (pulse(time) - pulse(time - half)) * TURN / (half * (half - JERK_S))


def moved(name, estimator, start, target):
    """Angles of the arm's links in one of `MOTIONS`."""
    description = load("one-joint")
    arm = FlexibleArm(description, description.payload)
    formula = FlexibleShoulder.of(description, description.payload)
    f_d, zeta = formula.mode(float(np.pi / 2.0))
    mode = formula.estimator() if estimator == "following" else Fixed([f_d], [zeta])
    tvist = TvistFilter(shaper(name), mode, joints=2)
    tvist.reset(start)
    reference = point_to_point(np.array(start), np.array(target))
    rest = np.tile(reference[-1], (AFTER, 1))
    shaped = tvist.filter_all(np.concatenate([reference, rest]))
    line = DrivenLine(description, description.payload)
    return respond(arm, line.drive(np.array(start), shaped, RESTING + len(shaped), RESTING), 0).measured.q
