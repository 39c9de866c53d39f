"""Comparison of paths that are shaped along their parameter with the same paths shaped joint by joint."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tvist_controller.api.line import RefusalError, body, elastic_feed_forward, paper_payload
from tvist_lab.metrics import in_motion_rms, motions, peak_after_stop, rigid_acceleration
from tvist_lab.recordings import Floats
from tvist_lab.runners import in_order
from tvist_lab.studies.pages import page
from tvist_lab.studies.path_examples import circle_in_words
from tvist_lab.studies.path_shaping import ALONG, JOINTS, UNSLOWED, WAYS, Reference, planned, shaped
from tvist_lab.studies.random_paths import KINDS, Kind, PathDraw, ToolMove
from tvist_lab.studies.tool_path import ToolPath
from tvist_lab.study.case import arm_seed
from tvist_lab.study.held_out import interval, percentiles
from tvist_lab.study.line import ControlLine
from tvist_lab.study.measures import WORTH, kinematics
from tvist_lab.study.menus import names
from tvist_lab.study.tables import Shown, in_markdown
from tvist_lab.study.work import Row
from tvist_plant.description import RobotDescription
from tvist_plant.flexible_arm import FlexibleArm
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import Calibration
from tvist_shaping.base import Filter

SHAPERS = names("paths")
"""Shapers that are compared unless others are named."""
TRIES = 1000
"""Number of draws for one path before giving up."""
SUMMARIZED: dict[str, dict[str, float]] = {
    "delay_ms": {"median": 50, "max": 100},
    "in_motion_ratio": {"median": 50, "p95": 95},
    "off_mm": {"median": 50, "p95": 95, "max": 100},
    "turned_mrad": {"median": 50, "p95": 95, "max": 100},
    "peak_velocity_ratio": {"median": 50, "max": 100},
    "peak_acceleration_ratio": {"median": 50, "max": 100},
}
"""Percentiles of what is summarized over all paths."""
COLUMNS = (
    Shown("shaper", "name"), Shown("shaped", "way"), Shown("less %", "reduction_percent.median", 1),
    Shown("p5", "reduction_percent.p5", 1), Shown("min", "reduction_percent.min", 1),
    Shown("delay ms", "delay_ms.median", 0), Shown("in motion", "in_motion_ratio.median", 2),
    Shown("off mm", "off_mm.median", 4), Shown("max", "off_mm.max", 4),
    Shown("turned mrad", "turned_mrad.median", 4), Shown("q̇ max", "peak_velocity_ratio.max", 3),
    Shown("q̈ max", "peak_acceleration_ratio.max", 3),
)  # fmt: skip
"""Columns of the table of all paths."""
TERMS = {
    "less": "reduction of the largest |α|, the true acceleration of the tool, later than 10 ms after the stop of the "
    "shaped reference; median, 5th percentile and smallest",
    "delay": "extra duration compared with the path planned without a shaper, median",
    "in motion": "rms of the difference between α and that of a rigid arm until the stop, divided by the value "
    "unshaped, median",
    "off": "largest distance of the shaped reference from the path; median and largest",
    "turned": "largest angle from the orientation at that place, median",
    "q̇, q̈": "largest velocity and acceleration of a joint, divided by those before shaping; largest",
}
"""What the columns mean."""
IN_WORDS: dict[str, tuple[str, str]] = {
    "line": ("line", "lines"),
    "arc": ("arc", "arcs"),
    "blends": ("path with blends", "paths with blends"),
}
"""Names of the kinds of paths, in the singular and in the plural."""


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


class Judged(NamedTuple):
    """One path, followed in every way."""

    path: Row
    """The path and its figures, as `--json` prints them."""
    refused: int
    """Number of draws before this one that the robot refuses."""
    stopping: int
    """Number of draws before this one that stop on their way, since a blend does not fit."""


def compare(jobs: Sequence[PathJob]) -> Iterator[Judged]:
    """Do all jobs on all cores; yield the results in order, each as soon as it is available.

    Raises:
        PathsError: Hardly any drawn path can be followed.
        RefusalError: There is no such shaper for this robot.
    """
    return in_order(judge, jobs, few=1)


def judge(job: PathJob) -> Judged:
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
    plain = found.plans["none"][0]
    path = ToolPath(at, plain.sampled())

    def follow(reference: Reference, q: Floats, tvist: Filter | None = None) -> tuple[float, float, float]:
        """Largest |α| after the stop [m/s²], duration [s], and rms of α relative to the rigid arm [m/s²]."""
        # As for `tvist evaluate`, each path has gear errors of its own, and all ways of it have the same.
        seed = arm_seed(job.seed, job.place)
        elastic = None if tvist is None else elastic_feed_forward(tvist, description, job.calibration)
        recording = line.follow(reference.q, q, elastic=elastic).simulate(arm, seed)
        motion = motions(recording)[0]
        rms = in_motion_rms(recording, motion, rigid_acceleration(recording, motion, at))
        return peak_after_stop(recording, motion), motion.shaped_duration(recording), rms

    unshaped = follow(plain, plain.q)

    def figures(reference: Reference, tvist: Filter, way: str) -> Row:
        q = shaped(reference, tvist, way)
        (peak, duration, rms), (distance, angle) = follow(reference, q, tvist), path.off(q)
        return {
            "peak_m_s2": peak,
            "reduction_percent": 100.0 * (1.0 - peak / unshaped[0]) if unshaped[0] >= WORTH else None,
            "delay_ms": round(1e3 * (duration - unshaped[1]), 6),
            "in_motion_ratio": rms / unshaped[2],
            "off_mm": 1e3 * float(distance.max()),
            "turned_mrad": 1e3 * float(angle.max()),
            "peak_velocity_ratio": _largest(q, 1) / _largest(reference.q, 1),
            "peak_acceleration_ratio": _largest(q, 2) / _largest(reference.q, 2),
        }

    def in_every_way(reference: Reference, tvist: Filter) -> dict[str, Row]:
        ways = {way: figures(reference, tvist, way) for way in (ALONG, JOINTS)}
        same = np.array_equal(reference.q, plain.q)
        ways[UNSLOWED] = ways[JOINTS] if same else figures(plain, tvist, UNSLOWED)
        return ways

    pace = move.command.segments[0]
    row = {
        "kind": move.kind,
        "segments": len(move.command.segments),
        "length_m": path.length,
        "velocity_m_s": pace.velocity,
        "acceleration_m_s2": pace.acceleration,
        "payload_kg": move.mass,
        "duration_s": unshaped[1],
        "unshaped_peak_m_s2": unshaped[0],
        "unshaped_in_motion_m_s2": unshaped[2],
        "shaped": {name: in_every_way(*found.plans[name]) for name in job.shapers},
    }
    return Judged(row, found.refused, found.stopping)


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


def _largest(q: Floats, order: int) -> float:
    """Largest derivative of any joint from rest to rest."""
    return float(np.abs(np.diff(np.vstack((q[:1], q, q[-1:])), order, axis=0)).max()) / PERIOD**order


def report(judged: Sequence[Judged]) -> dict[str, Any]:
    """Return the part of `tvist study paths --json` about the paths."""
    paths = [one.path for one in judged]
    groups = {"all": paths}
    for path in paths:
        groups.setdefault(path["kind"], []).append(path)
    return {
        "refused": sum(one.refused for one in judged),
        "stopping": sum(one.stopping for one in judged),
        "paths": paths,
        "summary": {name: _group(group) for name, group in groups.items()},
    }


def _group(paths: list[Row]) -> dict[str, Any]:
    peaks = [path["unshaped_peak_m_s2"] for path in paths]
    shapers = paths[0]["shaped"] if paths else ()
    return {
        "paths": len(paths),
        "counted": sum(peak >= WORTH for peak in peaks),
        "unshaped_peak_m_s2": percentiles(peaks, median=50, max=100),
        "shapers": {
            name: {way: _way([path["shaped"][name][way] for path in paths]) for way in WAYS}
            for name in shapers
        },
    }


def _way(found: list[Row]) -> dict[str, Any]:
    """Summarize one way to shape the paths; reductions only over those that count."""
    counted = [one for one in found if one["reduction_percent"] is not None]
    reductions = np.array([one["reduction_percent"] for one in counted])
    return {
        "peak_m_s2": percentiles([one["peak_m_s2"] for one in counted], median=50, p95=95),
        "reduction_percent": percentiles(reductions, median=50, p5=5, min=0),
        "reduction_percent_interval": interval(reductions, 50),
        **{name: percentiles([one[name] for one in found], **shares) for name, shares in SUMMARIZED.items()},
    }


def rows(group: dict[str, Any]) -> list[dict[str, Any]]:
    """Entries of the table of a group of the summary, without those that equal the one above."""
    return [
        {"name": name, "way": WAYS[way], **found}
        for name, ways in group["shapers"].items()
        for way, found in ways.items()
        if way == JOINTS or found != ways[JOINTS]
    ]


def title_of(kind: str, group: dict[str, Any]) -> str:
    """Title of a table of one kind of paths."""
    peak, (one, many) = group["unshaped_peak_m_s2"], IN_WORDS[kind]
    return (
        f"{group['paths']} {one if group['paths'] == 1 else many}, {group['counted']} of them with an unshaped peak of "
        f"{WORTH:g} m/s² or more, which count in the percentages; median {peak['median']:.2f} m/s²"
    )


def page_of(result: dict[str, Any], command: str) -> str:
    """Return the tables with explanations, as the body of a page."""
    kinds = [(kind, group) for kind, group in result["summary"].items() if kind != "all"]
    tables = [(title_of(*one), in_markdown(rows(one[1]), COLUMNS, left=2)) for one in kinds]
    in_words = circle_in_words(result["circle"])
    return page("paths", result, command, tables=tables, terms=TERMS, circle_in_words=in_words)
