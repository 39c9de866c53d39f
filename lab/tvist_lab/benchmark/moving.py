"""A robot in this process whose arm moves while it is measured, and the same arm in MuJoCo."""

import gc
import math
import time
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

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
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.commands import Command, MoveJ, ServoStart, TakeControl
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationReset, SimulationStep, StepSetpoint
from tvist_shaping import TvistFilter, shaper

TICKS = 500
"""Number of ticks of a run: the first second of the motion from Q1 to Q3, which lasts longer with every filter."""
MUJOCO_STEP = 0.00025
"""Step at which MuJoCo agrees with our plant [s]."""
SWING = 0.2
"""Amplitude of the streamed sine [rad]."""
LIMITS = MotionLimits(1.5, 2.0, 100.0)

Floats = NDArray[np.float64]


class MovingRobot:
    """A robot in process: the whole line, from messages to encoded states.

    Args:
        host: The robot.
    """

    def __init__(self, host: LoopbackHost) -> None:
        self._host = host
        host.subscribe("state", len)
        host.request("bench", encode(TakeControl(client="bench")))
        lease = host.controller.session.lease
        self._token = lease.token if lease else ""

    @classmethod
    def with_shaper(cls, shaper: str) -> Self:
        """Return a robot with a filter, given by its name."""
        return cls(LoopbackHost(free_setup(truth=False, shaper=shaper)))

    def begin(self) -> None:
        """Put the arm at Q1, and begin the motion to Q3."""
        self._send(SimulationReset(token=self._token, q=pose("Q1")))
        self._send(MoveJ(token=self._token, q=pose("Q3")))

    def go(self) -> None:
        """Compute the ticks of a run."""
        self._send(SimulationStep(token=self._token, ticks=TICKS))

    def us_per_tick(self) -> float:
        """Processor time of a tick in a run [µs]."""
        self.begin()
        return _us_per_tick(self.go)

    def _send(self, command: Command) -> None:
        reply = decode_reply(self._host.request("bench", encode(command)))
        assert not isinstance(reply, Refused), reply.why


class StreamingRobot(MovingRobot):
    """A robot in process that follows a stream of set-points: a sine of the first joint, about Q1."""

    def begin(self) -> None:
        """Put the arm at Q1, and begin the stream."""
        self._send(SimulationReset(token=self._token, q=pose("Q1")))
        self._send(ServoStart(token=self._token))
        first, *others = pose("Q1")
        swing = (SWING * math.sin(math.pi * number / TICKS) ** 2 for number in range(TICKS))
        setpoints = tuple(
            StepSetpoint(sequence=number, q=(first + angle, *others)) for number, angle in enumerate(swing)
        )
        self._step = SimulationStep(token=self._token, ticks=TICKS, setpoints=setpoints)

    def go(self) -> None:
        """Compute the ticks of a run."""
        self._send(self._step)


def mujoco_tick() -> Callable[[], float]:
    """Return what measures the processor time of a tick of the same arm in MuJoCo [µs]."""
    setup = free_setup(truth=False)
    return arm_tick(SecondOpinion(setup.description, body(setup.payload), MUJOCO_STEP))


def plant_tick() -> Callable[[], float]:
    """Return what measures the processor time of a tick of our plant [µs]."""
    setup = free_setup(truth=False)
    return arm_tick(FlexibleArm(setup.description, body(setup.payload)))


def arm_tick(arm: Plant | SecondOpinion) -> Callable[[], float]:
    """Return what measures the processor time of a tick of an arm that makes the motion [µs]."""
    setup = free_setup(truth=False)
    dynamics = InverseDynamics(setup.description, body(setup.payload))
    commands = [DriveCommand(q, np.zeros_like(q), dynamics.gravity(q)) for q in _motion()]

    def go() -> None:
        for command in commands:
            arm.step(command)

    def run() -> float:
        arm.reset(commands[0])
        return _us_per_tick(go)

    return run


def filter_tick() -> Callable[[], float]:
    """Return what measures the processor time of a tick of the filter with its estimator [µs]."""
    tvist, motion = _filter(free_setup(truth=False)), _motion()

    def go() -> None:
        for q in motion:
            tvist.filter(q)

    def run() -> float:
        tvist.reset(motion[0])
        return _us_per_tick(go)

    return run


def cycle_tick() -> Callable[[], float]:
    """Return what measures the processor time of a tick of Figure 6, without what is around it [µs]."""
    setup = free_setup(truth=False)
    payload, start, target = body(setup.payload), np.array(pose("Q1")), np.array(pose("Q3"))
    cycle = ControlCycle(
        setup.description, _filter(setup), q=start, declared=payload, carried=payload, seed=0
    )

    def go() -> None:
        for _ in range(TICKS):
            cycle.step()

    def run() -> float:
        cycle.reset(start)
        cycle.start(cycle.plan(target, LIMITS))
        return _us_per_tick(go)

    return run


def _filter(setup: Setup) -> TvistFilter:
    return TvistFilter(shaper(setup.shaper), setup.estimator(), joints=setup.description.joints)


def _motion() -> list[Floats]:
    """References of a run, each of shape (n,) [rad]."""
    trajectory = quickest_motion(JointLine(np.array(pose("Q1")), np.array(pose("Q3"))), LIMITS, PERIOD)
    return [trajectory.next() for _ in range(TICKS)]


def _us_per_tick(go: Callable[[], Any]) -> float:
    gc.collect()
    began = time.thread_time()
    go()
    return 1e6 * (time.thread_time() - began) / TICKS
