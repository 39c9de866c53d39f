"""`tvist study tracking`: measure how closely the arm follows positions sent to servoj, with every shaper."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure
from tvist_cli.output import say
from tvist_cli.studying import Places, check_range, command, gathered, give, show

FASTEST = 3.1
"""Highest speed [rad/s], a little below the UR5e's."""
RATING = 5.0
"""Heaviest payload, which is the UR5e's rating [kg]."""
TOLERANCE = 0.2
"""Path tolerance of every joint in the driver's configuration [rad]."""


def tracking(
    *,
    shapers: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    speeds: Annotated[list[float] | None, Parameter(consume_multiple=True)] = None,
    payload: float = 0.0,
    tolerance: float = TOLERANCE,
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
    from tvist_lab.studies.tracking.following import GAIN, LOOKAHEAD, TrackingError
    from tvist_lab.studies.tracking.study import SPEEDS, UNSHAPED, TrackingJob, compare, page_of, report
    from tvist_lab.studies.tracking.ways import WAYS
    from tvist_plant.plant import PERIOD

    at = tuple(sorted(set(speeds or SPEEDS)))
    for speed in at:
        if not 0.0 < speed <= FASTEST:
            raise Failure(f"speeds has {speed:g}: must be above 0 and at most {FASTEST:g} rad/s", code=2)
    check_range("payload", payload, 0.0, RATING, " kg")
    if tolerance <= 0.0:
        raise Failure(f"tolerance is {tolerance:g}: must be more than 0 rad", code=2)
    chosen, refused = _usable(shapers, payload)
    options = {
        "shapers": shapers,
        "speeds": speeds,
        "payload": payload or None,
        "tolerance": None if tolerance == TOLERANCE else tolerance,
        "markdown": markdown,
    }
    result: dict[str, Any] = {
        "command": command("study tracking", **options),
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
    result["shapers"] = report(gathered(compare(jobs), len(jobs), "motions", TrackingError), tolerance)
    Places(markdown=markdown).write(result, page=lambda: page_of(result))
    give(result, _print, json=json)


def _print(result: dict[str, Any]) -> None:
    from tvist_lab.studies.tracking.study import TITLES, columns

    for way, title in TITLES.items():
        show(f"largest error in rad; {title}", result["shapers"], columns(result, way, "*"))
    for name, why in result["refused"].items():
        say(f"{name} was left out: {why}")


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
