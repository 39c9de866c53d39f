"""ShaperBench: every shaper on eight arms, the same random moves, and payloads that are not quite what is declared."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin

from tvist_lab.evaluation.arms import ARMS
from tvist_lab.evaluation.baselines import baselines
from tvist_lab.evaluation.candidates import (
    Candidate,
    FromFile,
    Longer,
    Named,
    ShaperFaultError,
    Shaping,
    Task,
)
from tvist_lab.evaluation.causality import check_causal
from tvist_lab.evaluation.evaluate import WORTH
from tvist_lab.evaluation.line import PAPER, control_line, point_to_point, round_a_corner, simulate
from tvist_lab.evaluation.moves import Move, draw_moves
from tvist_lab.evaluation.recipes import Recipe
from tvist_lab.evaluation.workers import spread
from tvist_lab.metrics import (
    NotMeasurableError,
    best_tool_acceleration,
    envelope,
    in_motion_rms,
    motions,
    still_after,
)
from tvist_lab.metrics.common_clock import Kinematics
from tvist_lab.recordings import Floats, Recording
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import FLANGE, rigid_model
from tvist_plant.plant import PERIOD
from tvist_protocol.calibration import Calibration
from tvist_server.setup import body, paper_payload

PAYLOAD_ERRORS = (0.0, 0.1, -0.1)
"""Of the mass declared [-]."""
OWN = (
    ("zv", 1, "TVIST-ZV, lowest mode"),
    ("zv", 3, "TVIST-ZV, three modes"),
    ("zvd", 1, "TVIST-ZVD, lowest mode"),
    ("ei", 1, "TVIST-EI, lowest mode"),
    ("auto", 1, "constant mean delay, auto"),
    ("short", 1, "constant mean delay, short"),
)
"""Our shapers: name, modes, what they are."""
CORNERS = 5
"""Curved paths."""
KEPT = 1.003
"""A peak below this times its limit keeps it [-]."""


@dataclass(frozen=True)
class Job:
    """A move by one candidate with one payload error, on all arms."""

    description: RobotDescription
    candidate: Candidate
    move: Move
    """With the mass that is carried."""
    error: float
    """Of the mass declared [-]."""
    seed: int
    """Of gear errors and scatter."""
    arms: tuple[int, ...]
    """Numbers of the arms."""


@dataclass(frozen=True)
class Score:
    """One move on one arm."""

    arm: int
    error: float
    still: float
    """Time until still, from the stop of the unshaped reference; ∞ where it was not still when the rest ended [s]."""
    residual: float
    """Envelope of α within 3 to 60 Hz, largest after that stop and the shaper's delay [m/s²]."""
    in_motion: float
    """rms of α against the rigid arm [m/s²]."""


@dataclass(frozen=True)
class Scores:
    """What came of a job."""

    scores: tuple[Score, ...]
    delay: float
    """[s]."""
    acceleration: float
    """Peak over the limit of the reference [-]."""
    velocity: float
    """Likewise [-]."""
    cost: float | None
    """Of a tick [s]."""
    fault: str | None = None
    """Why there are no scores."""


def candidates(
    description: RobotDescription,
    calibration: Calibration,
    file: str | None,
    against: Sequence[str] | None,
) -> list[Candidate]:
    """Who stands on the bench.

    Args:
        description: The robot.
        calibration: With a modal model; all estimates are its.
        file: Path of a person's own shaper.
        against: Names of those to run beside waiting, which all are compared with; None: all.

    Raises:
        KeyError: There is none of a name.
    """
    waiting = Named(Recipe("none", calibration), "none", "waiting, unshaped")
    recipe = Recipe("zv", calibration)
    own = [
        Named(Recipe(name, calibration, modes=modes), name if modes == 1 else f"{name}_{modes}_modes", label)
        for name, modes, label in OWN
    ]
    last = next(one for one in own if one.name == "auto")
    ranged = baselines(recipe, description, (0.0, description.limits.payload))
    fixed = [Shaping(recipe, one, one.name, one.label) for one in ranged if one.shaper is not None]
    longer = [
        Longer(one, f"double_s_as_{one.name}", f"double S as long as {one.name}") for one in (own[0], last)
    ]
    every: list[Candidate] = [waiting, *longer, *fixed, *own]
    if against is not None:
        by_name = {one.name: one for one in every}
        every = [waiting, *(by_name[name] for name in against if name != waiting.name)]
    if file is not None:
        every.append(FromFile(file, recipe, "file", file))
    return every


def inspect(candidate: Candidate, description: RobotDescription, moves: Sequence[Move]) -> str | None:
    """Why a candidate cannot be ranked, found before anything moves; None where nothing was."""
    if not isinstance(candidate, Named | FromFile):
        return None  # a baseline may know its target
    for move in moves[:2]:
        try:
            check_causal(candidate, _task(description, move))
        except ShaperFaultError as fault:
            return str(fault)
    return None


def jobs(
    description: RobotDescription,
    candidates: Sequence[Candidate],
    moves: Sequence[Move],
    seed: int,
    *,
    quick: bool,
) -> list[Job]:
    """All of them: candidate by move by payload error; when it has to be quick, each move has one error in turn."""
    arms = tuple(range(len(ARMS)))
    errors = [
        (PAYLOAD_ERRORS[number % len(PAYLOAD_ERRORS)],) if quick else PAYLOAD_ERRORS
        for number in range(len(moves))
    ]
    return [
        Job(description, candidate, move, error, seed + number, arms)
        for candidate in candidates
        for number, move in enumerate(moves)
        for error in errors[number]
    ]


def play(jobs: Sequence[Job]) -> Iterator[Scores]:
    """Do all jobs in order, on all cores."""
    return spread(judge, jobs, few=2, chunk=1)


def judge(job: Job) -> Scores:
    """Shape once, and let every arm follow."""
    description, move = job.description, job.move
    declared = move.mass * (1.0 + job.error)
    task = _task(description, replace(move, mass=declared))
    start, carried = np.array(move.start), body(paper_payload(description, move.mass))
    believed = body(paper_payload(description, declared))
    try:
        shaped = job.candidate.shaped(task)
    except ShaperFaultError as fault:
        return Scores((), 0.0, 0.0, 0.0, None, str(fault))
    scores = []
    for number in job.arms:
        arm = ARMS[number].make(description, carried, job.seed)
        cycle = control_line(description, start, believed, carried, arm)
        recording = simulate(cycle, start, task.reference, shaped.q, job.seed, shaped.delay)
        scores.append(_score(number, job, recording))
    qd, qdd = np.diff(shaped.q, axis=0) / PERIOD, np.diff(shaped.q, 2, axis=0) / PERIOD**2
    return Scores(
        tuple(scores),
        shaped.delay,
        float(np.abs(qdd).max()) / PAPER.acceleration,
        float(np.abs(qd).max()) / PAPER.velocity,
        shaped.cost,
    )


def _score(number: int, job: Job, recording: Recording) -> Score:
    motion = motions(recording)[0]
    try:
        still = still_after(recording, motion) - motion.duration(recording)
    except NotMeasurableError:
        still = math.inf
    # The published target is a tick late.
    declared = recording["shaper_delay"][motion.reference_stop]
    after = motion.reference_stop + 1 + math.ceil(declared / recording.period - 1e-6)
    ringing = envelope(best_tool_acceleration(recording)[after + 1 :], recording.period)
    return Score(
        arm=number,
        error=job.error,
        still=still,
        residual=float(ringing.max()),
        in_motion=in_motion_rms(recording, motion, kinematics(job.description)),
    )


def _task(description: RobotDescription, move: Move) -> Task:
    return Task(description, move, point_to_point(np.array(move.start), np.array(move.target)))


def kinematics(description: RobotDescription) -> Kinematics:
    """Where the flange of the rigid arm is."""
    model = rigid_model(description, Payload())
    data, flange = model.createData(), model.getFrameId(FLANGE)

    def at(q: Floats) -> tuple[Floats, Floats]:
        pin.forwardKinematics(model, data, q)
        placement = pin.updateFramePlacement(model, data, flange)
        return placement.translation.copy(), placement.rotation.copy()

    return at


@dataclass(frozen=True)
class Bend:
    """A curved path by one candidate."""

    description: RobotDescription
    candidate: Candidate
    corner: tuple[Move, Move]
    """The second goes on where the first ends."""


def bends(
    description: RobotDescription, candidates: Sequence[Candidate], moves: Sequence[Move]
) -> list[Bend]:
    """Every candidate that shapes references, on each of a few moves that go on to where the next one starts."""
    paths = [
        (first, replace(second, start=first.target, target=second.start, mass=first.mass))
        for first, second in zip(moves[:CORNERS], [*moves[1:], moves[0]], strict=False)
    ]
    return [
        Bend(description, candidate, path)
        for candidate in candidates
        if not isinstance(candidate, Longer)
        for path in paths
    ]


def bend(job: Bend) -> float | None:
    """How far a candidate leaves a curved path [rad]; None where it cannot be ranked."""
    first, second = job.corner
    start, corner, target = (np.array(q) for q in (first.start, first.target, second.target))
    reference = round_a_corner(start, corner, target)
    whole = Move(first.start, second.target, first.mass)
    try:
        return path_error(reference, job.candidate.shaped(Task(job.description, whole, reference)).q)
    except ShaperFaultError:
        return None


def path_error(path: Floats, q: Floats) -> float:
    """Largest distance of points from a path in joint space, whatever the time [rad].

    Args:
        path: Its corners, shape (T, n) [rad].
        q: Points, shape (T', n) [rad].
    """
    start, way = path[:-1], np.diff(path, axis=0)
    moving = np.linalg.norm(way, axis=1) > 0.0
    start, way = start[moving], way[moving]
    square = np.sum(way**2, axis=1)
    largest = 0.0
    for point in q[::4]:
        share = np.clip(np.sum((point - start) * way, axis=1) / square, 0.0, 1.0)
        nearest = np.min(np.sum((start + share[:, None] * way - point) ** 2, axis=1))
        largest = max(largest, float(nearest))
    return math.sqrt(largest)


def leaderboard(
    candidates: Sequence[Candidate],
    faults: Sequence[str | None],
    jobs: Sequence[Job],
    done: Sequence[Scores],
    bent: Sequence[tuple[Bend, float | None]],
) -> dict[str, Any]:
    """Rows, the earliest still first; those that cannot be ranked at the end.

    Args:
        candidates: The first is waiting.
        faults: One a candidate, of `inspect`.
        jobs: Of those without a fault.
        done: What came of them.
        bent: Curved paths and what came of them.
    """
    by_candidate: dict[str, list[tuple[Job, Scores]]] = {one.name: [] for one in candidates}
    for job, scores in zip(jobs, done, strict=True):
        by_candidate[job.candidate.name].append((job, scores))
    basis = {
        (job.move, score.error, score.arm): score
        for job, scores in by_candidate[candidates[0].name]
        for score in scores.scores
    }
    rows = []
    for candidate, known in zip(candidates, faults, strict=True):
        mine = by_candidate[candidate.name]
        fault = known or next(
            (
                f"{scores.fault} (payload error {100 * job.error:+.0f} %)"
                for job, scores in mine
                if scores.fault
            ),
            None,
        )
        row: dict[str, Any] = {"name": candidate.name, "label": candidate.label, "ranked": fault is None}
        if fault is not None:
            rows.append(row | {"fault": fault})
            continue
        errors = [error for job, error in bent if job.candidate is candidate and error is not None]
        rows.append(row | _row(mine, basis, errors))
    ranked = sorted((row for row in rows if row["ranked"]), key=_place)
    for place, row in enumerate(ranked, 1):
        row["place"] = place
        row["pareto"] = row["keeps_limits"] and not any(
            _beats(other, row) for other in ranked if other["keeps_limits"]
        )
    return {"shapers": [*ranked, *(row for row in rows if not row["ranked"])]}


def _place(row: dict[str, Any]) -> tuple[float, float]:
    """Settling, then residual; what is never still comes last."""
    still = row["time_until_still_ms"]["median"]
    return (math.inf if still is None else still, row["residual_m_s2"]["median"])


def _beats(other: dict[str, Any], row: dict[str, Any]) -> bool:
    """Whether another is better in settling or residual and worse in neither."""
    ours, theirs = _place(row), _place(other)
    return theirs != ours and theirs[0] <= ours[0] and theirs[1] <= ours[1]


def _row(
    mine: list[tuple[Job, Scores]], basis: dict[tuple[Move, float, int], Score], bent: list[float]
) -> dict[str, Any]:
    pairs = [
        (score, basis[job.move, score.error, score.arm]) for job, scores in mine for score in scores.scores
    ]
    costs = [scores.cost for _, scores in mine if scores.cost is not None]
    accelerations = [scores.acceleration for _, scores in mine]
    velocities = [scores.velocity for _, scores in mine]
    delays = [1e3 * scores.delay for _, scores in mine]
    return {
        **_summary(pairs),
        "delay_ms": {"median": round(float(np.median(delays)), 6), "max": round(max(delays), 6)},
        "peak_acceleration_ratio": {"median": float(np.median(accelerations)), "max": max(accelerations)},
        "peak_velocity_ratio": {"median": float(np.median(velocities)), "max": max(velocities)},
        "keeps_limits": max(*accelerations, *velocities) <= KEPT,
        "path_error_mrad": 1e3 * max(bent) if bent else None,
        "cost_us": 1e6 * float(np.median(costs)) if costs else None,
        "by_arm": {
            arm.name: _summary([pair for pair in pairs if pair[0].arm == number])
            for number, arm in enumerate(ARMS)
            if any(pair[0].arm == number for pair in pairs)
        },
        "by_payload_error": {
            f"{100 * error:+.0f} %": _summary([pair for pair in pairs if pair[0].error == error])
            for error in PAYLOAD_ERRORS
            if any(pair[0].error == error for pair in pairs)
        },
    }


def _summary(pairs: list[tuple[Score, Score]]) -> dict[str, Any]:
    """Of scores, each with that of waiting on the same arm, move and payload."""
    still = np.array([1e3 * score.still for score, _ in pairs])
    worth = [100.0 * (1.0 - a.residual / b.residual) for a, b in pairs if b.residual >= WORTH]
    return {
        "time_until_still_ms": {name: _time(still, share) for name, share in (("median", 50), ("p90", 90))},
        "never_still": int(np.isinf(still).sum()),
        "residual_m_s2": _percentiles([score.residual for score, _ in pairs], median=50, p90=90),
        "reduction_percent": _percentiles(worth, median=50, p5=5) if worth else {"median": None, "p5": None},
        "in_motion_ratio": float(np.median([a.in_motion / b.in_motion for a, b in pairs])),
    }


def _percentiles(values: Sequence[float], **shares: float) -> dict[str, float]:
    return {name: float(np.percentile(values, share)) for name, share in shares.items()}


def _time(values: Floats, share: float) -> float | None:
    """Percentile of times of which some may be endless; None where it is."""
    found = float(np.percentile(values, share, method="higher"))
    return round(found, 6) if math.isfinite(found) else None


def draw(description: RobotDescription, count: int, seed: int) -> list[Move]:
    """The moves of the bench, each with a payload of its own up to what the arm is rated for."""
    return draw_moves(description, count, seed, (0.0, description.limits.payload)).moves
