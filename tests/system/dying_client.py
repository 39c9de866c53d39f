"""A client that takes control, moves or streams, and goes on until it is killed.

python dying_client.py ENDPOINT move|stream [announced] [lease_s=SECONDS] [amplitude=RADIANS] [rate=RADIANS/SECOND]
"""

import math
import sys
import threading
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.conformance.wire import Q1, Wire


def main(endpoint, what, *options):
    given = dict(option.split("=") for option in options if "=" in option)
    usual = {"lease_s": 30.0, "amplitude": 0.1, "rate": 1.0}
    lease_s, amplitude, rate = (float(given.get(name, value)) for name, value in usual.items())
    with Wire(endpoint) as wire:
        if "announced" in options:
            wire.announce("dying")
        token = wire.command("take_control", client="dying", lease_s=lease_s)["token"]
        wire.listen("state")
        if what == "move":
            assert wire.command("move_j", token=token, q=[2.0, *Q1[1:]], velocity=0.6)["type"] == "accepted"
        else:
            answer = wire.command("servo_start", token=token, period=0.008)
            assert answer == {"type": "done"}, answer
        print("under way", flush=True)  # noqa: T201  the test waits for that
        if what == "move":
            threading.Event().wait()
        tick = wire.state()["tick"]
        for sequence in range(100_000):  # a set-point every 8 ms of the robot's time
            tick = wire.until(tick + 4)["tick"]
            offset = amplitude * (1.0 - math.cos(0.008 * rate * sequence))
            wire.setpoint(token=token, sequence=sequence, q=[offset, *Q1[1:]])


main(*sys.argv[1:])
