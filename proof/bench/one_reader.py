"""What a robot costs whose states one client reads, beside its line, and beside the least that each part can cost."""

from collections.abc import Callable

from proof.bench.bare_tick import ROBOT
from proof.bench.figure import Figure, figure
from proof.bench.readers import helper, readers
from tvist_lab.bench.moving import line_tick
from tvist_lab.bench.one_robot import punctuality
from tvist_lab.served import free_endpoint, served
from tvist_plant.plant import PERIOD

ROUNDS = 7
"""Number of rounds of measurements."""
SHORTEST = 2.0
"""Shortest time of a measurement [s]: telemetry comes once a second."""
OF_LINE = 3
"""Number of measurements of the line in a round, of which the least counts: other load only adds to it."""
SAID = {
    "one_robot": "a served robot that one client reads",
    "paced_line": "the line alone, once every 2 ms",
    "bare_put": "a bare put() of a state to one client, once every 2 ms",
}
"""Name of each measurement in the table, besides the line in process."""


async def one_reader(seconds: float, tell: Callable[[str], None]) -> dict[str, Figure]:
    """Measure a robot whose client reads each state, and in a process of their own the line, and puts of as many bytes.

    Args:
        seconds: Duration of each measurement [s].
        tell: Called with a description of each measurement before it starts.
    """
    part, endpoint, in_process = max(SHORTEST, seconds / ROUNDS), free_endpoint(), line_tick("zv")
    in_process()
    found: dict[str, list[float]] = {name: [] for name in SAID}
    lines: list[float] = []
    async with served([]) as server, helper("bare_tick", endpoint) as bare:
        assert bare.stdin is not None
        assert bare.stdout is not None
        await bare.stdout.readline()
        await server.robot.state()  # its client reads from now on
        for number in range(ROUNDS):
            tell(f"round {number + 1} of {ROUNDS}: a robot that one client reads, its line, and bare puts")
            lines.append(min(in_process() for _ in range(OF_LINE)))
            found["one_robot"].append(1e6 * PERIOD * (await punctuality(server, part))[1])
            for name in ("paced_line", "bare_put"):
                async with readers("observers", endpoint, ROBOT, "1"):
                    bare.stdin.write(f"{name} {part:g}\n".encode())
                    found[name].append(float(await bare.stdout.readline()))
    return {
        f"{name}_us_per_tick": figure(SAID[name], "µs per tick", taken, "the line in process", lines)
        for name, taken in found.items()
    }
