"""Programs as people write them for a UR robot with ur_rtde: nothing in them knows of a bridge.

    python -m proof.bridge.ur_rtde_program KIND ADDRESS SEED

The seed draws where they go. After each motion they wait, since that is when the tool rings.
"""

import os
import random
import sys
import time
from collections.abc import Callable

from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

from proof.bridge.goals import ACCELERATION, HOME, SPEED, WAIT_S, goals, trapezoid


def move_j(address: str, seed: int) -> None:
    """Move joints."""
    control = RTDEControlInterface(address)
    for q in (list(HOME), *goals(seed)):
        _well(control.moveJ(q, SPEED, ACCELERATION))
        time.sleep(WAIT_S)
    control.stopScript()


def move_l(address: str, seed: int) -> None:
    """Move the tool along lines from the pose at `HOME`."""
    control, receive = RTDEControlInterface(address), RTDEReceiveInterface(address)
    _well(control.moveJ(list(HOME), SPEED, ACCELERATION))
    time.sleep(WAIT_S)
    draw, home = random.Random(seed), receive.getTargetTCPPose()  # noqa: S311
    for number in range(3):
        pose = list(home)
        if number % 2 == 0:
            pose[:3] = [x + draw.choice((-1, 1)) * draw.uniform(0.06, 0.12) for x in home[:3]]
        _well(control.moveL(pose, 0.5, 2.0))
        time.sleep(WAIT_S)
    control.stopScript()


def servo_j(frequency: float, lookahead: float, gain: float) -> Callable[[str, int], None]:
    """Return what streams trapezoidal motions of joints."""

    def run(address: str, seed: int) -> None:
        control = RTDEControlInterface(address, frequency)
        _well(control.moveJ(list(HOME), SPEED, ACCELERATION))
        time.sleep(WAIT_S)
        at, period = list(HOME), 1.0 / frequency
        for goal in goals(seed):
            rest = [goal] * round(WAIT_S * frequency)
            for q in (*trapezoid(at, goal, period), *rest):
                begun = control.initPeriod()
                _well(control.servoJ(q, 0.0, 0.0, period, lookahead, gain))
                control.waitPeriod(begun)
            at = goal
        control.servoStop()
        control.stopScript()

    return run


def _well(done: bool) -> None:
    if not done:
        sys.exit("the robot did not do what it was told")


KINDS = {
    "moveJ": move_j,
    "moveL": move_l,
    "servoJ-500": servo_j(500.0, 0.03, 2000.0),
    "servoJ-125": servo_j(125.0, 0.03, 2000.0),
}

if __name__ == "__main__":
    KINDS[sys.argv[1]](sys.argv[2], int(sys.argv[3]))
    sys.stdout.flush()
    os._exit(0)  # its threads may wait for each other
