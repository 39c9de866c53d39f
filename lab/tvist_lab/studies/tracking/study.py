"""Comparison of shapers by the error with which the arm follows a trajectory controller."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from tvist_controller.api.line import Setup
from tvist_controller.api.robot import Controller
from tvist_lab.in_process import free_setup
from tvist_lab.recordings import Floats
from tvist_lab.runners import in_order
from tvist_lab.studies.pages import page
from tvist_lab.studies.tracking.following import follow
from tvist_lab.studies.tracking.ways import APPROACH, CONSTANT, DISTANCE, RAMP, WAYS, WayName, level_end
from tvist_lab.study.tables import Entry, Shown
from tvist_lab.study.work import Row
from tvist_shaping.named import BUILT_IN

UNSHAPED = "none"
"""Name of the robot whose `servoj` is not shaped."""
TITLES: Mapping[WayName, str] = {
    "ramp": f"first joint alone, speeding up and slowing down with {RAMP:g} rad/s²",
    "turn": "all joints by 1 rad at once from the start posture, the velocity jumps",
    "jump": "test_trajectory_scaled: all joints at once, the velocity jumps",
}
"""Titles of the tables."""
SPEEDS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
"""Speeds of the joints unless others are given [rad/s]; the driver's test has 2."""
SHAPERS = tuple(name for name in BUILT_IN.names() if name != UNSHAPED)
"""Shapers that are compared unless others are named."""


@dataclass(frozen=True)
class TrackingJob:
    """One trajectory at one speed with one shaper."""

    shaper: str
    """Name of the shaper, or FILE.py:NAME; `UNSHAPED` for a robot that does not shape `servoj`."""
    payload: float
    """Mass of the disc on the flange, both carried and declared [kg]."""
    way: WayName
    speed: float
    """Speed of the joints that move [rad/s]."""

    def setup(self) -> Setup:
        """Return the setup of a robot as `tvist serve --ur --shape-servo` starts it.

        Raises:
            ConfigError: There is no such shaper, or no arm is rated for this payload.
        """
        return free_setup(
            profile="ursim",
            shaper=self.shaper,
            shape_servo=self.shaper != UNSHAPED,
            payload=self.payload,
            truth=False,
        )


def refusal(shaper: str, payload: float) -> str | None:
    """Return why a robot cannot shape with a shaper, None if it can.

    Args:
        shaper: Name of the shaper, or FILE.py:NAME.
        payload: Mass of the disc on the flange [kg].
    """
    try:
        Controller(TrackingJob(shaper, payload, "ramp", 1.0).setup())
    except ValueError as error:
        return str(error)
    return None


def compare(jobs: Sequence[TrackingJob]) -> Iterator[Row]:
    """Do all jobs on all cores; yield the results in order, each as soon as it is available.

    Raises:
        TrackingError: A stop, or an error of the program, ended a motion.
    """
    return in_order(track, jobs)


def track(job: TrackingJob) -> Row:
    """Let a robot follow a trajectory, and measure its error.

    Returns:
        `error_rad`, the largest |wanted - actual| over joints and time; for a ramp also `lag_ms`, the time by which the
        first joint is late at constant speed, and `mean_delay_ms`, that of the shaper.

    Raises:
        TrackingError: A stop, or an error of the program, ended the motion.
    """
    setup = job.setup()
    followed = follow(setup, wanted := WAYS[job.way](np.array(setup.q), job.speed))
    late: Floats = wanted - followed.actual
    row = {
        "shaper": setup.shaper, "way": job.way, "speed_rad_s": job.speed, "error_rad": float(np.abs(late).max()),
    }  # fmt: skip
    if job.way != "ramp":
        return row
    lag = float(late[level_end(job.speed), 0]) / job.speed
    return row | {"lag_ms": 1e3 * lag, "mean_delay_ms": 1e3 * followed.mean_delay}


def speed_at(tolerance: float, rows: Sequence[Row]) -> float | None:
    """Return the speed at which a tolerance is used up, interpolated between the measured ones [rad/s].

    Args:
        tolerance: Path tolerance [rad].
        rows: Results of one trajectory and one shaper at increasing speeds.

    Returns:
        The speed; None if the error is within the tolerance at all speeds.
    """
    slower = (0.0, 0.0)
    for row in rows:
        speed, error = slower
        if not within(row, tolerance):
            share = (tolerance - error) / (row["error_rad"] - error)
            return float(speed + share * (row["speed_rad_s"] - speed))
        slower = (row["speed_rad_s"], row["error_rad"])
    return None


def within(row: Row, tolerance: float) -> bool:
    """Return whether a path tolerance [rad] is kept: an error that equals it is none, as in ros2_controllers."""
    return bool(row["error_rad"] <= tolerance)


def report(rows: Sequence[Row], tolerance: float) -> list[dict[str, Any]]:
    """Return a map for each shaper, in the order in which they come.

    Args:
        rows: Results of all jobs; for each shaper and trajectory at increasing speeds.
        tolerance: Path tolerance [rad].
    """
    ways: dict[str, dict[WayName, list[Row]]] = {}
    for row in rows:
        ways.setdefault(row["shaper"], {}).setdefault(row["way"], []).append(row)
    return [
        {"name": name, "shaped": name != UNSHAPED}
        | {way: _figures(group, tolerance) for way, group in groups.items()}
        for name, groups in ways.items()
    ]


def _figures(group: list[Row], tolerance: float) -> dict[str, Any]:
    fastest = group[-1]
    return {
        "error_rad": [row["error_rad"] for row in group],
        "within": [within(row, tolerance) for row in group],
        "speed_at_tolerance_rad_s": speed_at(tolerance, group),
        **{name: fastest[name] for name in ("lag_ms", "mean_delay_ms") if name in fastest},
    }


def columns(result: Entry, way: WayName, mark: str) -> list[Shown]:
    """Return the columns of the table of a trajectory: largest errors [rad], those beyond the tolerance marked."""
    speeds, times = result["speeds_rad_s"], []
    if way == "ramp":
        times = [Shown("mean delay ms", "ramp.mean_delay_ms", 1), Shown("lag ms", "ramp.lag_ms", 1)]

    def error(place: int, shaper: Entry) -> str:
        found = shaper[way]
        said = f"{found['error_rad'][place]:.3f}"
        return said if found["within"][place] else f"{mark}{said}{mark}"

    def reached(shaper: Entry) -> str:
        at = shaper[way]["speed_at_tolerance_rad_s"]
        return f"> {speeds[-1]:g} rad/s" if at is None else f"{at:.2f} rad/s"

    return [
        Shown("shaper", lambda shaper: shaper["name"] if shaper["shaped"] else "not shaped"), *times,
        *(Shown(f"{speed:g} rad/s", partial(error, place)) for place, speed in enumerate(speeds)),
        Shown(f"{result['tolerance_rad']:g} rad at", reached),
    ]  # fmt: skip


def page_of(result: dict[str, Any]) -> str:
    """Return a page with the tables and what they mean."""
    tables = {way: columns(result, way, "**") for way in WAYS}
    numbers = {"APPROACH": APPROACH, "CONSTANT": CONSTANT, "DISTANCE": DISTANCE, "RAMP": RAMP}
    return page("tracking", result, result["command"], tables=tables, **numbers)
