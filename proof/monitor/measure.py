"""Everyday motions of hidden robots that change after a while, and when they say so."""

from dataclasses import dataclass

import numpy as np

from proof.monitor.changing_arm import Change, ChangingArm
from tvist_controller.api.line import Setup, body, load_calibration, paper_payload
from tvist_controller.api.robot import Controller
from tvist_lab.workspace import WORKSPACE
from tvist_plant.description import load
from tvist_protocol.commands import MoveJ, TakeControl
from tvist_protocol.replies import Accepted

DEBUG=0
BASE = 1.5e5
"""Stiffness of a base that yields [N m/rad], as that of the plant `base`."""
CHANGES = {
    "payload": Change("payload changed by 2 kg", mass=2.0),
    "springs": Change("gears and links 30 % softer", springs=0.7),
    "base": Change("base of 150 kN m/rad 30 % softer", base=0.7),
    "nothing": None,
}
"""What becomes of the arm."""
BEFORE, WITHIN = 20, 3
"""Number of motions before the change, and of those after it in which it should be noticed."""
SPEEDS = ((0.6, 1.0, 50.0), (1.05, 1.4, 100.0), (1.5, 2.0, 100.0), (1.5, 3.0, 200.0))
"""Velocity, acceleration and jerk of the motions [rad/s, rad/s², rad/s³]."""
REST = (150, 400)
"""Shortest and longest rest between two motions, in ticks."""
PAYLOADS = (0.5, 3.0)
"""Smallest and largest declared payload [kg]."""


@dataclass(frozen=True)
class Outcome:
    """What one robot said."""

    alarms: int
    """Warnings before anything had changed."""
    motions: int
    """Motions until then."""
    noticed: int | None
    """Number of motions after the change with which the first warning came; None if there was none in time."""


def outcome(robot: str, change: str, shaper: str, seed: int) -> Outcome:
    """Let a hidden robot make random motions, and change it after `BEFORE` of them."""
    description, random = load(robot), np.random.default_rng([seed, 73])
    mass = float(random.uniform(*PAYLOADS))
    payload = paper_payload(description, mass)
    arm = ChangingArm(description, body(payload), seed, BASE if change == "base" else None)
    setup = Setup(
        description=description, q=description.poses["Q1"], payload=payload, calibration=load_calibration(f"{robot}_modal"),
        shaper=shaper, clock="free", seed=seed,
    )  # fmt: skip
    controller = Controller(setup, arm)
    reply = controller.receive(TakeControl(client="proof"))
    assert isinstance(reply, Accepted)
    told = 0

    def ticks(number: int) -> None:
        nonlocal told
        for _ in range(number):
            _, events = controller.tick()
            told += sum(event.kind == "warning" for event in events)
            if DEBUG: [print('    ',event.tick,event.why[:90]) for event in events if event.kind=='warning']

    def move() -> None:
        while True:
            here = np.array(controller.latest.reference_q)
            away = random.uniform([*WORKSPACE.low, -2.0, -2.0], [*WORKSPACE.high, 2.0, 2.0]) - here
            target = here + random.uniform(0.3, 1.0) * away
            velocity, acceleration, jerk = SPEEDS[random.integers(len(SPEEDS))]
            asked = MoveJ(
                token=reply.token or "", q=tuple(target.tolist()), velocity=velocity,
                acceleration=acceleration, jerk=jerk,
            )  # fmt: skip
            if isinstance(controller.receive(asked), Accepted):
                break
        ticks(1)
        while not controller.cycle.mode.at_rest:
            ticks(1)
        ticks(int(random.integers(*REST)))

    for _ in range(BEFORE):
        move()
    alarms = told
    becomes = CHANGES[change]
    if becomes is None:
        return Outcome(alarms, BEFORE, None)
    arm.change(becomes if random.random() < 0.5 or change != "payload" or mass < 2.2 else Change(becomes.name, -2.0))
    for number in range(1, WITHIN + 1):
        move()
        if told > alarms:
            return Outcome(alarms, BEFORE, number)
    return Outcome(alarms, BEFORE, None)
