"""`tvist study tracking`: measure how closely the arm follows positions sent to servoj, with every shaper."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import print_json, progress, say, table

if TYPE_CHECKING:
    from tvist_lab.studies.tracking.study import Tracked, TrackingJob

FASTEST = 3.1
"""Highest speed [rad/s], a little below the UR5e's."""
RATING = 5.0
"""Heaviest payload, which is the UR5e's rating [kg]."""


def tracking(
    *,
    shapers: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    speeds: Annotated[list[float] | None, Parameter(consume_multiple=True)] = None,
    payload: float = 0.0,
    tolerance: float = 0.2,
    markdown: Path | None = None,
    json: bool = False,
) -> None:
    """Measure how closely a UR5e follows joint positions that a client sends to servoj 500 times a second.

    Each shaper follows three trajectories at several speeds: a motion of the first joint that the arm can make, one of
    all joints at once that begins with a jump of their velocity, and that of the ROS 2 driver's test
    test_trajectory_scaled, which does the same with the arm stretched out. Reported are the largest difference between
    wanted and actual position, and the speed at which it reaches the path tolerance. The robot is that of
    tvist serve --ur, once without --shape-servo and then with it.

    Args:
        shapers: Names of the shapers to compare, or FILE.py:NAME [all that the robot can use].
        speeds: Speeds of the joints in rad/s [0.5 1 1.5 2 2.5 3].
        payload: Mass of the disc on the flange in kg, both carried and declared.
        tolerance: Path tolerance of the trajectory controller in rad.
        markdown: File to write a page with the tables to.
        json: Print one JSON object.
    """
    from tvist_lab.studies.tracking.following import GAIN, LOOKAHEAD
    from tvist_lab.studies.tracking.report import TITLES, columns, page_of, report, rows
    from tvist_lab.studies.tracking.study import SPEEDS, UNSHAPED, TrackingJob
    from tvist_lab.studies.tracking.ways import WAYS
    from tvist_plant.plant import PERIOD

    at = tuple(sorted(set(speeds or SPEEDS)))
    _check(at, payload, tolerance)
    chosen, refused = _usable(shapers, payload)
    result: dict[str, Any] = {
        "command": _command(shapers, speeds, payload, tolerance, markdown),
        "payload_kg": payload,
        "tolerance_rad": tolerance,
        "speeds_rad_s": list(at),
        "lookahead_s": LOOKAHEAD,
        "gain": GAIN,
        "step_s": PERIOD,
        "refused": refused,
    }
    jobs = [
        TrackingJob(shaper, payload, way, speed)
        for shaper in (UNSHAPED, *chosen)
        for way in WAYS
        for speed in at
    ]
    result["shapers"] = report(_tracked(jobs), tolerance)
    if markdown is not None:
        with told(OSError):
            markdown.write_text(page_of(result), encoding="utf-8")
    if json:
        print_json(result)
        return
    for way in WAYS:
        drawn = [[cell.replace("**", "*") for cell in row] for row in rows(result, way)]
        table(f"largest error in rad; {TITLES[way]}", columns(result, way), drawn)
    for name, why in refused.items():
        say(f"{name} was left out: {why}")


def _check(speeds: tuple[float, ...], payload: float, tolerance: float) -> None:
    for speed in speeds:
        if not 0.0 < speed <= FASTEST:
            raise Failure(f"speeds has {speed:g}: must be above 0 and at most {FASTEST:g} rad/s", code=2)
    if not 0.0 <= payload <= RATING:
        raise Failure(f"payload is {payload:g}: must be 0 to {RATING:g} kg", code=2)
    if tolerance <= 0.0:
        raise Failure(f"tolerance is {tolerance:g}: must be more than 0 rad", code=2)


def _usable(shapers: list[str] | None, payload: float) -> tuple[list[str], dict[str, str]]:
    """Return the shapers to compare, and why others of the package cannot be used.

    Raises:
        Failure: A shaper that was named cannot be used.
    """
    from tvist_cli.misuse import lower
    from tvist_lab.studies.tracking.study import SHAPERS, UNSHAPED, refusal

    wanted = dict.fromkeys(str(lower(name)) for name in shapers or SHAPERS)
    wanted.pop(UNSHAPED, None)  # it is measured in any case
    found = {name: refusal(name, payload) for name in wanted}
    refused = {name: why for name, why in found.items() if why is not None}
    if shapers and refused:
        raise Failure(next(iter(refused.values())), code=2)
    return [name for name in found if name not in refused], refused


def _tracked(jobs: "list[TrackingJob]") -> "list[Tracked]":
    from tvist_lab.studies.tracking.following import TrackingError
    from tvist_lab.studies.tracking.study import compare

    tracked: list[Tracked] = []
    with progress(len(jobs), "motions") as bar, told(TrackingError):
        for one in compare(jobs):
            tracked.append(one)
            bar(1, None)
    return tracked


def _command(
    shapers: list[str] | None,
    speeds: list[float] | None,
    payload: float,
    tolerance: float,
    markdown: Path | None,
) -> str:
    """The command that gives the same figures."""
    return " ".join(
        ["tvist", "study", "tracking"]
        + ([] if shapers is None else ["--shapers", *shapers])
        + ([] if speeds is None else ["--speeds", *(f"{speed:g}" for speed in speeds)])
        + ([] if payload == 0.0 else ["--payload", f"{payload:g}"])
        + ([] if tolerance == 0.2 else ["--tolerance", f"{tolerance:g}"])
        + ([] if markdown is None else ["--markdown", str(markdown)])
    )
