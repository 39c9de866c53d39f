"""Processor time of ticks beside MuJoCo's: of plant, filter, Figure 6 and the whole line; and of a whole motion."""

import time
from collections.abc import Callable

import numpy as np

from proof.bench.figure import Figure, figure, in_alternation
from tvist_controller.api.line import DrivenLine, body, respond
from tvist_lab.bench.moving import (
    Run,
    arm_tick,
    cycle_tick,
    line_filter,
    line_tick,
    motion,
    plant_tick,
    stream_tick,
    us_per_tick,
)  # fmt: skip
from tvist_lab.in_process import free_setup
from tvist_lab.studies.paper.published import pose
from tvist_lab.study.line import Unchanged, point_to_point
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_plant.world.second_opinion import SecondOpinion
from tvist_shaping import TvistFilter, shaper

OF_TICKS = 20
SHAPERS = ("zv", "auto", "elastic")
"""Filters with which the line is measured; the first one is that of a robot without options."""
STREAMS = (500, 125)
"""Rates of set-points with which it is measured [Hz]."""
MUJOCO_STEP = 0.00025
"""Step at which MuJoCo agrees with our plant [s]."""
MUJOCO = "MuJoCo's tick"
OF_MOTIONS = 30


def line(tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure the line and its parts with MuJoCo in turn.

    Args:
        tell: Called with a description of the measurement before it starts.
    """
    tell("the line and its parts beside MuJoCo")
    runs: dict[str, Run] = {
        "mujoco": _mujoco_tick(), "plant": plant_tick(), "filter": _filter_tick(), "cycle": cycle_tick(),
        **{_key(name): line_tick(name) for name in SHAPERS},
        **{f"stream_{rate}_hz": stream_tick(round(1.0 / (rate * PERIOD))) for rate in STREAMS},
    }  # fmt: skip
    found = in_alternation(runs, OF_TICKS)
    mujoco, usual = found.pop("mujoco"), SHAPERS[0]
    said = {
        "plant": "2 ms of the flexible arm",
        "filter": f"the filter {usual} with its estimator",
        "cycle": f"Figure 6 with {usual}: trajectory to plant",
        **{_key(name): f"the line with {name}: messages to encoded state" for name in SHAPERS},
        **{
            f"stream_{rate}_hz": f"the line with {usual} and set-points at {rate} Hz: messages to encoded state"
            for rate in STREAMS
        },
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


def _mujoco_tick() -> Run:
    setup = free_setup(truth=False)
    return arm_tick(SecondOpinion(setup.description, body(setup.payload), MUJOCO_STEP))


def _filter_tick() -> Run:
    tvist, references = line_filter(free_setup(truth=False)), motion()

    def go() -> None:
        for q in references:
            tvist.filter(q)

    def run() -> float:
        tvist.reset(references[0])
        return us_per_tick(go)

    return run


def whole_motion(tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure a whole motion and its arm.

    The motion goes from Q1 to Q3, shaped by zv. What counts is what a study repeats: the filter, the line to the drives
    and the arm, of which each is prepared once.

    Args:
        tell: Called with a description of the measurement before it starts.
    """
    tell("a whole motion in one go, and its arm alone")
    setup = free_setup(truth=False, shaper="zv")
    start, target, payload = np.array(pose("Q1")), np.array(pose("Q3")), body(setup.payload)
    reference = point_to_point(start, target)
    whole = np.concatenate([reference, np.tile(target, (200, 1))])
    tvist = TvistFilter(shaper(setup.shaper), setup.estimator(), joints=len(start))
    line, arm = (
        DrivenLine(setup.description, Unchanged(len(start)), start, payload),
        FlexibleArm(setup.description, payload),
    )

    def shaped() -> None:
        tvist.reset(start)
        respond(arm, line.drive(start, tvist.filter_all(whole), len(whole)), 0)

    tvist.reset(start)
    driven = line.drive(start, tvist.filter_all(whole), len(whole))

    def alone() -> None:
        respond(arm, driven, 0)

    ticks = len(whole)
    found = in_alternation(
        {"whole": lambda: _us(shaped, ticks), "alone": lambda: _us(alone, ticks)}, OF_MOTIONS
    )
    return {
        "motion_us_per_tick": figure(
            "a whole motion in one go", "µs per tick", found["whole"], "its arm alone", found["alone"]
        )
    }


def _us(call: Callable[[], None], ticks: int) -> float:
    """Processor time of a call for each of its ticks [us]."""
    began = time.thread_time()
    call()
    return 1e6 * (time.thread_time() - began) / ticks
