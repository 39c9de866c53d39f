"""The experiment's results as plain values, together with the paper's."""

from typing import Any

import numpy as np

from tvist_lab.metrics import table_2, table_notes
from tvist_lab.studies.paper.experiment import Experiment, JudgedRun
from tvist_lab.studies.paper.methods import ACCELERATION
from tvist_lab.studies.paper.origins import origins
from tvist_lab.studies.paper.published import MOTIONS


def as_dict(done: Experiment) -> dict[str, Any]:
    """Return what `tvist paper --json` prints of an arm."""
    runs = done.of_table_2()
    result: dict[str, Any] = {
        "robot": done.info.model,
        "seed": done.seed,
        "runs": done.runs,
        "shaper": "zv",
        "estimator": "polynomial",
        "calibration": None if done.info.calibration is None else done.info.calibration.name,
        "f_d_range_hz": None if done.info.calibration is None else done.info.calibration.f_d_range,
        "table_1": done.table_1,
        "table_2": table_2(runs),
        "baselines": {motion: _methods(done, motion) for motion in MOTIONS},
        "methods": done.labels,
        "notes": table_notes(runs),
    }
    return result | {"origins": origins(done.info.model, result)}


def _methods(done: Experiment, motion: str) -> dict[str, dict[str, float | None]]:
    """Return the results of each method, the unshaped one first, which is what a robot that only waits achieves."""
    unshaped = done.judged[motion, "unshaped"]
    return {method: _row(judged, unshaped) for (ran, method), judged in done.judged.items() if ran == motion}


def _row(judged: list[JudgedRun], unshaped: list[JudgedRun]) -> dict[str, float | None]:
    residual = _mean([one.result.residual_vibration_m_s2 for one in judged])
    before = _mean([one.result.residual_vibration_m_s2 for one in unshaped])
    peak, peak_before = _mean([one.peak for one in judged]), _mean([one.peak for one in unshaped])
    still = _mean([one.still_after for one in judged])
    # The unshaped references of a motion start alike, so the later stop of the shaped one is its delay.
    started = [one.result.stop_s - one.result.start_s for one in judged]
    started_before = [one.result.stop_s - one.result.start_s for one in unshaped]
    return {
        "delay_ms": 1e3 * float(np.mean(started) - np.mean(started_before)),
        "residual_vibration_m_s2": residual,
        "residual_vibration_reduction_percent": _reduction(residual, before),
        "peak_m_s2": peak,
        "peak_reduction_percent": _reduction(peak, peak_before),
        "still_after_ms": None if still is None else 1e3 * still,
        "peak_acceleration_ratio": max(one.acceleration for one in judged) / ACCELERATION,
    }


def _mean(values: list[float | None]) -> float | None:
    """Mean; None if one value is not measurable, since the mean of the rest would be biased."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known and len(known) == len(values) else None


def _reduction(after: float | None, before: float | None) -> float | None:
    if after is None or before is None or before == 0.0:
        return None
    return 100.0 * (1.0 - after / before)
