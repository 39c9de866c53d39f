"""A whole motion in one go, beside its arm alone in the same loop."""

import time
from collections.abc import Callable

import numpy as np

from proof.bench.figure import Figure, figure, in_alternation
from tvist_controller.api.line import DrivenLine, body, respond
from tvist_lab.in_process import free_setup
from tvist_lab.studies.paper.published import pose
from tvist_lab.study.line import Unchanged, point_to_point
from tvist_plant.flexible_arm import FlexibleArm
from tvist_shaping import TvistFilter, shaper

REPETITIONS = 30


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

    def motion() -> None:
        tvist.reset(start)
        respond(arm, line.drive(start, tvist.filter_all(whole), len(whole)), 0)

    tvist.reset(start)
    driven = line.drive(start, tvist.filter_all(whole), len(whole))

    def alone() -> None:
        respond(arm, driven, 0)

    ticks = len(whole)
    found = in_alternation(
        {"whole": lambda: _us(motion, ticks), "alone": lambda: _us(alone, ticks)}, REPETITIONS
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
