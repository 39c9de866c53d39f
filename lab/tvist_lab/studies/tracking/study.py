"""Comparison of shapers by the error with which the arm follows a trajectory controller."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import Setup
from tvist_controller.api.robot import Controller
from tvist_lab.in_process import free_setup
from tvist_lab.recordings import Floats
from tvist_lab.runners import Processes, in_order
from tvist_lab.studies.tracking.following import follow
from tvist_lab.studies.tracking.ways import WAYS, WayName, level_end
from tvist_shaping.named import BUILT_IN

UNSHAPED = "none"
"""Name of the robot whose `servoj` is not shaped."""
TOLERANCE = 0.2
"""Path tolerance of every joint in the driver's configuration [rad]."""
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


@dataclass(frozen=True)
class Tracked:
    """How closely a trajectory was followed."""

    shaper: str
    """Name of the shaper."""
    way: WayName
    speed: float
    error: float
    """Largest |wanted - actual| over joints and time [rad]."""
    lag: float | None
    """Time by which the first joint is late where a ramp is at constant speed [s]; None for other trajectories."""
    mean_delay: float
    """Mean delay of the shaper [s]."""

    def within(self, tolerance: float) -> bool:
        """Return whether a path tolerance [rad] is kept: an error that equals it is none, as in ros2_controllers."""
        return self.error <= tolerance


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


def compare(jobs: Sequence[TrackingJob]) -> Iterator[Tracked]:
    """Do all jobs on all cores; yield the results in order, each as soon as it is available.

    Raises:
        TrackingError: A stop, or an error of the program, ended a motion.
    """
    return in_order(Processes(), track, jobs)


def track(job: TrackingJob) -> Tracked:
    """Let a robot follow a trajectory, and measure its error.

    Raises:
        TrackingError: A stop, or an error of the program, ended the motion.
    """
    setup = job.setup()
    wanted = WAYS[job.way](np.array(setup.q), job.speed)
    followed = follow(setup, wanted)
    late: Floats = wanted - followed.actual
    return Tracked(
        setup.shaper,
        job.way,
        job.speed,
        float(np.abs(late).max()),
        float(late[level_end(job.speed), 0]) / job.speed if job.way == "ramp" else None,
        followed.mean_delay,
    )


def speed_at(tolerance: float, tracked: Sequence[Tracked]) -> float | None:
    """Return the speed at which a tolerance is used up, interpolated between the measured ones [rad/s].

    Args:
        tolerance: Path tolerance [rad].
        tracked: Results of one trajectory and one shaper at increasing speeds.

    Returns:
        The speed; None if the error is within the tolerance at all speeds.
    """
    slower = (0.0, 0.0)
    for one in tracked:
        if not one.within(tolerance):
            speed, error = slower
            return speed + (tolerance - error) / (one.error - error) * (one.speed - speed)
        slower = (one.speed, one.error)
    return None
