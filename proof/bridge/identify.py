"""How well `tvist identify --plant` finds hidden robots that take positions alone, beside what it should."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from msgspec.structs import replace as with_fields

from proof.bridge.in_lockstep import HiddenRobot, Link, Port
from tvist_controller.api.line import body, modal_estimator
from tvist_controller.api.robot import OwnPlant
from tvist_lab.identification.modal_plan import ModalPlan
from tvist_lab.identification.positioned import JOG, Positioned, identify_moved, make_moves, plan_moves
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.recordings import Floats
from tvist_lab.workspace import identified, ranges
from tvist_plant.description import RobotDescription, load
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import Measurement
from tvist_plant.variants import hidden_variant
from tvist_server.moving.servo_lag import ServoLag, Setpoints

ROBOTS = ("ur5e", "ur5e", "ur5-light")
"""Robot files of the hidden robots, which take turns."""
SPEED = 0.5
"""Speed cap [rad/s]."""
STANDS = (0.2, -1.3, 1.4, -1.7, -1.5, 0.1)
"""Where the arm stands at first [rad]."""
BEGINS = 100
"""Ticks until the program follows."""
PLACES = 60
"""Number of unseen configurations of each robot."""
ASKED = {
    "f_d_median_percent": "",
    "f_d_p90_percent": "at most 3",
    "zeta_median_percent": "",
    "zeta_p90_percent": "at most 10",
    "ring_downs": "at most 12",
    "robot_seconds": "at most 300",
}
"""What is asked."""


class Rows(Port):
    """The same with rows at a lower rate: the arm's measurements are those of every fourth period.

    Args:
        every: Control periods between two rows.
        more: Arguments of `Port`.
    """

    def __init__(self, every: int, *more: Any) -> None:
        super().__init__(*more)
        self._every, self._seen = every, self.measure()

    def step(self, command: DriveCommand) -> Measurement:
        """Send the set-point, and return the latest row."""
        row = super().step(command)
        if self.counts.ticks % self._every == 0:
            self._seen = row
        return self._seen


def report(robots: int, seed: int, every: Sequence[int], tell: Callable[[str], None]) -> dict[str, Any]:
    """Identify hidden robots at each rate of rows, and judge the calibrations.

    Args:
        robots: Number of hidden robots.
        seed: Seed of the first.
        every: Control periods between two rows, 1 for 500 Hz, 4 for 125 Hz.
        tell: Called with what is done.
    """
    rows = []
    for number in range(robots):
        for periods in every:
            name, hidden = ROBOTS[number % len(ROBOTS)], seed + number
            tell(f"{name}, hidden {hidden}, a row in {periods} periods")
            rows.append(_row(name, hidden, periods))
    return {"robots": rows}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the figures as a table: a row for each, a column for each robot and rate."""
    rows = result["robots"]
    names = [f"{row['robot']} {row['hidden']}, {row['rate_hz']:.0f} Hz" for row in rows]
    keys = [key for key in rows[0] if key not in ("robot", "hidden", "rate_hz")]
    lines = [[key, *(f"{row[key]:.3g}" for row in rows), ASKED.get(key, "")] for key in keys]
    return [(["figure", *names, "asked"], lines)]


def _row(name: str, hidden: int, every: int) -> dict[str, Any]:
    description = load(name)
    done = asyncio.run(identified_in_lockstep(description, hidden, every))
    calibration, servo = done.found.calibration, done.servo
    true = ServoLag.simulated()
    row: dict[str, Any] = {
        "robot": name,
        "hidden": hidden,
        "rate_hz": 500.0 / every,
        "ring_downs": done.found.used,
        "robot_seconds": done.seconds,
        "servo_lag_error_percent": np.nan if servo is None else 100.0 * (servo.lag / true.time - 1.0),
        "servo_gain_error_percent": np.nan if servo is None else 100.0 * (servo.gain / true.gain - 1.0),
        "known_percent": done.found.known_percent,
    }
    estimator = modal_estimator(calibration, description, calibration.payload, 1)
    errors = []
    for q, f_d, zeta in unseen(description, hidden, calibration.payload, hidden):
        own_f_d, own_zeta = (values[0] for values in estimator.estimate(q))
        known = done.found.forecast.at(q, 0)
        errors.append(
            (np.log(own_f_d / f_d), np.log(own_zeta / zeta), known.f_d_error[0], known.zeta_error[0])
        )
    f_d, zeta, f_d_error, zeta_error = np.abs(np.array(errors)).T
    for what, error, sure in (("f_d", f_d, f_d_error), ("zeta", zeta, zeta_error)):
        row[f"{what}_median_percent"], row[f"{what}_p90_percent"] = (
            100.0 * np.quantile(error, (0.5, 0.9))
        ).tolist()
        row[f"{what}_interval_holds_percent"] = 100.0 * float(np.mean(error < 1.96 * sure))
    return row


async def identified_in_lockstep(description: RobotDescription, hidden: int, every: int) -> Positioned:
    """Identify one hidden robot behind the program, a link and our control line, as fast as it computes."""
    name = description.robot.name
    setup = free_setup(robot=name, truth=False, shaper="none", calibration="none")
    q, payload = np.array(STANDS), setup.payload
    reach = np.array(description.limits.position)

    def port(*_: object) -> Port:
        robot = HiddenRobot(description, hidden, q, payload)
        robot.follow(SPEED)
        return Rows(every, robot, Setpoints(q, None, fastest=1.04 * SPEED, reach=reach), Link(), hidden)

    limits = with_fields(description.limits, velocity=(SPEED,) * description.joints)
    drives = with_fields(description.drives, windup_feedforward=(0.0,) * description.joints)
    capped = with_fields(description, limits=limits, drives=drives)
    whole = replace(setup, description=capped, q=tuple(q.tolist()), plant=OwnPlant("lockstep", "", port))
    async with robot_in_process(whole) as robot, robot.control("identify") as control:
        await robot.advance(BEGINS)
        moves = await plan_moves(robot, description, ModalPlan(seed=hidden, jog=JOG))
        moved = await make_moves(robot, control, moves, lambda _: None)
    return identify_moved(
        moves, moved, name="found", command="proof bridge identify", progress=lambda _: None
    )


def unseen(
    description: RobotDescription, hidden: int, declared: Any, seed: int
) -> list[tuple[Floats, float, float]]:
    """Return configurations, and frequency and damping ratio of the lowest mode of the hidden robot there.

    It is linearised at rest. There a gear whose twist has turned back is as stiff as its hysteresis makes it.
    """
    stiffer = 1.0 + description.imperfections.get("hysteresis", 0.0)
    drives = description.drives
    stiff = with_fields(drives, gear_stiffness=tuple(stiffer * K for K in drives.gear_stiffness))
    arm: Any = hidden_variant(hidden).make(with_fields(description, drives=stiff), body(declared), 0)
    places = identified(ranges(description)).random(PLACES, description.joints, seed + 1000)
    found = [(q, arm.modes(q)) for q in places]
    return [(q, float(modes.f_d[0]), float(modes.zeta[0])) for q, modes in found]
