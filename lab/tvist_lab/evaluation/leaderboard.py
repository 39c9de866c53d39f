"""The benchmark's leaderboard, computed from scores."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tvist_lab.evaluation.arms import ARMS
from tvist_lab.evaluation.candidates import Candidate
from tvist_lab.evaluation.curves import Bend
from tvist_lab.evaluation.evaluate import WORTH
from tvist_lab.evaluation.moves import Move
from tvist_lab.evaluation.shaperbench import PAYLOAD_ERRORS, BenchJob, Score, Scores
from tvist_lab.recordings import Floats

KEPT = 1.003
"""Largest ratio of a peak to its limit that counts as within the limit [-]."""


def leaderboard(
    candidates: Sequence[Candidate],
    faults: Sequence[str | None],
    jobs: Sequence[BenchJob],
    done: Sequence[Scores],
    bent: Sequence[tuple[Bend, float | None]],
) -> dict[str, Any]:
    """Return the rows, ordered by the time until still; candidates that cannot be ranked come last.

    Args:
        candidates: Candidates, of which the first is waiting.
        faults: Result of `inspect` for each candidate.
        jobs: Jobs of the candidates without a fault.
        done: Results of these jobs.
        bent: Curved paths and their results.
    """
    by_candidate: dict[str, list[tuple[BenchJob, Scores]]] = {one.name: [] for one in candidates}
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
        row: dict[str, Any] = {
            "name": candidate.name,
            "label": candidate.label,
            "told_target": candidate.told_target,
            "ranked": fault is None,
        }
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
    """Key of the order: settling, then residual; a candidate that never settles comes last."""
    still = row["time_until_still_ms"]["median"]
    return (math.inf if still is None else still, row["residual_m_s2"]["median"])


def _beats(other: dict[str, Any], row: dict[str, Any]) -> bool:
    """Return whether another candidate is better in settling or residual, and worse in neither."""
    ours, theirs = _place(row), _place(other)
    return theirs != ours and theirs[0] <= ours[0] and theirs[1] <= ours[1]


def _row(
    mine: list[tuple[BenchJob, Scores]], basis: dict[tuple[Move, float, int], Score], bent: list[float]
) -> dict[str, Any]:
    pairs = [
        (score, basis[job.move, score.error, score.arm]) for job, scores in mine for score in scores.scores
    ]
    costs = [scores.cost for _, scores in mine if scores.cost is not None]
    accelerations = [scores.acceleration for _, scores in mine]
    velocities = [scores.velocity for _, scores in mine]
    delays = [1e3 * scores.delay for _, scores in mine]
    by_arm = {
        arm.name: _summary([pair for pair in pairs if pair[0].arm == number])
        for number, arm in enumerate(ARMS)
        if any(pair[0].arm == number for pair in pairs)
    }
    return {
        **_summary(pairs),
        "delay_ms": {"median": round(float(np.median(delays)), 6), "max": round(max(delays), 6)},
        "peak_acceleration_ratio": {"median": float(np.median(accelerations)), "max": max(accelerations)},
        "peak_velocity_ratio": {"median": float(np.median(velocities)), "max": max(velocities)},
        "keeps_limits": max(*accelerations, *velocities) <= KEPT,
        "path_error_mrad": 1e3 * max(bent) if bent else None,
        "cost_us": 1e6 * float(np.median(costs)) if costs else None,
        "by_arm": by_arm,
        "worst_arm": _worst(by_arm),
        "by_payload_error": {
            f"{100 * error:+.0f} %": _summary([pair for pair in pairs if pair[0].error == error])
            for error in PAYLOAD_ERRORS
            if any(pair[0].error == error for pair in pairs)
        },
    }


def _worst(by_arm: dict[str, dict[str, Any]]) -> dict[str, Any] | None:
    """Return the arm with the smallest median reduction; None if no arm vibrates enough for a percentage."""
    known = {
        name: one["reduction_percent"]
        for name, one in by_arm.items()
        if one["reduction_percent"]["median"] is not None
    }
    if not known:
        return None
    name = min(known, key=lambda arm: float(known[arm]["median"]))
    return {"name": name, "reduction_percent": known[name]}


def _summary(pairs: list[tuple[Score, Score]]) -> dict[str, Any]:
    """Summarize scores, each paired with the score of waiting for the same arm, move and payload."""
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
    """Percentile of times, some of which may be infinite; None if the percentile is."""
    found = float(np.percentile(values, share, method="higher"))
    return round(found, 6) if math.isfinite(found) else None
