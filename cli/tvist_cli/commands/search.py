"""`tvist search`: search for cases in which a robot breaks its promises."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import number, out, print_json, progress, say, table, typed


def search(
    *,
    stops: int = 100,
    streams: int = 50,
    changes: int = 50,
    sequences: int = 50,
    seed: int = 0,
    robot: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    flexible: bool = False,
    markdown: Path | None = None,
    json: bool = False,
) -> None:
    """Try random stops, streams, changes during motion and sequences of commands, and check the robot's promises.

    A stop stays on the path of the motion, never gets ahead of it, comes to rest no later and keeps the torque limits;
    the reference stays clear of the floor and of the arm itself, and no joint exceeds its velocity or acceleration, at
    limits up to the arm's own and with every shaper; limits above these are refused; every motion ends exactly once;
    and the robot can always be brought back to motion. Each violation is printed with its case number, and the exit
    code is then 1.

    Args:
        stops: Number of stops to try, of every kind, at random moments of accepted moves.
        streams: Number of set-point streams towards the floor, the arm itself and the limits.
        changes: Number of changes of payload, shaper, estimator and speed during a motion.
        sequences: Number of sequences of 40 random commands; every third one has programs among them.
        seed: Seed of the cases; another seed tries other cases.
        robot: Robots to try, which take turns: names of robots that come with the package, or paths of robot files or
            URDFs [ur5e]. A robot without a calibration in the package gets one made of its file's springs and drives.
        flexible: Simulate the flexible arm in stops and streams, too, and report how far it overshoots the reference.
        markdown: File to write a page with the figures to.
        json: Print one JSON object.
    """
    for name, count in (
        ("stops", stops),
        ("streams", streams),
        ("changes", changes),
        ("sequences", sequences),
    ):
        if not 0 <= count <= 1_000_000:
            raise Failure(f"{name} is {count}: must be 0 to 1000000", code=2)
    if not 0 <= seed < 2**31:
        raise Failure(f"seed is {seed}: must be 0 to {2**31 - 1}", code=2)
    from tvist_lab.safety.report import Counts, broken
    from tvist_lab.safety.report import search as run
    from tvist_plant.description import DescriptionError, load

    counts = Counts(stops, streams, changes, sequences)
    if not counts.all:
        raise Failure(
            "there is nothing to search: give one of --stops --streams --changes --sequences", code=2
        )
    robots = robot or ["ur5e"]
    with told(DescriptionError, code=2):
        for one in robots:
            load(one)
    with progress(counts.all, "cases") as advance:
        result = run(counts, seed, robots=robots, flexible=flexible, progress=lambda what: advance(1, what))
    found = broken(result)
    if markdown is not None:
        from tvist_lab.safety.markdown import page

        with told(OSError):
            markdown.write_text(page(result, typed()), encoding="utf-8")
    if json:
        print_json(result)
    else:
        _print(result)
    for one in found:
        say(one)
    if found:
        raise Failure(f"{len(found)} of {counts.all} cases broke a promise", code=1)


def _print(result: dict[str, Any]) -> None:
    searched = {name: part for name, part in result.items() if isinstance(part, dict)}
    columns = (
        "search",
        "cases",
        "broken",
        "refused or stopped",
        "of velocity",
        "of acceleration",
        "below clearance [mm]",
        "flexible arm [mm]",
    )
    rows = []
    for name, part in searched.items():
        ended = part.get("refused", part.get("stopped_by_the_robot"))
        near, deep = part.get("worst_below_clearance_m"), part.get("worst_penetration_of_the_flexible_arm_m")
        rows.append(
            (
                name,
                str(part["count"]),
                str(len(part["broken"])),
                number(ended, 0),
                number(part.get("worst_velocity_share"), 3),
                number(part.get("worst_acceleration_share"), 3),
                number(None if near is None else 1e3 * near, 2),
                number(None if deep is None else 1e3 * deep, 2),
            )
        )
    table("what was searched", columns, rows)
    if "kinds" in result.get("stops", {}):
        kinds = result["stops"]["kinds"]
        table(
            "stops",
            ("kind", "cases", "duration, median [s]", "largest [s]", "of the time left, median", "ran out"),
            [
                (
                    kind,
                    str(part["count"]),
                    number(part["duration_s"]["median"], 3),
                    number(part["duration_s"]["max"], 3),
                    number(part["share_of_time_left"]["median"], 2),
                    str(part["ran_out"]),
                )
                for kind, part in kinds.items()
            ],
        )
    out.print(
        "Below clearance: a negative value means no contact; the flexible arm overshoots its reference."
    )
