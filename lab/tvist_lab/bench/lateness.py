"""Lateness over minutes, from a robot's telemetry of every second."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tvist_protocol.stream import Telemetry


def over_all(heard: Sequence[Telemetry]) -> dict[str, float]:
    """Lateness of all ticks that several telemetry messages cover [µs].

    The largest value is exact. The 99th percentile is an upper bound, which at most one tick in a hundred can have
    exceeded: in each second, no tick was later than the second's largest value, one in a hundred was later than its
    99th percentile, and half were later than its median.
    """
    if not heard:
        nothing = float("nan")
        return {"late_p50_us": nothing, "late_p99_us": nothing, "late_max_us": nothing}
    p50, p99, largest = np.array([(one.late_p50_us, one.late_p99_us, one.late_max_us) for one in heard]).T
    return {
        "late_p50_us": float(np.median(p50)),
        "late_p99_us": _bound(p50, p99, largest),
        "late_max_us": float(largest.max()),
    }


def missed_share(heard: Sequence[Telemetry]) -> float:
    """Share of the ticks due between the first and the last telemetry message that were missed [-]; NaN for none."""
    if not heard or heard[0].due_ticks is None or heard[-1].due_ticks is None:
        return float("nan")
    due = heard[-1].due_ticks - heard[0].due_ticks
    return (heard[-1].missed_ticks - heard[0].missed_ticks) / due if due else float("nan")


def _bound(p50: np.ndarray[Any, Any], p99: np.ndarray[Any, Any], largest: np.ndarray[Any, Any]) -> float:
    limits = np.unique(np.concatenate([p50, p99, largest]))
    for limit in limits:
        later = np.select([limit >= largest, limit >= p99, limit >= p50], [0.0, 0.01, 0.5], 1.0)
        if later.mean() <= 0.01:
            return float(limit)
    return float(limits[-1])
