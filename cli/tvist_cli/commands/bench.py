"""`tvist bench`: how fast this machine computes a robot, how many it can run, and how late their ticks are."""

from typing import Annotated, Any

from tvist_cli.failure import check_range, failing_on, interruptible
from tvist_cli.offered import SHAPERS
from tvist_cli.output import err, out, print_json, table, words

TERMS = {
    "late": "how much later than planned ticks began: half of them, all but one in a hundred, and the worst",
    "set-point, command": "time until the first state with it has come back, until it is answered",
    "robots": "at 500 Hz in one process on one core, of which none misses more than one tick in a thousand",
}


def bench(*, seconds: float = 10.0, shaper: Annotated[str, SHAPERS] = "zv", json: bool = False) -> None:
    """Measure how many robots this machine runs in real time, how late their ticks are, and how fast one computes.

    The figures hold for the machine's present load. A recorder and a client that reads every state are
    attached to a single served robot; for several robots, a client on another core reads every state.

    Args:
        seconds: Measure each served robot for this many seconds; 0 serves none and measures only the computation.
        shaper: Give the robots this shaper.
        json: Print one JSON object.
    """
    from tvist_lab.bench.speed import speed
    from tvist_shaping import BUILT_IN, ShapingError

    check_range("seconds", seconds, 0.0)
    with failing_on(ShapingError, exit_code=2):
        BUILT_IN.check(shaper := shaper.lower())
    lost = "the measurements so far are lost; the served robots have stopped"
    with interruptible(lost):
        result = speed(seconds, shaper, lambda what: err.print(f"measuring {what} ..."))
    if json:
        print_json(result)
        return
    machine = result["machine"]
    rows = [
        (
            f"a tick with {shaper}",
            f"{result['line_us_per_tick']:.0f} µs: {result['realtime_factor']:.0f} times real time",
        )
    ]
    if seconds:
        rows = [*_served(result), *rows]
    table(f"{machine['cpu']}, {machine['cores']} cores", ("what", "here"), rows)
    words(TERMS if seconds else {})
    out.print("The repository's `make bench` compares each part with a reference of the same run.")


def _served(result: dict[str, Any]) -> list[tuple[str, str]]:
    tick, setpoint, command = result["tick"], result["setpoint_to_state_ms"], result["command_ms"]
    return [
        ("robots", str(result["robots_at_500_hz"])),
        ("late", "{late_p50_us:.0f}, {late_p99_us:.0f}, {late_max_us:.0f} µs".format(**tick)),
        ("missed", f"{tick['missed']:.0f} ticks in {tick['seconds']:g} s"),
        ("set-point, median and 99 %", f"{setpoint['p50']:.2f}, {setpoint['p99']:.2f} ms"),
        ("command, median and 99 %", f"{command['p50']:.2f}, {command['p99']:.2f} ms"),
        ("processor", f"{100 * result['cpu_share']:.0f} % of a core"),
        ("memory", f"{result['rss_mb']:.0f} MB"),
        ("start and end", f"{result['start_s']:.1f} s, {result['end_s']:.2f} s"),
    ]
