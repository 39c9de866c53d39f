"""ShaperBench's leaderboard, computed from rows, and the columns of its tables for each reader."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvist_lab.recordings import Floats
from tvist_lab.studies.shaperbench import PAYLOAD_ERRORS, Bend, fault_of
from tvist_lab.study.held_out import median_and_p5, percentiles
from tvist_lab.study.measures import WORTH
from tvist_lab.study.method import Method
from tvist_lab.study.tables import Entry, Shown
from tvist_lab.study.work import Row

KEPT = 1.003
"""Largest ratio of a peak to its limit that counts as within the limit [-]."""

Pair = tuple[Row, Row]
"""A row, and that of waiting for the same arm, move and payload."""


def leaderboard(
    methods: Sequence[Method],
    faults: Sequence[str | None],
    rows: Sequence[Row],
    bent: Sequence[tuple[Bend, float | None]],
) -> dict[str, Any]:
    """Return an entry for each method, ordered by the time until still; those that cannot be ranked come last.

    Args:
        methods: Methods, of which the first is waiting.
        faults: Result of `inspect` for each method.
        rows: Rows of the methods without a fault.
        bent: Curved paths and their results.
    """
    by_method: dict[str, list[Row]] = {one.name: [] for one in methods}
    for row in rows:
        by_method[row["shaper"]].append(row)
    basis = {_place_of(row): row for row in by_method[methods[0].name]}
    entries = []
    for method, known in zip(methods, faults, strict=True):
        mine = by_method[method.name]
        fault = known or next(
            (
                f"{why} (payload error {100 * row['payload_error']:+.0f} %)"
                for row in mine
                if (why := fault_of(row)) is not None
            ),
            None,
        )
        entry: dict[str, Any] = {
            "name": method.name,
            "label": method.label,
            "told_target": method.told_target,
            "ranked": fault is None,
        }
        if fault is not None:
            entries.append(entry | {"fault": fault})
            continue
        errors = [error for job, error in bent if job.method is method and error is not None]
        pairs = [(row, basis[_place_of(row)]) for row in mine]
        entries.append(entry | _entry(pairs, errors))
    ranked = sorted((entry for entry in entries if entry["ranked"]), key=_place)
    for place, entry in enumerate(ranked, 1):
        entry["place"] = place
        entry["pareto"] = entry["keeps_limits"] and not any(
            _beats(other, entry) for other in ranked if other["keeps_limits"]
        )
    return {"shapers": [*ranked, *(entry for entry in entries if not entry["ranked"])]}


def _place_of(row: Row) -> tuple[int, float, str]:
    return row["move"], row["payload_error"], row["arm"]


def _place(entry: dict[str, Any]) -> tuple[float, float]:
    """Key of the order: settling, then residual; a method that never settles comes last."""
    still = entry["time_until_still_ms"]["median"]
    return (math.inf if still is None else still, entry["residual_m_s2"]["median"])


def _beats(other: dict[str, Any], entry: dict[str, Any]) -> bool:
    """Return whether another method is better in settling or residual, and worse in neither."""
    ours, theirs = _place(entry), _place(other)
    return theirs != ours and theirs[0] <= ours[0] and theirs[1] <= ours[1]


def _entry(pairs: Sequence[Pair], bent: Sequence[float]) -> dict[str, Any]:
    # The reference is the same on all arms, so the first arm's row tells of it.
    first = [row for row, _ in pairs if row["arm"] == pairs[0][0]["arm"]]
    delays, accelerations, velocities, costs = (
        [row[name] for row in first if row[name] is not None]
        for name in (
            "declared_delay_ms",
            "reference_acceleration_ratio",
            "reference_velocity_ratio",
            "cost_us",
        )
    )
    by_arm = {
        arm: _summary([pair for pair in pairs if pair[0]["arm"] == arm])
        for arm in dict.fromkeys(row["arm"] for row, _ in pairs)
    }
    return {
        **_summary(pairs),
        "delay_ms": {"median": round(float(np.median(delays)), 6), "max": round(max(delays), 6)},
        "peak_acceleration_ratio": {"median": float(np.median(accelerations)), "max": max(accelerations)},
        "peak_velocity_ratio": {"median": float(np.median(velocities)), "max": max(velocities)},
        "keeps_limits": max(*accelerations, *velocities) <= KEPT,
        "path_error_mrad": 1e3 * max(bent) if bent else None,
        "cost_us": float(np.median(costs)) if costs else None,
        "by_arm": by_arm,
        "worst_arm": _worst(by_arm),
        "by_payload_error": {
            f"{100 * error:+.0f} %": _summary([pair for pair in pairs if pair[0]["payload_error"] == error])
            for error in PAYLOAD_ERRORS
            if any(row["payload_error"] == error for row, _ in pairs)
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


def _summary(pairs: Sequence[Pair]) -> dict[str, Any]:
    """Summarize rows, each paired with that of waiting for the same arm, move and payload."""
    still = np.array(
        [math.inf if row["time_until_still_ms"] is None else row["time_until_still_ms"] for row, _ in pairs]
    )
    worth = [
        100.0 * (1.0 - a["residual_m_s2"] / b["residual_m_s2"])
        for a, b in pairs
        if b["residual_m_s2"] >= WORTH
    ]
    return {
        "time_until_still_ms": {name: _time(still, share) for name, share in (("median", 50), ("p90", 90))},
        "never_still": int(np.isinf(still).sum()),
        "residual_m_s2": percentiles([row["residual_m_s2"] for row, _ in pairs], median=50, p90=90),
        "reduction_percent": median_and_p5(worth),
        "in_motion_ratio": float(np.median([a["in_motion_m_s2"] / b["in_motion_m_s2"] for a, b in pairs])),
    }


def _time(values: Floats, share: float) -> float | None:
    """Percentile of times, some of which may be infinite; None if the percentile is."""
    found = float(np.percentile(values, share, method="higher"))
    return round(found, 6) if math.isfinite(found) else None


def _worst_arm(entry: Entry) -> str | None:
    worst = entry["worst_arm"]
    return worst and f"{worst['name']} {worst['reduction_percent']['median']:.1f}"


_STARRED = Shown("shaper", lambda row: f"{row['name']} *" if row["pareto"] else row["name"])
_STILL = (Shown("still ms", "time_until_still_ms.median", 0), Shown("p90", "time_until_still_ms.p90", 0))
_LESS = (Shown("less %", "reduction_percent.median", 1), Shown("p5", "reduction_percent.p5", 1))
_RING = Shown("ring m/s²", "residual_m_s2.median", 3)
_DELAY = Shown("delay ms", "delay_ms.median", 0)
_PEAKS = (
    Shown("q̈/limit", "peak_acceleration_ratio.max", 3), Shown("q̇/limit", "peak_velocity_ratio.max", 3),
    Shown("bend mrad", "path_error_mrad", 1), Shown("µs", "cost_us", 0),
)  # fmt: skip
ON_TERMINAL = (
    _STARRED, *_STILL, _RING, *_LESS, Shown("worst arm", _worst_arm), _DELAY, Shown("moving", "in_motion_ratio", 2),
    *_PEAKS,
)  # fmt: skip
IN_REPORT = (
    _STARRED, Shown("still\nmedian ms", "time_until_still_ms.median", 0),
    Shown("still\np90 ms", "time_until_still_ms.p90", 0), Shown("vibration\nmedian m/s²", "residual_m_s2.median", 3),
    Shown("less than waiting\nmedian %", "reduction_percent.median", 1),
    Shown("less than waiting\np5 %", "reduction_percent.p5", 1), Shown("delay\nmedian ms", "delay_ms.median", 0),
    Shown("largest q̈\nof its limit", "peak_acceleration_ratio.max", 3),
)  # fmt: skip


def ranked(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the entries that have a place."""
    return [row for row in result["shapers"] if row["ranked"]]
