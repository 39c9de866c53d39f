"""Moves of a robot that takes positions alone: where they go, and what ring-downs with hysteresis and a servo tell."""

from dataclasses import replace

import numpy as np
import pytest
from tests.lab.conftest import torques_along

from tvist_controller.api.line import (
    TORQUE_SHARE,
    CollisionModel,
    body,
    paper_payload,
)
from tvist_lab.identification.design import free_configurations, jog_of, predicted
from tvist_lab.identification.jogs import plan_jogs
from tvist_lab.identification.modal_fit import RAYLEIGH, describe, fit_modal, softened
from tvist_lab.identification.unknowns import ArmModes
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_plant.description import load
from tvist_plant.plant import PERIOD

ROBOT = load("ur5e")
STANDS = (0.2, -1.3, 1.4, -1.7, -1.5, 0.1)


async def planned(ring_downs):
    setup = replace(free_setup(calibration="none"), q=STANDS)
    async with robot_in_process(setup) as robot:
        return await plan_jogs(robot, ROBOT, ring_downs, seed=3, positions=True)


async def test_every_path_is_free_and_keeps_base_and_outer_wrist():
    plan = await planned(6)
    collisions, at = CollisionModel(ROBOT, body(plan.arm.payloads[0])), plan.at
    assert len(plan.jogs) == 6
    assert plan.seconds < 150.0
    assert max(plan.ways.velocity, plan.speed) <= min(ROBOT.limits.velocity)
    for jog in plan.jogs:
        for after in (*jog.way, jog.q):
            between = (at + share * (after - at) for share in np.linspace(0.0, 1.0, 200))
            assert all(collisions.meeting(q) is None for q in between)
            assert after[4:] == pytest.approx(STANDS[4:])
            at = after
        assert jog.q - jog.way[-1] == pytest.approx(jog_of(6))


async def test_jogs_stay_within_the_torques():
    """Its torque swings by as much again as that of a rigid arm, about its weight's."""
    plan = await planned(8)
    for jog in plan.jogs:
        weight, moving = torques_along(ROBOT, plan.arm.payloads[0], jog.way[-1], jog.q, jog.limits)
        assert (np.abs(weight) + 2.0 * np.abs(moving) <= TORQUE_SHARE * np.array(ROBOT.limits.torque)).all()
    assert len({jog.limits.acceleration for jog in plan.jogs}) > 1, "some poses demand a gentler jog"


def rings(driven=(), softening=0.0, count=4):
    """Ring-downs of the arm of the file, whose poles change with the amplitude, after a servo's coming to rest."""
    arm = ArmModes(ROBOT, (paper_payload(ROBOT, 5.0),))
    random, found = np.random.default_rng(2), []
    for q in free_configurations(ROBOT, arm.payloads, count, 0):
        ring = predicted(arm, q, 0)
        time = ring.time
        poles = arm.drivetrain(arm.guess).poles(arm.mass(q, 0))[0][:1]
        amplitude = 3.0 * np.exp(poles[0].real * time)
        lost = softening * np.cumsum(amplitude) * PERIOD * RAYLEIGH / abs(poles[0])
        force = np.outer((3.0 * np.exp(poles[0] * time - lost)).real, [0.3, 0.5, 0.8])
        for pole in driven:
            force += np.outer(np.exp(pole * time).real, [2.0, 1.0, -1.0])
        noisy = force + random.normal(0.0, 0.03, force.shape)
        found.append(replace(ring, force=noisy, noise=0.03, driven=driven))
    return arm, found


def errors(arm, ring_downs):
    fit, apart = fit_modal(arm, ring_downs), []
    for ring in ring_downs:
        mass = arm.mass(ring.q, 0)
        own, true = (describe(arm.drivetrain(p).poles(mass)[0][:1]) for p in (fit.logarithms, arm.guess))
        apart.append([abs(np.log(a[0] / b[0])) for a, b in zip(own, true, strict=True)])
    return np.median(apart, axis=0)


def test_settling_of_the_servo_is_no_vibration():
    arm, found = rings(driven=(-45.0 + 26.0j,))
    f_d, zeta = errors(arm, found)
    assert f_d < 0.01
    assert zeta < 0.05
    assert errors(arm, [replace(ring, driven=()) for ring in found])[1] > 2.0 * zeta


@pytest.fixture
def _two_softenings(monkeypatch):
    """Try no hysteresis, and much: each one is a fit."""
    monkeypatch.setattr("tvist_lab.identification.modal_fit.SOFTENINGS", (0.0, 200.0))


@pytest.mark.usefixtures("_two_softenings")
def test_hysteresis_is_found_with_the_poles_of_small_vibrations():
    arm, found = rings(softening=200.0, count=3)
    known = softened(arm, found)
    assert known[0].softening == 200.0
    assert errors(arm, known)[1] < min(errors(arm, found)[1], 0.1)


@pytest.mark.usefixtures("_two_softenings")
def test_arm_without_hysteresis_gets_none():
    arm, found = rings(count=3)
    known = softened(arm, found)
    assert known[0].softening == 0.0
    f_d, zeta = errors(arm, known)
    assert f_d < 0.01
    assert zeta < 0.05
