"""Count the objects that a set-point and a `move_j` cross in the controller: `python -m tools.crossings [--list]`.

An object is a class of the product of which a method runs while a robot is stepped. Compiled kernels do not
count.
"""

import math
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

from tvist_controller.loopback import LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_protocol import commands as c
from tvist_protocol.codec import Message, decode_reply, encode
from tvist_protocol.simulation import SimulationStep

ROOMS = ("tvist_controller", "tvist_plant", "tvist_shaping", "tvist_protocol")
Q = (0.0, -3.1, 0.0, -1.57, 0.0, 0.0)


class Hand:
    """A client in control of a UR5e in lockstep."""

    def __init__(self) -> None:
        self.host = LoopbackHost(free_setup(clock="lockstep", start="Q1", shaper="auto"))
        self.token = self.do(c.TakeControl(client="crossings")).token

    def do(self, command: Message) -> Any:
        """Send a command, and return the reply."""
        reply = decode_reply(self.host.request("crossings", encode(command)))
        assert reply.__class__.__name__ != "Refused", reply
        return reply

    def step(self, ticks: int) -> None:
        """Advance time."""
        self.do(SimulationStep(token=self.token, ticks=ticks))


def crossed(run: Callable[[], object]) -> set[str]:
    """Return the classes of the controller, plant and shapers whose methods a call runs."""
    found = set()

    def note(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_varnames[:1] == ("self",):
            kind = type(frame.f_locals["self"])
            if kind.__module__.startswith(ROOMS):
                found.add(f"{kind.__module__}.{kind.__qualname__}")

    sys.setprofile(note)
    try:
        run()
    finally:
        sys.setprofile(None)
    return found


def of_set_point() -> set[str]:
    """Return what one set-point crosses in the middle of a stream at 500 Hz."""
    hand = Hand()
    hand.do(c.ServoStart(token=hand.token))

    def send(number: int) -> None:
        angle = Q[1] + 0.1 * (1.0 - math.cos(0.002 * number))
        setpoint = c.Setpoint(token=hand.token, sequence=number, q=(Q[0], angle, *Q[2:]))
        hand.host.put_setpoint("crossings", encode(setpoint))
        hand.step(1)

    for number in range(500):
        send(number)
    return crossed(lambda: send(500))


def of_move() -> set[str]:
    """Return what one `move_j` crosses, from the command to rest."""
    hand = Hand()
    move = c.MoveJ(token=hand.token, q=(Q[0], Q[1] + 0.1, *Q[2:]))

    def send() -> None:
        hand.do(move)
        hand.step(1000)

    return crossed(send)


def main() -> None:
    """Print the numbers and, with `--list`, the classes."""
    for name, found in (("set-point", of_set_point()), ("move_j", of_move())):
        print(f"{name}: {len(found)}")
        if "--list" in sys.argv:
            print(*sorted(found), sep="\n")


if __name__ == "__main__":
    main()
