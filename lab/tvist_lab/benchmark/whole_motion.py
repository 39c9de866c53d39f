"""A whole motion in one go, beside its arm alone in the same loop."""

import time
from collections.abc import Callable

import numpy as np

from tvist_controller.api import DrivenLine, body, respond
from tvist_lab.benchmark.in_turn import mean_and_interval
from tvist_lab.evaluation.line import Unchanged, point_to_point
from tvist_lab.in_process import free_setup
from tvist_lab.paper.published import pose
from tvist_plant.flexible_arm import FlexibleArm
from tvist_shaping import TvistFilter, shaper

ROUNDS = 30
"""Number of rounds, in each of which all of it is measured once."""


def whole_motion(tell: Callable[[str], None]) -> dict[str, float]:
    """Return the time per tick of a whole motion and of its arm [us], and their ratio with its interval.

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

    def motion() -> None:
        tvist.reset(start)
        respond(arm, line.drive(start, tvist.filter_all(whole), len(whole)), 0)

    tvist.reset(start)
    driven = line.drive(start, tvist.filter_all(whole), len(whole))

    def alone() -> None:
        respond(arm, driven, 0)

    motion()  # loads compiled code
    times = np.array([[_seconds(motion), _seconds(alone)] for _ in range(ROUNDS)])
    ratio, interval = mean_and_interval(times[:, 0] / times[:, 1])
    run, plant = 1e6 * np.median(times, axis=0) / len(whole)
    return {
        "run_us_per_tick": float(run),
        "plant_us_per_tick": float(plant),
        "ratio": ratio,
        "interval": interval,
    }


def _seconds(call: Callable[[], None]) -> float:
    began = time.thread_time()
    call()
    return time.thread_time() - began
