"""Processing time of each part of the control line, in this process on one core."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from tvist_controller.api import (
    ControlCycle,
    InverseDynamics,
    JointLine,
    LoopbackHost,
    MotionLimits,
    Setup,
    body,
    quickest_motion,
)
from tvist_lab.in_process import free_setup
from tvist_lab.paper.published import pose
from tvist_lab.second_opinion import SecondOpinion
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, Plant
from tvist_protocol.codec import encode
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.simulation import SimulationReset, SimulationStep
from tvist_shaping import TvistFilter, shaper

TICKS = 1250
"""Number of ticks of a motion: Q1 to Q3 without its very end."""
BATCHES = 5
"""Number of repetitions, of which the fastest counts, since other load on the machine only ever adds time."""
MUJOCO_STEP = 0.00025
"""Step at which MuJoCo agrees with our plant [s]."""


def parts(tell: Callable[[str], None]) -> dict[str, float]:
    """Return the time per tick of each part and of the line [us], and the speed relative to MuJoCo and real time.

    Args:
        tell: Called with a description of each measurement before it starts.
    """
    setup = free_setup(truth=False)
    motion, payload = _motion(setup), body(setup.payload)
    commands = _commands(setup, motion)
    tell("the plant")
    plant = _arm(FlexibleArm(setup.description, payload), commands)
    tell("MuJoCo")
    mujoco = _arm(SecondOpinion(setup.description, payload, MUJOCO_STEP), commands[:300])
    tell("filter, cycle and line")
    filtering, cycle, line = _filter(setup, motion), _cycle(setup), _line(setup)
    return {
        "plant_us_per_tick": plant,
        "mujoco_us_per_tick": mujoco,
        "plant_ratio": mujoco / plant,
        "filter_us_per_tick": filtering,
        "cycle_us_per_tick": cycle,
        "line_us_per_tick": line,
        "realtime_factor": PERIOD * 1e6 / line,
    }


def _motion(setup: Setup) -> list[np.ndarray[Any, Any]]:
    trajectory = quickest_motion(
        JointLine(np.array(pose("Q1")), np.array(pose("Q3"))), MotionLimits(1.5, 2.0, 100.0), PERIOD
    )
    return [np.array(setup.q), *(trajectory.next() for _ in range(TICKS))]


def _fastest(batch: Callable[[], int]) -> float:
    """Return the time of one item of a batch [us], which returns its number of items."""
    best = float("inf")
    for _ in range(BATCHES):
        began = time.perf_counter()
        count = batch()
        best = min(best, (time.perf_counter() - began) / count)
    return best * 1e6


def _commands(setup: Setup, motion: list[np.ndarray[Any, Any]]) -> list[DriveCommand]:
    dynamics = InverseDynamics(setup.description, body(setup.payload))
    return [DriveCommand(q, np.zeros_like(q), dynamics.gravity(q)) for q in motion]


def _arm(arm: Plant | SecondOpinion, commands: list[DriveCommand]) -> float:
    def batch() -> int:
        arm.reset(commands[0])
        for command in commands:
            arm.step(command)
        return len(commands)

    return _fastest(batch)


def _filter(setup: Setup, motion: list[np.ndarray[Any, Any]]) -> float:
    tvist = TvistFilter(shaper(setup.shaper), setup.estimator(), joints=setup.description.joints)

    def batch() -> int:
        tvist.reset(motion[0])
        for q in motion:
            tvist.filter(q)
        return len(motion)

    return _fastest(batch)


def _cycle(setup: Setup) -> float:
    tvist = TvistFilter(shaper(setup.shaper), setup.estimator(), joints=setup.description.joints)
    payload = body(setup.payload)
    start, target = np.array(pose("Q1")), np.array(pose("Q3"))
    cycle = ControlCycle(setup.description, tvist, q=start, declared=payload, carried=payload, seed=0)

    def batch() -> int:
        cycle.reset(start)
        cycle.start(cycle.plan(target, MotionLimits(1.5, 2.0, 100.0)))
        for _ in range(TICKS):
            cycle.step()
        return TICKS

    return _fastest(batch)


def _line(setup: Setup) -> float:
    """Time per tick of the whole server in process, from incoming messages to encoded states [us]."""
    host = LoopbackHost(setup)
    host.subscribe("state", len)
    host.request("bench", encode(TakeControl(client="bench")))
    token = host.controller.session.lease.token if host.controller.session.lease else ""

    def batch() -> int:
        host.request("bench", encode(SimulationReset(token=token, q=pose("Q1"))))
        host.request("bench", encode(MoveJ(token=token, q=pose("Q3"))))
        host.request("bench", encode(SimulationStep(token=token, ticks=1000)))
        return 1000

    return _fastest(batch)
