"""Advice from the recordings of hidden robots, and what then happens on the same robots."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

from tvist_client.arm import Arm
from tvist_client.errors import MotionStoppedError
from tvist_lab.advice import ROBOT, Advice, Option, Stop, advise
from tvist_lab.collect import collect
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.metrics import Measured
from tvist_lab.study.moves import Move, draw_moves
from tvist_plant.description import load
from tvist_plant.plant import PERIOD

ROBOTS = ("ur5e", "ur5-light")
WAYS, REPETITIONS = 3, 2
"""Number of random moves of each robot, each made to and fro, and how often."""
REST, BEFORE = 1.2, 0.4
"""Time at rest after a motion, and after the arm was put at the start of a move [s]."""
SPEEDS = ((1.5, 2.0), (2.0, 3.0))
"""Velocity and acceleration limits [rad/s, rad/s²], in turn."""
POINTS = 5.0
"""Largest difference of a reduction that comes true [percentage points]."""
SUMMARY = ("robot", "moves", "within 5 points %", "median difference", "predicted median %", "real median %")


@dataclass(frozen=True)
class Made:
    """A motion whose reduction was predicted and then measured."""

    robot: str
    seed: int
    motion: int
    shaper: str
    scope: str
    predicted: float
    """Reduction of the rms after the stop [%]."""
    real: float
    """The same, measured with the shaper on [%]."""


def report(robots: int, seed: int, tell: Callable[[str], None]) -> dict[str, Any]:
    """Let hidden robots make random moves, without a shaper and with the advised one.

    Args:
        robots: Number of hidden robots of each model.
        seed: Seed of the first robot and its moves; others follow.
        tell: Takes a line of progress.
    """
    made: list[Made] = []
    for name in ROBOTS:
        for one in range(seed, seed + robots):
            try:
                made += asyncio.run(_of_robot(name, one))
                tell(f"{name}, seed {one}: {len(made)} moves so far")
            except MotionStoppedError as error:  # a hidden robot may need more torque than it has
                tell(f"{name}, seed {one}: left out, {error}")
    summaries = [_summary(name, [one for one in made if one.robot == name]) for name in ROBOTS]
    return {"summary": [*summaries, _summary("all", made)], "moves": [vars(one) for one in made]}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return the summary as a table."""
    rows = [
        [value if isinstance(value, str) else f"{value:.4g}" for value in one.values()]
        for one in result["summary"]
    ]
    return [(SUMMARY, rows)]


def _summary(name: str, made: Sequence[Made]) -> dict[str, Any]:
    off = [abs(one.predicted - one.real) for one in made]
    return {
        "robot": name,
        "moves": len(made),
        "within_percent": 100.0 * sum(one <= POINTS for one in off) / max(len(off), 1),
        "median_difference": median(off) if off else 0.0,
        "predicted_percent": median(one.predicted for one in made) if made else 0.0,
        "real_percent": median(one.real for one in made) if made else 0.0,
    }


async def _of_robot(name: str, seed: int) -> list[Made]:
    description = load(name)
    moves = draw_moves(description, WAYS, seed, (description.payload.mass,) * 2).moves
    speed = SPEEDS[seed % len(SPEEDS)]
    unshaped = await _recorded(name, seed, moves, speed, None)
    advice = advise([unshaped])
    if advice.best is None:
        return []
    shaped = await _recorded(name, seed, moves, speed, advice)
    made = []
    for stop in advice.ringing:
        after = Stop.of(shaped, stop.number - 1)
        real = 100.0 * (1.0 - replace(after, noise=stop.noise).unshaped.rms / stop.unshaped.rms)
        predicted = 100.0 - advice.best.percent[stop]
        made.append(Made(name, seed, stop.number, advice.best.name, advice.best.aim.scope, predicted, real))
    return made


async def _recorded(
    name: str, seed: int, moves: Sequence[Move], speed: tuple[float, float], advice: Advice | None
) -> Measured:
    """Make the moves, to and fro; with the advised shaper if there is one."""
    setup = free_setup(robot=name, hidden=seed, truth=False, shaper="none", seed=seed)
    best = None if advice is None else advice.best
    groups = {} if advice is None else {one.number: one.group for one in advice.ringing}
    async with robot_in_process(setup) as robot, robot.control("advice") as arm:
        with collect(robot) as collected:
            number = 0
            for move in moves:
                await arm.reset(q=move.start)
                await robot.pass_time(round(BEFORE / PERIOD))
                for target in (move.target, move.start) * REPETITIONS:
                    number += 1
                    if best is not None and number in groups:
                        await _aim(arm, best, groups[number])
                    await arm.move_j(target, velocity=speed[0], acceleration=speed[1])
                    await robot.pass_time(round(REST / PERIOD))
        return Measured.of(collected.recording())


async def _aim(arm: Arm, best: Option, group: int) -> None:
    """Do what the advice says before a motion."""
    if best.aim.scope != ROBOT:
        f_d, zeta = zip(*best.aim.modes[group], strict=True)
        await arm.set_estimator("fixed", f_d=f_d, zeta=zeta)
    await arm.set_shaper(best.shaper, best.count)
