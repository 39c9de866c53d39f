"""`python -m proof`: measure and search what the documents claim; README.md says what each part is for."""

import argparse
import asyncio
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import msgspec

from tvist_lab.markdown_table import markdown_table
from tvist_server.ending import end_like_interrupted

Table = tuple[Sequence[str], Sequence[Sequence[str]]]
"""Headings and rows."""
MOST = 1_000_000
"""Largest number of cases of a search, since the numbers of another seed follow."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Do what the arguments say; return 0, 1 if a promise is broken, or 130 after Control+C."""
    # Processes of ours are small: threads for their matrices would only slow down each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    given = _parser().parse_args(arguments)
    try:
        return int(given.run(given))
    except KeyboardInterrupt:
        print("proof: interrupted", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m proof", description=__doc__)
    parts = parser.add_subparsers(required=True, metavar="PART")

    def part(
        run: Callable[[argparse.Namespace], int], name: str, what: str, among: Any = parts
    ) -> argparse.ArgumentParser:
        one: argparse.ArgumentParser = among.add_parser(name, help=what, description=what)
        one.set_defaults(run=run, refuse=one.error)
        one.add_argument("--json", action="store_true", help="Print one JSON object.")
        return one

    bench = part(_bench, "bench", "Measure speed, each figure beside a reference from the same run.")
    bench.add_argument(
        "--seconds",
        type=_up_to(86_400),
        default=10,
        help="Seconds of each measurement of a robot in real time; 0 serves none [10].",
    )
    bench.add_argument("--only", nargs="+", metavar="NAME", help="Parts to measure [all].")
    soak = part(_soak, "soak", "Serve a robot under load, and tell whether memory and timing stay stable.")
    soak.add_argument("minutes", type=_minutes)
    late = part(_lateness, "lateness", "Compare the ticks that a robot misses with a bare thread's.")
    late.add_argument("minutes", type=_minutes, help="for each: alone, with ten clients, with priority too")
    late.add_argument("--only", nargs="+", metavar="NAME", help="Which of these to measure [all].")
    search = part(_search, "search", "Search for cases in which a robot breaks its promises.")
    for name, default, what in (
        ("stops", 100, "stops of every kind, at random moments of accepted moves"),
        ("streams", 50, "set-point streams towards the floor, the arm itself and the limits"),
        ("changes", 50, "changes of payload, shaper, estimator and speed during a motion"),
        ("sequences", 50, "sequences of 40 random commands; every third one has programs among them"),
    ):
        search.add_argument(
            f"--{name}", type=_up_to(MOST), default=default, help=f"Number of {what} [{default}]."
        )
    search.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Another seed tries other cases.")
    search.add_argument(
        "--robot",
        nargs="+",
        default=["ur5e"],
        help="Robots, which take turns: names, robot files or URDFs [ur5e].",
    )
    search.add_argument(
        "--flexible", action="store_true", help="Simulate the flexible arm in stops and streams, too."
    )
    watch = part(
        _monitor, "monitor", "Count which changes of hidden robots are noticed within three motions."
    )
    watch.add_argument("--robots", type=_up_to(1000), default=5, help="Number of hidden robots [5].")
    watch.add_argument("--seed", type=_up_to(2**31 - 1), default=1, help="Seed of the first of them.")
    watch.add_argument(
        "--arms", nargs="+", default=["ur5e", "ur5-light"], help="Robot files [ur5e ur5-light]."
    )
    watch.add_argument("--shapers", nargs="+", default=["none", "zv"], help="Shapers [none zv].")
    ringing = part(_ringing, "ringing", "Judge the modes that are found in recorded and in made-up stops.")
    ringing.add_argument(
        "logs", nargs="*", type=Path, help="Logs, or folders of logs [the recorded stops among the tests]."
    )
    ringing.add_argument(
        "--made-up", type=_up_to(100_000), default=100, help="Number of made-up stops of each speed [100]."
    )
    ringing.add_argument(
        "--seed", type=_up_to(2**31 - 1), default=0, help="Another seed makes up other stops."
    )
    logs = part(
        _logs, "logs", "Identify hidden robots from everyday motions, fit twins of them, and judge both."
    )
    logs.add_argument("--robot", nargs="+", default=["ur5e", "ur5-light"], help="Robots [ur5e ur5-light].")
    logs.add_argument(
        "--hidden",
        nargs="+",
        type=_up_to(2**31 - 1),
        default=[1, 2, 3],
        help="Seeds of hidden robots [1 2 3].",
    )
    logs.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Seed of motions and noise [0].")
    logs.add_argument(
        "--no-twins", action="store_true", help="Fit no twins, which takes minutes for each robot."
    )
    advice = part(
        _advice, "advice", "Compare what tvist log advise predicts with what hidden robots then do."
    )
    advice.add_argument(
        "--robots", type=_up_to(1000), default=5, help="Hidden robots of each of two arms [5]."
    )
    advice.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Seed of the first one.")
    impact = part(
        _impact, "impact", "Let a robot go down on surfaces, shaped or not, and see how it meets them."
    )
    impact.add_argument("--robot", default="ur5-light", help="Robot [ur5-light].")
    impact.add_argument("--shapers", nargs="+", help="Shapers [none zv auto elastic].")
    impact.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Seed of the robot's sensors [0].")
    impact.add_argument("--figure", type=Path, help="File of a picture to draw, too [none].")
    _add_bridge(parts, part)
    return parser


def _add_bridge(parts: Any, part: Callable[..., argparse.ArgumentParser]) -> None:
    """Add the parts about a robot at the end of the line."""
    bridge = parts.add_parser("bridge", help="Measure what stands between programs and a hidden robot.")
    among = bridge.add_subparsers(required=True, metavar="PART")
    faults = part(
        _faults,
        "faults",
        "Let a bridge to a robot fail at random moments, and see how the robot stops.",
        among,
    )
    faults.add_argument("--moments", type=_up_to(100_000), default=200, help="Number of moments [200].")
    faults.add_argument("--seed", type=_up_to(2**31 - 1), default=7, help="Seed of robot and moments [7].")
    faults.add_argument("--speed", type=float, default=1.0, help="Speed of the robot's time [1].")
    count = part(
        _count,
        "count",
        "Count the set-points that a moving robot misses, by its program and by its rows.",
        among,
    )
    count.add_argument("--minutes", type=_minutes, default=30.0, help="Minutes [30].")
    count.add_argument("--seed", type=_up_to(2**31 - 1), default=7, help="Seed of robot and motions [7].")
    loss = part(_loss, "loss", "See how late set-points come over a cable that loses packets.", among)
    loss.add_argument("--seconds", type=_up_to(86_400), default=60, help="Seconds of each share [60].")
    loss.add_argument(
        "--percent", type=float, nargs="+", default=[0.0, 0.1, 1.0], help="Shares of lost packets [0 0.1 1]."
    )
    motions = part(
        _motions, "motions", "Compare shapers in hidden robots with the same ones in front of them.", among
    )
    motions.add_argument(
        "--robots", type=_up_to(1000), default=3, help="Hidden robots, of two arms in turn [3]."
    )
    motions.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Seed of the first one [0].")
    motions.add_argument(
        "--shapers", nargs="+", default=["auto", "auto-target"], help="Shapers [auto auto-target]."
    )
    motions.add_argument(
        "--random", type=_up_to(100_000), default=100, help="Random moves after the paper's motions [100]."
    )
    figure = part(_figure, "figure", "Draw the end of a motion that is shaped in front of a robot.", among)
    figure.add_argument("--seed", type=_up_to(2**31 - 1), default=1, help="Seed of the robot [1].")
    figure.add_argument("--output", type=Path, default=Path("bridge.png"), help="File to write [bridge.png].")
    identify = part(
        _identify, "identify", "Identify hidden robots that take positions alone, and judge it.", among
    )
    identify.add_argument("--robots", type=_up_to(1000), default=3, help="Number of hidden robots [3].")
    identify.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Seed of the first one [0].")
    identify.add_argument(
        "--rates",
        nargs="+",
        type=int,
        choices=(500, 125),
        default=[500, 125],
        help="Rows a second [500 125].",
    )
    written = part(
        _programs,
        "programs",
        "Run programs written for a hidden robot on it and by the bridge, and compare how its tool rings.",
        among,
    )
    written.add_argument("--seed", type=_up_to(2**31 - 1), default=0, help="Seed of their motions [0].")
    written.add_argument("--robot", default="ur5e", help="Model of the robot [ur5e].")
    written.add_argument(
        "--hidden", type=_up_to(2**31 - 1), help="Seed of the hidden robot [that of the motions]."
    )
    written.add_argument("--shapers", nargs="+", default=["auto"], help="Shapers of the bridge [auto].")
    written.add_argument("--only", nargs="+", metavar="NAME", help="Programs to run [all].")
    written.add_argument(
        "--urcl",
        nargs=2,
        type=Path,
        metavar=("SOURCES", "BUILD"),
        help="Folders of UR's C++ client library, built with its examples, to run its trajectory example [left out].",
    )
    written.add_argument(
        "--calibration", type=Path, help="Calibration of the robot [identified from twelve ring-downs]."
    )
    written.add_argument(
        "--inside", action="store_true", help="Let the robot itself shape, instead of a bridge before it."
    )


def _up_to(most: int) -> Callable[[str], int]:
    def whole(text: str) -> int:
        if not (text.isdecimal() and int(text) <= most):
            raise argparse.ArgumentTypeError(f"is {text}: must be 0 to {most}")
        return int(text)

    return whole


def _minutes(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"is {text}: must be more than 0")
    return value


def _bench(given: argparse.Namespace) -> int:
    from proof.bench.report import PARTS, bench, tables

    if unknown := set(given.only or ()) - set(PARTS):
        given.refuse(f"there is no part {min(unknown)}: the parts are {' '.join(PARTS)}")
    result = bench(given.seconds, _tell, given.only or PARTS)
    _print(result, given.json, tables(result))
    return 0


def _soak(given: argparse.Namespace) -> int:
    from proof.bench.soak import soak

    result = asyncio.run(soak(given.minutes, _tell))
    _print(
        result, given.json, [(("what", "figure"), [[key, f"{value:.6g}"] for key, value in result.items()])]
    )
    return 0


def _lateness(given: argparse.Namespace) -> int:
    from proof.bench.on_time import STUDIES, on_time

    if unknown := set(given.only or ()) - set(STUDIES):
        given.refuse(f"there is no {min(unknown)}: there are {' '.join(STUDIES)}")
    result: dict[str, dict[str, float]] = {}
    try:
        asyncio.run(on_time(given.minutes, _tell, result, given.only or tuple(STUDIES)))
    finally:  # what was measured until Control+C counts
        if result:
            rows = [[name, *(f"{value:.4g}" for value in found.values())] for name, found in result.items()]
            _print(result, given.json, [(("missed ticks", *next(iter(result.values()))), rows)])
    return 0


def _search(given: argparse.Namespace) -> int:
    from proof.search.report import Counts, broken, search, tables
    from tvist_plant.description import DescriptionError

    counts = Counts(given.stops, given.streams, given.changes, given.sequences)
    if not counts.all:
        given.refuse("there is nothing to search: give one of --stops --streams --changes --sequences")
    try:
        result = search(
            counts, given.seed, robots=given.robot, flexible=given.flexible, progress=_counted(counts.all)
        )
    except DescriptionError as error:
        given.refuse(str(error))
    found = broken(result)
    _print(result, given.json, tables(result))
    for one in found:
        _tell(one)
    if found:
        _tell(f"{len(found)} of {counts.all} cases broke a promise")
    return 1 if found else 0


def _check_built_in(given: argparse.Namespace) -> None:
    from tvist_shaping import BUILT_IN

    if unknown := set(given.shapers or ()) - set(BUILT_IN.names()):
        given.refuse(f"there is no shaper {min(unknown)}")


def _monitor(given: argparse.Namespace) -> int:
    from proof.monitor.measure import CHANGES, measure

    seeds = range(given.seed, given.seed + given.robots)
    progress = _counted(len(seeds) * len(given.arms) * len(given.shapers) * len(CHANGES))
    rows = measure(given.arms, seeds, given.shapers, progress)
    columns = list(rows[0])
    _print({"rows": rows}, given.json, [(columns, [[str(row[name]) for name in columns] for row in rows])])
    return 0


def _ringing(given: argparse.Namespace) -> int:
    from proof.ringing.report import files_of, of_logs, of_made_up, report, tables

    try:
        files = files_of(given.logs)
    except FileNotFoundError as error:
        given.refuse(str(error))
    count = _counted(max(2 * given.made_up, 1))
    result = report([*of_logs(files, _tell), *of_made_up(given.made_up, given.seed, count)])
    _print(result, given.json, tables(result))
    return 0


def _logs(given: argparse.Namespace) -> int:
    from proof.logs.report import report, tables

    result = report(given.robot, given.hidden, given.seed, _tell, twins=not given.no_twins)
    _print(result, given.json, tables(result))
    return 0


def _advice(given: argparse.Namespace) -> int:
    from proof.advice.hidden import report, tables

    result = report(given.robots, given.seed, _tell)
    _print(result, given.json, tables(result))
    return 0


def _impact(given: argparse.Namespace) -> int:
    from proof.impact.report import SHAPERS, draw, landings, report, tables
    from tvist_plant.description import DescriptionError

    _check_built_in(given)
    try:
        made = landings(given.robot, given.shapers or SHAPERS, given.seed, _tell)
    except DescriptionError as error:
        given.refuse(str(error))
    result = report(made)
    _print(result, given.json, tables(result))
    if given.figure is not None:
        draw(made, given.figure)
    return 0


def _programs(given: argparse.Namespace) -> int:
    from proof.bridge.programs import OURS, URCL, Ways, report, tables

    all_of_them = [*OURS, *([URCL] if given.urcl else [])]
    if unknown := set(given.only or ()) - set(all_of_them):
        given.refuse(f"there is no program {min(unknown)}: there are {' '.join(all_of_them)}")
    hidden = given.seed if given.hidden is None else given.hidden
    ways = Ways(given.robot, hidden, given.seed, given.only or all_of_them, given.urcl)
    result = report(ways, given.shapers, given.calibration, _tell, inside=given.inside)
    _print(result, given.json, tables(result))
    return 0


def _faults(given: argparse.Namespace) -> int:
    from proof.bridge.faults import Faults, broken, report, tables

    faults = Faults(given.seed, _tell, given.speed)
    trials = faults.run(given.moments, _counted(given.moments))
    result = report(trials, faults.others)
    _print(result, given.json, tables(result))
    found = broken(result)
    for one in found:
        _tell(one)
    return 1 if found else 0


def _count(given: argparse.Namespace) -> int:
    from proof.bridge.count import report, tables

    result = report(given.minutes, given.seed, _tell)
    _print(result, given.json, tables(result))
    return 0 if all(run["equal"] for run in result["runs"]) else 1


def _loss(given: argparse.Namespace) -> int:
    from proof.bridge.loss import measure

    rows = [measure(percent / 100.0, given.seconds) for percent in given.percent]
    columns = list(rows[0])
    table = columns, [[f"{row[name]:.4g}" for name in columns] for row in rows]
    _print({"rows": rows}, given.json, [table])
    return 0


def _motions(given: argparse.Namespace) -> int:
    from proof.bridge.motions import report, tables
    from tvist_shaping import BUILT_IN
    from tvist_shaping.errors import ShapingError

    try:
        for name in given.shapers:
            BUILT_IN.check(name)
    except ShapingError as error:
        given.refuse(str(error))
    result = report(given.robots, given.seed, given.shapers, given.random, _tell)
    _print(result, given.json, tables(result))
    return 0


def _identify(given: argparse.Namespace) -> int:
    from proof.bridge.identify import report, tables

    result = report(max(given.robots, 1), given.seed, [500 // rate for rate in given.rates], _tell)
    _print(result, given.json, tables(result))
    return 0


def _figure(given: argparse.Namespace) -> int:
    from proof.bridge.figure import draw

    draw(given.seed, given.output)
    return 0


def _print(result: dict[str, Any], json: bool, tables: Sequence[Table]) -> None:
    if json:
        print(msgspec.json.encode(result).decode())
        return
    for columns, rows in tables:
        print(markdown_table(columns, rows), end="\n\n")


def _counted(total: int) -> Callable[[str], None]:
    """Return what counts cases, and tells every tenth of them."""
    done = 0

    def count(what: str) -> None:
        nonlocal done
        done += 1
        if done * 10 // total > (done - 1) * 10 // total:
            _tell(f"{done} of {total} cases, now {what}")

    return count


def _tell(what: str) -> None:
    print(what, file=sys.stderr, flush=True)


if __name__ == "__main__":
    end_like_interrupted()
    sys.exit(main())
