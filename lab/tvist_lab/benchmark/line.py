"""Processor time of a tick: of the plant, the filter, Figure 6 and the whole line, relative to MuJoCo's tick."""

from collections.abc import Callable, Sequence

from tvist_lab.benchmark.figure import Figure, Run, figure, in_alternation
from tvist_lab.benchmark.moving import MovingRobot, cycle_tick, filter_tick, mujoco_tick, plant_tick
from tvist_plant.plant import PERIOD

REPETITIONS = 20
SHAPERS = ("zv", "auto")
"""Filters with which the line is always measured; the first one is that of a robot without options."""
MUJOCO = "MuJoCo's tick"


def line(shapers: Sequence[str], tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure the line and its parts with MuJoCo in turn.

    Args:
        shapers: Names of further filters with which the line is measured.
        tell: Called with a description of the measurement before it starts.
    """
    tell("the line and its parts beside MuJoCo")
    names = tuple(dict.fromkeys((*SHAPERS, *shapers)))
    lines = {name: MovingRobot.with_shaper(name).us_per_tick for name in names}
    runs: dict[str, Run] = {
        "mujoco": mujoco_tick(), "plant": plant_tick(), "filter": filter_tick(), "cycle": cycle_tick(),
        **{_key(name): run for name, run in lines.items()},
    }  # fmt: skip
    found = in_alternation(runs, REPETITIONS)
    mujoco, usual = found.pop("mujoco"), SHAPERS[0]
    said = {
        "plant": "2 ms of the flexible arm",
        "filter": f"the filter {usual} with its estimator",
        "cycle": f"Figure 6 with {usual}: trajectory to plant",
        **{_key(name): f"the line with {name}: messages to encoded state" for name in names},
    }
    figures = {
        f"{key}_us_per_tick": figure(said[key], "µs", taken, MUJOCO, mujoco) for key, taken in found.items()
    }
    figures["realtime_factor"] = figure(
        f"robots with {usual} that a core computes in real time",
        "",
        [1e6 * PERIOD / taken for taken in found[_key(usual)]],
        "arms that a core computes with MuJoCo",
        [1e6 * PERIOD / taken for taken in mujoco],
    )
    return figures


def _key(shaper: str) -> str:
    return "line" if shaper == SHAPERS[0] else f"line_{shaper.replace('-', '_')}"
