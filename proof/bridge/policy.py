"""A policy as learnt ones are: it sees the arm, answers with a chunk of actions, and these are played at 20 Hz.

    python -m proof.bridge.policy ENDPOINT NAME SEED

Its chunks do not quite join, as those of learnt policies do not.
"""

import asyncio
import random
import sys
from collections.abc import Sequence

from proof.bridge.goals import HOME, WAIT_S, goals, trapezoid
from tvist_client import Robot
from tvist_client.servo import Servo

PERIOD = 0.05
"""Time between two actions [s]."""
CHUNK = 8
"""Number of actions that are played of an answer."""
APART = 0.002
"""Standard deviation of where a chunk lies beside the one before [rad]."""


async def main(endpoint: str, name: str, seed: int) -> None:
    """Go where the seed says."""
    draw = random.Random(seed)  # noqa: S311  motions, no secrets
    async with await Robot.connect(endpoint, name) as robot, robot.control("policy") as arm:
        await arm.move_j(HOME)
        await asyncio.sleep(WAIT_S)
        async with arm.servo(period=PERIOD) as servo:
            at = list(HOME)
            for goal in goals(seed):
                actions = list(trapezoid(at, goal, PERIOD))
                for first in range(0, len(actions), CHUNK):
                    beside = [draw.gauss(0.0, APART) for _ in at]
                    await _play(
                        servo,
                        [
                            [a + b for a, b in zip(q, beside, strict=True)]
                            for q in actions[first : first + CHUNK]
                        ],
                    )
                at = goal
                await _play(servo, [goal] * round(WAIT_S / PERIOD))


async def _play(servo: Servo, chunk: Sequence[Sequence[float]]) -> None:
    loop = asyncio.get_running_loop()
    due = loop.time()
    for q in chunk:
        servo.set(q)
        due += PERIOD
        await asyncio.sleep(due - loop.time())


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], sys.argv[2], int(sys.argv[3])))
