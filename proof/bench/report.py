"""Speed on this machine: figures beside references from the same run."""

import asyncio
from collections.abc import Callable, Coroutine, Mapping, Sequence
from typing import Any

import msgspec

from proof.bench.figure import Figure, figure
from proof.bench.line import line, whole_motion
from proof.bench.many_robots import memory, us_per_robot_and_tick
from proof.bench.one_reader import one_reader
from proof.bench.programs import programs
from proof.bench.rtde import rtde
from proof.bench.start import start
from tvist_lab.bench.machine import this_machine
from tvist_lab.bench.many_robots import robots_at_500_hz
from tvist_lab.bench.moving import line_tick
from tvist_lab.bench.one_robot import one_robot
from tvist_plant.plant import PERIOD

OF_MANY = 0.4
"""Time for which each number of robots is measured, as a share of the time for one robot [-]."""

Tell = Callable[[str], None]


async def _robots(seconds: float, tell: Tell) -> dict[str, Figure]:
    tell("the line of one robot")
    alone = line_tick("zv")
    alone()
    us = min(alone() for _ in range(5))
    robot = await us_per_robot_and_tick(OF_MANY * seconds, tell)
    most = await robots_at_500_hz(max(2.0, OF_MANY * seconds), tell)
    return {
        "robot_us_per_tick": figure("a served robot of several", "µs per tick", [robot], "the line in process", [us]),
        "robots_at_500_hz": figure(
            "robots at 500 Hz on one core", "", [most], "robots whose line a core computes", [1e6 * PERIOD / us]
        ),
    }  # fmt: skip


COMPUTED: Mapping[str, Callable[[Tell], dict[str, Figure]]] = {
    "line": line,
    "motion": whole_motion,
    "programs": programs,
}
"""The parts that serve no robot, in the order in which they are measured."""
SERVED: Mapping[str, Callable[[float, Tell], Coroutine[Any, Any, dict[str, Any]]]] = {
    "served": one_robot, "reader": one_reader, "ur": rtde, "memory": memory, "robots": _robots,
}  # fmt: skip
"""The parts that serve robots in real time, after `start`, which does so, too."""
PARTS = (*COMPUTED, "start", *SERVED)


def bench(seconds: float, tell: Tell, only: Sequence[str] = PARTS) -> dict[str, Any]:
    """Measure.

    Args:
        seconds: Duration of each measurement of a robot in real time [s]; 0 to skip what serves robots.
        tell: Called with a description of each measurement before it starts.
        only: Parts to measure.
    """
    found: dict[str, Any] = {}
    machine = msgspec.to_builtins(this_machine())
    for name in only:
        if name in COMPUTED:
            found |= COMPUTED[name](tell)
        elif seconds > 0.0:
            found |= start(tell) if name == "start" else asyncio.run(SERVED[name](seconds, tell))
    figures = {key: one for key, one in found.items() if isinstance(one, Figure)}
    values = {key: figures[key].value if key in figures else one for key, one in found.items()}
    return {"seconds": seconds, "machine": machine, "figures": msgspec.to_builtins(figures), **values}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the table of figures with references, and one of the others."""
    figures = result["figures"]
    others = {key: value for key, value in result.items() if key not in {*figures, "figures", "machine"}}
    flat = {
        f"{key}: {name}" if name else key: one
        for key, value in others.items()
        for name, one in (value.items() if isinstance(value, dict) else [("", value)])
    }
    columns = ("figure", "value", "unit", "reference", "value", "ratio", "95 %", "n")
    return [
        (("machine", ""), [[key, _plain(value)] for key, value in result["machine"].items()]),
        (columns, [_row(one) for one in figures.values()]),
        (("without a reference", "figure"), [[key, f"{value:.4g}"] for key, value in flat.items()]),
    ]


def _plain(value: Any) -> str:
    """Return a text or a number; of several versions, a list."""
    return ", ".join(map(" ".join, value.items())) if isinstance(value, dict) else f"{value}"


def _row(one: dict[str, Any]) -> list[str]:
    ratio, low, high = one["compared"], one["low"], one["high"]
    return [
        one["what"],
        f"{one['value']:.4g}",
        one["unit"],
        one["reference"],
        f"{one['reference_value']:.4g}",
        "–" if ratio is None else f"{ratio:.3g}",
        "" if low is None else f"{low:.3g} to {high:.3g}",
        str(one["repetitions"]),
    ]
