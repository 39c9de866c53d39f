"""Processor time of a robot's tick in this process, and of its parts, while the arm moves."""

import gc
import time
from collections.abc import Callable
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tvist_controller.api.line import (
    ControlCycle,
    InverseDynamics,
    JointLine,
    MotionLimits,
    Setup,
    body,
    quickest_motion,
)
from tvist_controller.api.robot import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_lab.studies.paper.published import pose
from tvist_plant.drives import DriveCommand
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD, SimulatedArm
from tvist_protocol.codec import decode_reply, encode
from tvist_protocol.commands import Command, MoveJ, ServoStart, Setpoint, TakeControl
from tvist_protocol.replies import Refused
from tvist_protocol.simulation import SimulationReset, SimulationStep
from tvist_shaping import TvistFilter, shaper

TICKS = 500  # ticks of a run: the first second of the motion from Q1 to Q3
LIMITS = MotionLimits(1.5, 2.0, 100.0)

Floats = NDArray[np.float64]
Run = Callable[[], float]  # makes one run and returns its result, here the processor time of a tick [µs]


def line_tick(shaper: str) -> Run:
    """Measure a tick of the whole line with a shaper, from messages to encoded states."""
    host, token, send = _robot(shaper)
    host.subscribe("state", len)

    def run() -> float:
        send(SimulationReset(token=token, q=pose("Q1")))
        send(MoveJ(token=token, q=pose("Q3")))
        return us_per_tick(lambda: send(SimulationStep(token=token, ticks=TICKS)))

    return run


def stream_tick(every: int) -> Run:
    """Measure a tick of the line with `zv`, fed with one set-point every `every` ticks."""
    host, token, send = _robot("zv")
    setpoints = [
        encode(Setpoint(token=token, sequence=number, q=tuple(q.tolist())))
        for number, q in enumerate(motion()[::every])
    ]
    states = count()

    def answer(_: bytes) -> None:
        number, between = divmod(next(states), every)
        if between == 0 and number < len(setpoints):
            host.put_setpoint("bench", setpoints[number])

    host.subscribe("state", answer)

    def run() -> float:
        nonlocal states
        send(SimulationReset(token=token, q=pose("Q1")))
        send(ServoStart(token=token, period=every * PERIOD))
        states = count()
        return us_per_tick(lambda: send(SimulationStep(token=token, ticks=TICKS)))

    return run


def _robot(shaper: str) -> tuple[LoopbackHost, str, Callable[[Command], None]]:
    """Return a robot, the token of a client in control, and a function that sends its commands."""
    host = LoopbackHost(free_setup(truth=False, shaper=shaper))
    host.request("bench", encode(TakeControl(client="bench")))
    lease = host.controller.session.lease

    def send(command: Command) -> None:
        reply = decode_reply(host.request("bench", encode(command)))
        assert not isinstance(reply, Refused), reply.why

    return host, lease.token if lease else "", send


def plant_tick() -> Run:
    """Measure a tick of the simulated arm."""
    setup = free_setup(truth=False)
    return arm_tick(FlexibleArm(setup.description, body(setup.payload)))


def arm_tick(arm: SimulatedArm) -> Run:
    """Measure a tick of an arm while it makes the motion from Q1 to Q3."""
    setup = free_setup(truth=False)
    dynamics = InverseDynamics(setup.description, body(setup.payload))
    commands = [DriveCommand(q, np.zeros_like(q), dynamics.gravity(q)) for q in motion()]

    def go() -> None:
        for command in commands:
            arm.step(command)

    def run() -> float:
        arm.reset(commands[0])
        return us_per_tick(go)

    return run


def cycle_tick() -> Run:
    """Measure a tick of the control cycle (Figure 6) with `zv`, without messages and encoding."""
    setup = free_setup(truth=False)
    payload, start, target = body(setup.payload), np.array(pose("Q1")), np.array(pose("Q3"))
    cycle = ControlCycle(
        setup.description, line_filter(setup), q=start, declared=payload, carried=payload, seed=0
    )

    def go() -> None:
        for _ in range(TICKS):
            cycle.step()

    def run() -> float:
        cycle.reset(start)
        cycle.begin(quickest_motion(JointLine(start, target), LIMITS))
        return us_per_tick(go)

    return run


def line_filter(setup: Setup) -> TvistFilter:
    """Return a setup's filter with its estimator."""
    return TvistFilter(shaper(setup.shaper), setup.estimator(), joints=setup.description.joints)


def motion() -> list[Floats]:
    """Return the references of a run, each of shape (n,) [rad]."""
    trajectory = quickest_motion(JointLine(np.array(pose("Q1")), np.array(pose("Q3"))), LIMITS)
    return [trajectory.next() for _ in range(TICKS)]


def us_per_tick(go: Callable[[], Any]) -> float:
    """Return the processor time of one tick of a run [µs]."""
    gc.collect()
    began = time.thread_time()
    go()
    return 1e6 * (time.thread_time() - began) / TICKS
