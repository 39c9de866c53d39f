"""Motors that stick: stiction is exact in each substep, never gives energy, and holds an arm like a spring."""

import math

import numpy as np
import pytest

from tvist_plant.arm_memory import GRAVITY, LAST, NOW
from tvist_plant.description import load
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.imperfections import Imperfections
from tvist_plant.integrator import rows
from tvist_plant.robot_tables import Payload
from tvist_plant.stiction import relaxed, stiction_after

from .arms import changed, conservative
from .reference import commands

STICKS = load("ur5e_stiction")
LAW = Imperfections.of(STICKS)


def stiction_of(arm):
    """The stiction of the motors, and its stiffness before it breaks away."""
    return rows(arm._arm.state, arm.description.joints).d, arm._law.stiction_stiffness


@pytest.mark.parametrize("start", [-1.0, 0.0, 0.4, 1.0, 3.0])
@pytest.mark.parametrize("way", [-2e-5, -1e-7, 1e-7, 2e-5])
def test_one_step_equals_many_and_the_differential_equation(start, way):
    """Beyond the break-away torque, too, where stiction is for a moment after it has fallen."""
    stiffness, most, parts = 7e5, 1.2, 200_000
    small = integrated = start
    for _ in range(parts):
        small = relaxed(small, way / parts, stiffness, most)
        integrated += stiffness * (1.0 - integrated * math.copysign(1.0, way) / most) * way / parts
    once = relaxed(start, way, stiffness, most)
    assert once == pytest.approx(small, abs=1e-9)
    assert once == pytest.approx(integrated, abs=1e-3)


@pytest.mark.parametrize("turn", [1e-7, 1e-5, 1e-3], ids=["held", "breaking away", "sliding"])
def test_random_turns_under_random_loads_take_more_than_they_give_back(turn):
    """With the plant's scheme: the torque after half of the turn acts over all of it."""
    random, d, taken, stiffness = np.random.default_rng(5), 0.0, 0.0, 7e5
    for _ in range(20_000):
        way, speed, load = turn * random.normal(), 0.05 * random.normal(), 100.0 * random.normal()
        law = speed, load, 0.5, 0.015, 0.03, stiffness
        before = 0.5 * d * d / stiffness
        work = way * stiction_after(d, 0.5 * way, *law)
        d = stiction_after(d, way, *law)
        taken += work
        assert work >= 0.5 * d * d / stiffness - before - 1e-18
    assert taken > 0.0


@pytest.mark.parametrize("mass", [0.0, 5.0])
@pytest.mark.parametrize("pose", ["Q1", "Q3"])
@pytest.mark.parametrize("speed", [1e-4, 1e-3, 1e-2, 0.1], ids=lambda speed: f"{speed:g} rad/s")
@pytest.mark.parametrize("factor", [1.0, 10.0])
def test_an_arm_that_rings_without_drives_only_loses_energy_to_stiction(pose, mass, speed, factor, measured):
    """An undamped arm is struck while its motors hang on springs, and turns back hundreds of times."""
    arm, spring = conservative(STICKS), 5e3
    arm = changed(arm, "payload", mass=mass) if mass else arm
    arm = changed(arm, "drives", gear_error_amplitude=0.0)
    sticks = Imperfections(
        stiction=tuple(factor * value for value in LAW.stiction), stiction_load=factor * LAW.stiction_load
    )
    plant = FlexibleArm(arm, arm.payload if mass else Payload(), imperfections=sticks)
    plant._flexible.model.gravity.linear = np.zeros(3)
    plant.memory[GRAVITY] = 0.0
    start = np.array(arm.poses[pose])
    command = DriveCommand(start, np.zeros(6), np.zeros(6))
    plant.reset(command)
    links, random = len(plant._q), np.random.default_rng(1)
    plant._arm.springs[0, links:] += spring
    plant._arm.joints[2] = spring  # the position gains, which are springs without a damper
    plant._qd[:], plant._speed[:] = speed * random.normal(size=links), speed * random.normal(size=6)
    plant._evaluate()
    plant._arm.dynamics[LAST] = plant._arm.dynamics[NOW]
    d, stiffness = stiction_of(plant)
    energy = []
    for _ in range(1000):
        held = 0.5 * np.sum(d**2 / stiffness) + 0.5 * spring * np.sum((plant._motor - start) ** 2)
        energy.append(plant.energy() + held)
        plant.step(command)
    risen = np.max(energy - np.minimum.accumulate(energy)) / energy[0]
    measured("largest rise and what is left, over the energy at the start", (risen, energy[-1] / energy[0]))
    assert risen < 5e-5  # of an arm without stiction: up to 6e-4, by the integrator
    assert energy[-1] < 0.3 * energy[0]


def test_a_motor_is_held_for_a_minute_by_half_its_stiction_and_springs_back():
    """The base alone has no drive. It turns as a spring that gives way, and back by what is elastic of that."""
    gains = {
        name: (0.0, *getattr(STICKS.drives, name)[1:])
        for name in ("velocity_gain", "position_gain", "integral_gain")
    }
    arm = changed(STICKS, "drives", gear_error_amplitude=0.0, **gains)
    plant = FlexibleArm(arm, arm.payload)
    command = DriveCommand(np.array(arm.poses["Q1"]), np.zeros(6), np.zeros(6))
    plant.reset(command)
    _, stiffness = stiction_of(plant)
    most = LAW.stiction[0]
    start, scale = plant._motor[0], most / stiffness[0]

    def turned(ticks, share, before):
        """Angles while a push goes within 2 s to a share of the stiction; a sudden one would swing beyond it."""
        for tick in range(ticks):
            way = math.sin(0.5 * math.pi * min(tick / 1000, 1.0)) ** 2
            plant.push(most * (before + way * (share - before)) * np.eye(6)[0])
            plant.step(command)
            yield plant._motor[0] - start

    held = list(turned(31_000, 0.5, 0.0))
    assert held[1000] == pytest.approx(math.log(2.0) * scale, rel=0.02)  # 0.5 µrad
    assert max(held) - held[1000] < 0.02 * scale
    *_, back = turned(5000, 0.0, 0.5)
    assert held[-1] - back == pytest.approx(math.log(1.5) * scale, rel=0.02)


def test_four_substeps_are_enough():
    drive = commands(STICKS, STICKS.poses["Q1"], STICKS.poses["Q3"], 700)

    def felt(substeps):
        arm = FlexibleArm(
            changed(STICKS, "sensors", accelerometer_noise=0.0), STICKS.payload, substeps=substeps
        )
        arm.reset(drive[0], seed=3)
        return np.array([arm.step(command).accelerometer for command in drive[1:]])

    usual, fine = felt(None), felt(64)
    assert FlexibleArm(STICKS, STICKS.payload)._substeps == 4
    assert np.abs(usual - fine).max() < 0.03
    assert np.abs(felt(16) - fine).max() < 0.25 * np.abs(usual - fine).max()


def test_an_arm_with_stiction_pushed_at_rest_does_what_it_did_before():
    plant, command = (
        FlexibleArm(STICKS, STICKS.payload),
        commands(STICKS, STICKS.poses["Q1"], STICKS.poses["Q1"], 1)[0],
    )
    runs = []
    for _ in range(2):
        plant.reset(command, seed=4)
        random = np.random.default_rng(2)
        for tick in range(500):
            if tick % 20 == 0:
                plant.push(5.0 * random.normal(size=6))
            plant.step(command)
        runs.append(plant.memory.copy())
    np.testing.assert_array_equal(*runs)
