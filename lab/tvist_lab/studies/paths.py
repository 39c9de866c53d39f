"""Comparison of paths that are shaped along their parameter with the same paths shaped joint by joint."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tvist_controller.api.line import RefusalError, body, elastic_feed_forward, paper_payload
from tvist_lab.metrics import in_motion_rms, motions, peak_after_stop
from tvist_lab.recordings import Floats
from tvist_lab.runners import Processes, in_order
from tvist_lab.studies.path_shaping import ALONG, JOINTS, UNSLOWED, WAYS, Reference, planned, shaped
from tvist_lab.studies.random_paths import KINDS, Kind, PathDraw, ToolMove
from tvist_lab.studies.tool_path import ToolPath
from tvist_lab.study.case import arm_seed
from tvist_lab.study.catalogue import names
from tvist_lab.study.line import ControlLine
from tvist_lab.study.measures import WORTH, kinematics
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter

SHAPERS = names("paths")
"""Shapers that are compared unless others are named."""
TRIES = 1000
"""Number of draws for one path before giving up."""


class PathsError(Exception):
    """No paths can be drawn for this robot; the message says why."""


@dataclass(frozen=True)
class PathJob:
    """One path, which the job itself draws, and the shapers to make it with."""

    description: RobotDescription
    """The arm, and the controller's model of it."""
    calibration: Calibration
    """Calibration of the arm."""
    shapers: tuple[str, ...]
    masses: tuple[float, float]
    """Smallest and largest payload, which is both carried and declared [kg]."""
    seed: int
    """Seed of all paths."""
    place: int
    """Number of this path, from 0."""
    kinds: tuple[Kind, ...] = KINDS
    """Kinds of paths, which take turns."""

    @property
    def kind(self) -> Kind:
        """Kind of this path."""
        return self.kinds[self.place % len(self.kinds)]

    @property
    def motions(self) -> int:
        """Number of motions: unshaped, and each way for each shaper."""
        return 1 + len(WAYS) * len(self.shapers)


@dataclass(frozen=True)
class Followed:
    """A path followed in one way."""

    peak: float
    """Largest true |α| later than 10 ms after the shaped reference stops [m/s²]."""
    duration: float
    """Duration of the shaped reference [s]."""
    in_motion: float
    """Vibration during the motion: rms of α relative to the rigid arm [m/s²]."""
    off: float
    """Largest distance of the shaped reference from the path [m]."""
    turned: float
    """Largest angle of the tool from its orientation at the nearest place of the path [rad]."""
    velocity: float
    """Largest |q̇| of any joint relative to that of the reference before shaping [-]."""
    acceleration: float
    """Largest |q̈| of any joint relative to that of the reference before shaping [-]."""


@dataclass(frozen=True)
class JudgedPath:
    """One path, followed in every way."""

    move: ToolMove
    length: float
    """Length of the tool's path [m]."""
    refused: int
    """Number of draws before this one that the robot refuses."""
    stopping: int
    """Number of draws before this one that stop on their way, since a blend does not fit."""
    unshaped: Followed
    planned: dict[str, float]
    """Duration of the reference that the robot plans for each shaper, before shaping [s]."""
    shaped: dict[str, dict[str, Followed]]
    """Results by shaper and way."""

    @property
    def counts(self) -> bool:
        """Whether there is enough vibration for a percentage."""
        return self.unshaped.peak >= WORTH

    def reduction(self, one: Followed) -> float:
        """Reduction of the peak compared with the unshaped path [%]."""
        return 100.0 * (1.0 - one.peak / self.unshaped.peak)


def compare(jobs: Sequence[PathJob]) -> Iterator[JudgedPath]:
    """Do all jobs on all cores; yield the results in order, each as soon as it is available.

    Raises:
        PathsError: Hardly any drawn path can be followed.
        RefusalError: There is no such shaper for this robot.
    """
    return in_order(Processes(few=1, chunk=1), judge, jobs)


def judge(job: PathJob) -> JudgedPath:
    """Draw a path, follow it in every way, and measure that.

    Raises:
        PathsError: Hardly any drawn path can be followed.
    """
    found = draw(job)
    description, move = job.description, found.move
    start = np.array(move.start)
    carried = body(paper_payload(description, move.mass))
    line, arm = ControlLine(description, start, carried), FlexibleArm(description, carried)
    at = kinematics(description)
    unshaped = found.plans["none"][0]
    path = ToolPath(at, unshaped.sampled())

    def follow(reference: Reference, q: Floats, tvist: Filter | None = None) -> Followed:
        # As for `tvist evaluate`, each path has gear errors of its own, and all ways of it have the same.
        seed = arm_seed(job.seed, job.place)
        elastic = None if tvist is None else elastic_feed_forward(tvist, description, job.calibration)
        recording = line.follow(reference.q, q, elastic=elastic).simulate(arm, seed)
        motion, (distance, angle) = motions(recording)[0], path.off(q)
        peaks = [
            [_peak(samples, order) for order in (1, 2)] for samples in (_resting(q), _resting(reference.q))
        ]
        return Followed(
            peak_after_stop(recording, motion),
            motion.shaped_duration(recording),
            in_motion_rms(recording, motion, at),
            float(distance.max()),
            float(angle.max()),
            peaks[0][0] / peaks[1][0],
            peaks[0][1] / peaks[1][1],
        )

    def in_every_way(reference: Reference, tvist: Filter) -> dict[str, Followed]:
        ways = {way: follow(reference, shaped(reference, tvist, way), tvist) for way in (ALONG, JOINTS)}
        same = np.array_equal(reference.q, unshaped.q)
        ways[UNSLOWED] = ways[JOINTS] if same else follow(unshaped, shaped(unshaped, tvist, UNSLOWED), tvist)
        return ways

    return JudgedPath(
        move,
        path.length,
        found.refused,
        found.stopping,
        follow(unshaped, unshaped.q),
        {name: found.plans[name][0].motion.duration for name in job.shapers},
        {name: in_every_way(*found.plans[name]) for name in job.shapers},
    )


@dataclass(frozen=True)
class Drawn:
    """A path that the robot can follow with every shaper."""

    move: ToolMove
    refused: int
    stopping: int
    plans: dict[str, tuple[Reference, Filter]]
    """Reference and filter by shaper, and those of `none`."""


def draw(job: PathJob) -> Drawn:
    """Draw paths until the robot can follow one without a stop.

    Raises:
        PathsError: Hardly any can be followed.
    """
    random = np.random.default_rng([job.seed, job.place])
    paths = PathDraw(job.description, float(random.uniform(*job.masses)))
    refused = stopping = 0
    while refused + stopping < TRIES:
        move, plans = paths.draw(job.kind, random), dict[str, tuple[Reference, Filter]]()
        for name in ("none", *job.shapers):
            try:
                plan = planned(job.description, job.calibration, name, move)
            except RefusalError:
                refused += 1
                break
            if plan is None:
                stopping += 1
                break
            plans[name] = plan
        else:
            return Drawn(move, refused, stopping, plans)
    raise PathsError(f"path {job.place + 1}: the robot can follow none of {TRIES} drawn ones without a stop")


def _peak(q: Floats, order: int) -> float:
    """Largest derivative of any joint."""
    return float(np.abs(np.diff(q, order, axis=0)).max()) / PERIOD**order


def _resting(q: Floats) -> Floats:
    """Samples from rest to rest."""
    return np.vstack((q[:1], q, q[-1:]))
