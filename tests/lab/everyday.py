"""Everyday motions of hidden robots, and how these robots ring where nobody has listened."""

from dataclasses import dataclass, replace

import numpy as np

from tvist_controller.api.line import body, paper_payload
from tvist_lab.collect import collect
from tvist_lab.identification.ring_downs import Log
from tvist_lab.in_process import free_setup, robot_in_process
from tvist_lab.metrics import RingDown, fit_ring_down, tool_acceleration
from tvist_lab.recordings import Floats
from tvist_lab.study.line import RESTING, ControlLine, point_to_point
from tvist_plant.description import load
from tvist_plant.modes import Modes
from tvist_plant.plant import PERIOD
from tvist_plant.variants import hidden_variant
from tvist_protocol.errors import RefusedError
from tvist_protocol.values import Payload

SHARES = ((0.0, 6), (0.5, 7), (0.9, 7))
"""Carried masses over the rated payload, and the number of motions with each."""
WRIST = np.pi
"""Largest angle of the wrist's two outer joints [rad]."""
LINE = 0.25
"""Largest way of a straight line along each axis [m]."""
SKIPPED = 0.014
"""Time after a stop that is left out of a ring-down [s]."""


def anywhere(random):
    """Return a posture as programs use them, shape (6,) [rad]."""
    low = (-np.pi, -np.pi, -2.6, -np.pi, -WRIST, -WRIST)
    high = (np.pi, 0.0, 2.6, 0.0, WRIST, WRIST)
    return random.uniform(low, high)


async def everyday_logs(robot, hidden, seed):
    """Record twenty motions as a user's program makes them: two of three by the joints, the third on a line.

    Only what a robot publishes is recorded; the robot is unshaped, and rests for 0.3 to 1.2 s after each motion.
    """
    rated = load(robot).limits.payload
    return [
        await _log(robot, hidden, share * rated, count, seed * 10 + number)
        for number, (share, count) in enumerate(SHARES)
    ]


async def _log(robot, hidden, mass, count, seed):
    setup = free_setup(
        robot=robot, payload=mass, hidden=hidden, truth=False, shaper="none", calibration="none", seed=seed
    )
    random = np.random.default_rng([seed, hidden])
    async with robot_in_process(setup) as client, client.control("everyday") as arm:
        info = await client.info()
        with collect(client) as collected:
            await client.advance(100)
            made = 0
            while made < count:
                try:
                    if made % 3 == 2:
                        x, y, z, *turn = await client.forward_kinematics()
                        goal = [*(np.array([x, y, z]) + random.uniform(-LINE, LINE, 3)).tolist(), *turn]
                        await arm.move_l(
                            goal, velocity=random.uniform(0.2, 0.5), acceleration=random.uniform(0.8, 1.5)
                        )
                    else:
                        here = np.array((await client.state()).target_q)
                        q = here + random.uniform(0.2, 0.8) * (anywhere(random) - here)
                        await arm.move_j(
                            q, velocity=random.uniform(0.8, 1.6), acceleration=random.uniform(1.4, 2.5)
                        )
                except (
                    RefusedError
                ):  # out of reach, or something in the way: a program would have another pose
                    continue
                made += 1
                await client.advance(round(random.uniform(0.3, 1.2) / PERIOD))
    return Log(f"{mass:g} kg", replace(collected.recording(), info=info))


@dataclass(frozen=True)
class Unseen:
    """A posture, what the robot was said to carry, and how it truly rings there."""

    q: Floats
    declared: Payload
    ring: RingDown
    """Modes of the noiseless acceleration after an unshaped move to it."""
    linear: Modes
    """Modes of the arm linearised at rest, in which gears have no hysteresis."""


def unseen(description, hidden, count, seed):
    """Return postures with the declared payloads in turn, where the robot rings loud enough to be judged."""
    random = np.random.default_rng([seed, 71])
    found = 0
    while found < count:
        declared = paper_payload(description, SHARES[found % len(SHARES)][0] * description.limits.payload)
        q = anywhere(random)
        start = q + random.uniform(-0.6, 0.6, len(q))
        arm = hidden_variant(hidden).make(description, body(declared), 0)
        reference = point_to_point(start, q)
        made = ControlLine(description, start, body(declared)).follow(reference, reference).simulate(arm, 0)
        alpha = tool_acceleration(made, truth=True)[RESTING + len(reference) + 1 :]
        ring = fit_ring_down(alpha, PERIOD, modes=2, slow_poles=(17.5, 6.0), offset=True, skip=SKIPPED)
        if ring.ok:
            found += 1
            yield Unseen(q, declared, ring, arm.modes(q))  # type: ignore[attr-defined]  # a flexible arm
