"""Speed on this machine: figures beside references from the same run."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from tvist_lab.benchmark.figure import Figure, figure
from tvist_lab.benchmark.line import line
from tvist_lab.benchmark.machine import this_machine
from tvist_lab.benchmark.many_robots import robots_at_500_hz, us_per_robot_and_tick
from tvist_lab.benchmark.memory import memory
from tvist_lab.benchmark.moving import MovingRobot
from tvist_lab.benchmark.names import PartName
from tvist_lab.benchmark.observed import observed
from tvist_lab.benchmark.one_robot import one_robot
from tvist_lab.benchmark.programs import programs
from tvist_lab.benchmark.saved_run import FORMAT, BenchRun
from tvist_lab.benchmark.start import start
from tvist_lab.benchmark.ur_interfaces import ur_interfaces, with_a_program
from tvist_lab.benchmark.whole_motion import whole_motion
from tvist_plant.plant import PERIOD

OF_MANY = 0.4
"""Time for which each number of robots is measured, as a share of the time for one robot [-]."""

Tell = Callable[[str], None]
Figures = dict[str, Figure]
Details = dict[str, Any]


class Part(NamedTuple):
    """A part of the bench."""

    measure: Callable[[float, Sequence[str], Tell], tuple[Figures, Details]]
    """Measures it; takes the seconds of each measurement in real time, names of further filters, and a listener."""
    serves: bool = False
    """Whether it serves robots in real time."""


def _ur(seconds: float, _: Sequence[str], tell: Tell) -> tuple[Figures, Details]:
    found = asyncio.run(ur_interfaces(seconds, tell))
    loop = asyncio.run(with_a_program(OF_MANY * seconds, tell))
    figures = {
        "rtde_us_per_client_and_tick": figure(
            "an RTDE client, of ten with different recipes", "µs per tick",
            [found["us_per_client_and_tick"]], "a bare send() of as many bytes", [found["bare_us_per_client_and_tick"]],
        )
    }  # fmt: skip
    return figures, {"ur_interfaces": found, "ur_interfaces_with_a_program": loop}


def _robots(seconds: float, _: Sequence[str], tell: Tell) -> tuple[Figures, Details]:
    tell("the line of one robot")
    alone = MovingRobot.with_shaper("zv").us_per_tick
    alone()
    us = min(alone() for _ in range(5))
    robot = asyncio.run(us_per_robot_and_tick(OF_MANY * seconds, tell))
    most = asyncio.run(robots_at_500_hz(max(2.0, OF_MANY * seconds), tell))
    figures = {
        "robot_us_per_tick": figure("a served robot of several", "µs per tick", [robot], "the line in process", [us]),
        "robots_at_500_hz": figure(
            "robots at 500 Hz on one core", "", [most], "robots whose line a core computes", [1e6 * PERIOD / us]
        ),
    }  # fmt: skip
    return figures, {}


PARTS: Mapping[PartName, Part] = {
    "line": Part(lambda _, shapers, tell: (line(shapers, tell), {})),
    "motion": Part(lambda _, __, tell: (whole_motion(tell), {})),
    "programs": Part(lambda _, __, tell: (programs(tell), {})),
    "start": Part(lambda _, __, tell: (start(tell), {}), serves=True),
    "served": Part(lambda seconds, _, tell: ({}, asyncio.run(one_robot(seconds, tell))), serves=True),
    "ur": Part(_ur, serves=True),
    "observers": Part(
        lambda seconds, _, tell: ({}, {"observers": asyncio.run(observed(OF_MANY * seconds, tell))}), serves=True
    ),
    "memory": Part(lambda _, __, tell: ({}, {"memory": asyncio.run(memory(tell))}), serves=True),
    "robots": Part(_robots, serves=True),
}  # fmt: skip
"""The parts in the order in which they are measured."""


def bench(
    seconds: float, tell: Tell, only: Sequence[PartName] | None = None, shapers: Sequence[str] = ()
) -> BenchRun:
    """Measure.

    Args:
        seconds: Duration of each measurement of a robot in real time [s]; 0 to skip what serves robots.
        tell: Called with a description of each measurement before it starts.
        only: Parts to measure; None for all.
        shapers: Further filters with which the line is measured.
    """
    machine = this_machine()
    figures: Figures = {}
    details: Details = {}
    for name, part in PARTS.items():
        if (seconds > 0.0 or not part.serves) if only is None else name in only:
            found, more = part.measure(seconds, shapers, tell)
            figures |= found
            details |= more
    return BenchRun(format=FORMAT, seconds=seconds, machine=machine, figures=figures, details=details)
