"""The parts of a served tick in a process that does nothing else: the least that the whole can cost at 500 Hz.

    python -m proof.bench.bare_tick ENDPOINT

A line on stdout says that it listens there. Each further line on stdin, `paced_line SECONDS` or `bare_put SECONDS`, has
it compute the line, or publish the bytes of a state, once every 2 ms for so long; a line on stdout then gives the
processor time of all its threads for each tick [µs]. It ends when stdin does.
"""

import gc
import sys
import time
from collections.abc import Callable

from tvist_controller.api.robot import Host, LoopbackHost
from tvist_lab.in_process import free_setup
from tvist_plant.plant import PERIOD
from tvist_protocol import keys
from tvist_server.gateways.network import REALTIME, open_router

ROBOT = "bare"
"""Name of the robot of whose states it publishes the bytes."""


def segment(part: Callable[[], object], seconds: float) -> float:
    """Do a part of a tick at every deadline; return the processor time for each [µs]."""
    ticks, began = round(seconds / PERIOD), time.process_time()
    due = time.monotonic()
    for _ in range(ticks):
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
        part()
    return 1e6 * (time.process_time() - began) / ticks


def main(endpoint: str) -> None:
    """Measure a segment for each line that comes."""
    session = open_router([endpoint], [], REALTIME, None)
    publisher = session.declare_publisher(keys.state(ROBOT))
    robot, states = LoopbackHost(free_setup(truth=False, shaper="zv")), list[bytes]()
    robot.subscribe("state", states.append)()
    robot.subscribe("state", len)
    host = Host(robot.controller, robot)
    parts: dict[str, Callable[[], object]] = {
        "paced_line": host.tick,
        "bare_put": lambda: publisher.put(states[0]),
    }
    for part in parts.values():
        segment(part, 1.0)
    gc.collect()
    gc.freeze()
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    for line in sys.stdin:
        name, seconds = line.split()
        sys.stdout.write(f"{segment(parts[name], float(seconds))}\n")
        sys.stdout.flush()
    session.close()  # type: ignore[no-untyped-call]


if __name__ == "__main__":
    main(sys.argv[1])
