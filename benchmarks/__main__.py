"""`python -m benchmarks`: measure speed, each figure with a reference from the same run; see README.md."""

import argparse
import asyncio
import os
import sys
from collections.abc import Callable, Coroutine, Mapping, Sequence
from typing import Any

import msgspec
from tools.tables.markdown import markdown_table

from benchmarks.figure import Figure, Tell
from benchmarks.lateness import lateness
from benchmarks.line import line, streams
from benchmarks.programs import programs
from benchmarks.served import bridge, reader, robots, rtde
from benchmarks.start import start
from tvist_lab.bench.served_robots import one_robot
from tvist_lab.bench.speed import this_machine
from tvist_server.shutdown import end_like_interrupted

COMPUTED: Mapping[str, Callable[[Tell], dict[str, Figure]]] = {
    "line": line, "streams": streams, "programs": programs,
}  # fmt: skip
"""Parts that serve no robot."""
SERVED: Mapping[str, Callable[[float, Tell], Coroutine[Any, Any, dict[str, Any]]]] = {
    "served": one_robot, "robots": robots, "reader": reader, "rtde": rtde, "lateness": lateness, "bridge": bridge,
}  # fmt: skip
"""Parts that serve robots in real time, besides `start`."""
PARTS = (*COMPUTED, "start", *SERVED)
HEADS = ("figure", "value", "unit", "reference", "value", "ratio", "95 %", "n")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the measurements that the arguments select, and print the results."""
    # Matrices here are small, so threads would only slow each other down.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "--only", nargs="+", metavar="PART", choices=PARTS, help=f"Run these parts: {' '.join(PARTS)} [all]."
    )
    parser.add_argument(
        "--seconds",
        type=float,
        default=10.0,
        help="Measure for this long in real time [s]; 0 skips the parts that serve robots [10].",
    )
    parser.add_argument("--json", action="store_true", help="Print one JSON object.")
    given = parser.parse_args(arguments)
    if not 0.0 <= given.seconds <= 86_400.0:
        parser.error(f"--seconds is {given.seconds:g}: must be 0 to 86400")
    result = measure(
        given.seconds, lambda what: print(what, file=sys.stderr, flush=True), given.only or PARTS
    )
    if given.json:
        print(msgspec.json.encode(result).decode())
    else:
        show(result)


def measure(seconds: float, tell: Tell, only: Sequence[str]) -> dict[str, Any]:
    """Run some parts; those that serve robots take this many seconds each."""
    found: dict[str, Any] = {}
    machine = this_machine()
    for name in only:
        if name in COMPUTED:
            found |= COMPUTED[name](tell)
        elif seconds > 0.0:
            found |= start(tell) if name == "start" else asyncio.run(SERVED[name](seconds, tell))
    figures = {key: one for key, one in found.items() if isinstance(one, Figure)}
    values = {key: figures[key].value if key in figures else one for key, one in found.items()}
    return {"seconds": seconds, "machine": machine, "figures": msgspec.to_builtins(figures), **values}


def show(result: dict[str, Any]) -> None:
    """Print the figures with references as a table, then the others."""
    figures = result["figures"]
    others = {key: value for key, value in result.items() if key not in {*figures, "figures"}}
    print(markdown_table(HEADS, [_row(one) for one in figures.values()]), end="\n\n")
    print(msgspec.json.format(msgspec.json.encode(others), indent=2).decode())


def _row(one: dict[str, Any]) -> list[str]:
    ratio, low, high = one["compared"], one["low"], one["high"]
    return [
        one["what"], f"{one['value']:.4g}", one["unit"], one["reference"], f"{one['reference_value']:.4g}",
        "–" if ratio is None else f"{ratio:.3g}", "" if low is None else f"{low:.3g} to {high:.3g}",
        str(one["repetitions"]),
    ]  # fmt: skip


if __name__ == "__main__":
    end_like_interrupted()
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(130)
