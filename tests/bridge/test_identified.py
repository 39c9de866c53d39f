"""How well `tvist identify ur://…` finds hidden robots that take positions alone, where it never visited them."""

import asyncio
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace as with_fields
from tests.bridge.in_lockstep import HiddenRobot, Link, Port

from tvist_controller.api.line import body, modal_estimator
from tvist_controller.api.robot import OwnPlant
from tvist_lab.identification.calibrate import calibrate
from tvist_lab.identification.jogs import make_jogs, plan_jogs
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.workspace import identified
from tvist_plant.description import load
from tvist_plant.variants import hidden_variant
from tvist_server.moving.servo_lag import ServoLag, ServoSetpoints

SPEED = 0.5  # speed cap [rad/s]
STANDS = (0.2, -1.3, 1.4, -1.7, -1.5, 0.1)  # where the arm stands at first [rad]
BEGINS = 100  # ticks until the program follows
PLACES = 60  # number of unseen configurations of each robot


class Rows(Port):
    """A port that measures only once in `every` periods."""

    def __init__(self, every, *more):
        super().__init__(*more)
        self._every, self._seen = every, self.measure()

    def step(self, command):
        """Send the set-point, and return the latest row."""
        row = super().step(command)
        if self.counts.ticks % self._every == 0:
            self._seen = row
        return self._seen


async def measured_in_lockstep(description, hidden, every):
    """Make the jogs of one hidden robot behind the program, a link and our control line, as fast as it computes."""
    name = description.robot.name
    setup = free_setup(robot=name, truth=False, shaper="none", calibration="none")
    q, payload = np.array(STANDS), setup.payload
    reach = np.array(description.limits.position)

    def port(*_):
        robot = HiddenRobot(description, hidden, q, payload)
        robot.follow(SPEED)
        return Rows(every, robot, ServoSetpoints(q, None, fastest=1.04 * SPEED, reach=reach), Link(), hidden)

    limits = with_fields(description.limits, velocity=(SPEED,) * description.joints)
    drives = with_fields(description.drives, windup_feedforward=(0.0,) * description.joints)
    capped = with_fields(description, limits=limits, drives=drives)
    whole = replace(setup, description=capped, q=tuple(q.tolist()), plant=OwnPlant("lockstep", "", port))
    async with robot_in_process(whole) as robot, robot.control("identify") as control:
        await robot.advance(BEGINS)
        plan = await plan_jogs(robot, description, seed=hidden, positions=True)
        return await make_jogs(robot, control, plan, lambda _: None)


def unseen(description, hidden, declared, seed):
    """Return configurations, and frequency and damping ratio of the lowest mode of the hidden robot there.

    It is linearised at rest. There a gear whose twist has turned back is as stiff as its hysteresis makes it.
    """
    stiffer = 1.0 + description.imperfections.hysteresis
    drives = description.drives
    stiff = with_fields(drives, gear_stiffness=tuple(stiffer * K for K in drives.gear_stiffness))
    arm: Any = hidden_variant(hidden).make(with_fields(description, drives=stiff), body(declared), 0)
    places = identified(description).random(PLACES, description.joints, seed + 1000)
    found = [(q, arm.modes(q)) for q in places]
    return [(q, float(modes.f_d[0]), float(modes.zeta[0])) for q, modes in found]


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "hidden", "every"), [("ur5e", 11, 4), ("ur5-light", 13, 1)])
def test_a_position_controlled_robot_is_identified_at_unseen_poses(name, hidden, every, measured):
    description = load(name)
    measured_jogs = asyncio.run(measured_in_lockstep(description, hidden, every))
    how = {"name": "found", "command": "tvist identify", "progress": lambda _: None}
    found = calibrate(description, measured_jogs, **how)
    calibration, servo, true = found.calibration, measured_jogs.servo, ServoLag.simulated()
    estimator = modal_estimator(calibration, description, calibration.payload, 1)
    errors, sure = [], []
    for q, f_d, zeta in unseen(description, hidden, calibration.payload, hidden):
        own_f_d, own_zeta = (values[0] for values in estimator.estimate(q))
        known = found.forecast.at(q, 0)
        errors.append(np.abs(np.log((own_f_d / f_d, own_zeta / zeta))))
        sure.append((known.f_d_error[0], known.zeta_error[0]))
    median, p90 = 100.0 * np.quantile(errors, (0.5, 0.9), axis=0)
    held = 100.0 * np.mean(np.array(errors) < 1.96 * np.array(sure), axis=0)
    for what, value in {
        "ring-downs": found.used, "time [s]": measured_jogs.seconds, "known [%]": found.known_percent,
        "f_d, median [%]": median[0], "f_d, p90 [%]": p90[0], "f_d, interval holds [%]": held[0],
        "ζ, median [%]": median[1], "ζ, p90 [%]": p90[1], "ζ, interval holds [%]": held[1],
        "lag of servoj [%]": np.nan if servo is None else 100.0 * (servo.lag / true.time - 1.0),
    }.items():  # fmt: skip
        measured(what, f"{value:.3g}")
    assert found.used <= 12
    assert measured_jogs.seconds <= 300.0
    assert p90[0] <= (4.0 if every == 1 else 9.0)
    assert p90[1] <= (25.0 if every == 1 else 50.0)
