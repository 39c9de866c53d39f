"""The experiment's results as values and table rows, beside the paper's, with the origin of each figure."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tvist_lab.metrics import table_2 as table_2_of
from tvist_lab.metrics import table_notes
from tvist_lab.metrics.comparison import MotionChange
from tvist_lab.studies.paper.experiment import ACCELERATION, Experiment, JudgedRun
from tvist_lab.studies.paper.published import MOTIONS, published
from tvist_lab.study.columns import Column, cells

FITTED = "fitted"
TUNED = "tuned"
PREDICTED = "predicted"
NOT_MATCHED = "not matched"

MEANINGS = {
    FITTED: "a parameter of the arm was solved for to match this figure",
    TUNED: "parameters of the arm were adjusted until this figure was near the paper's",
    PREDICTED: "no parameter was adjusted for this figure",
    NOT_MATCHED: "a value is off by more than its tolerance: 2 % in Table 1, 5 % for the span, 5 ms for the delay, "
    "20 % for RV and its reduction, 3 % for the cycle, 25 % or 40 ms for the stabilisation, 35 % or 0.015 mm for the "
    "overshoot",
}

_BOTH = ("unshaped", "shaped")
OF_MOTION = (
    ("delay", ("shaped",), "delay_ms", "{:.1f} ms", 0.0, 5.0),
    ("RV unshaped", ("unshaped",), "residual_vibration_m_s2", "{:.2f} m/s²", 0.2, 0.0),
    ("RV reduced by", ("impact_percent",), "residual_vibration", "{:.1f} %", 0.2, 0.0),
    ("cycle", _BOTH, "cycle_ms", "{:.0f} ms", 0.03, 0.0),
    ("stabilisation", _BOTH, "stabilisation_ms", "{:.0f} ms", 0.25, 40.0),
    ("overshoot", _BOTH, "overshoot_m", "{:.1e} m", 0.35, 1.5e-5),
)  # figures of each motion: name, place in Table 2, format, and relative and absolute tolerance
ADJUSTED = {
    "UR5e": {"Table 1": FITTED, "RV unshaped": TUNED, "RV reduced by": TUNED},
    "UR5e_stiction": {"Table 1": FITTED} | dict.fromkeys([name for name, *_ in OF_MOTION[1:]], TUNED),
}  # by model, the figures to which the arm's parameters were fitted or tuned; all others are predicted

FIGURES = ("delay ms", "stabilisation ms", "cycle ms", "overshoot m", "RV m/s²")
IMPACTS = ("stabilisation", "cycle", "overshoot", "residual_vibration")
"""Changes by shaping, in the order of these figures."""
METHODS = (
    Column("method", "label"), Column("delay ms", "delay_ms", 0), Column("RV m/s²", "residual_vibration_m_s2", 3),
    Column("peak m/s²", "peak_m_s2", 3), Column("less peak %", "peak_reduction_percent", 1),
    Column("still after ms", "still_after_ms", 0), Column("peak q̈ / limit", "peak_acceleration_ratio", 3),
)  # fmt: skip


def as_dict(done: Experiment) -> dict[str, Any]:
    """Return an arm's part of `tvist demo --json`."""
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
        "table_2": table_2_of(runs),
        "baselines": {motion: _methods(done, motion) for motion in MOTIONS},
        "methods": done.labels,
        "notes": table_notes(runs),
    }
    return result | {"origins": origins(done.info.model, result)}


def _methods(done: Experiment, motion: str) -> dict[str, dict[str, float | None]]:
    """Return the results of each method, first of the unshaped motion, which stands for waiting."""
    unshaped = done.judged[motion, "unshaped"]
    return {method: _row(judged, unshaped) for (ran, method), judged in done.judged.items() if ran == motion}


def _row(judged: list[JudgedRun], unshaped: list[JudgedRun]) -> dict[str, float | None]:
    residual = _mean([one.result.residual_vibration_m_s2 for one in judged])
    before = _mean([one.result.residual_vibration_m_s2 for one in unshaped])
    peak, peak_before = _mean([one.peak for one in judged]), _mean([one.peak for one in unshaped])
    # All references of a motion start at the same tick, so a later stop is the delay.
    started = [one.result.stop_s - one.result.start_s for one in judged]
    started_before = [one.result.stop_s - one.result.start_s for one in unshaped]
    return {
        "delay_ms": 1e3 * float(np.mean(started) - np.mean(started_before)),
        "residual_vibration_m_s2": residual,
        "residual_vibration_reduction_percent": MotionChange(before, residual).less_percent,
        "peak_m_s2": peak,
        "peak_reduction_percent": MotionChange(peak_before, peak).less_percent,
        "still_after_ms": _mean([one.result.still_after_ms for one in judged]),
        "peak_acceleration_ratio": max(one.result.peak_acceleration_rad_s2 or 0.0 for one in judged)
        / ACCELERATION,
    }


def _mean(values: list[float | None]) -> float | None:
    """Return the mean; None if one value is not measurable, since the mean of the rest would be biased."""
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known and len(known) == len(values) else None


def origins(robot: str, result: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return an entry for each figure of an arm: its name, the paper's value, the arm's, and the origin."""
    theirs, adjusted, entries = published(), ADJUSTED.get(robot, {}), []

    def compare(
        kind: str,
        place: str,
        form: str,
        values: Sequence[tuple[float, float | None]],
        share: float,
        least: float,
    ) -> None:
        near = all(
            here is not None and abs(here - paper) <= max(share * abs(paper), least) for paper, here in values
        )
        paper, here = (
            ", ".join("–" if value is None else form.format(value) for value in side)
            for side in zip(*values, strict=True)
        )
        origin = adjusted.get(kind, PREDICTED) if near else NOT_MATCHED
        entries.append({"figure": f"{place}{kind}", "paper": paper, "here": here, "origin": origin})

    for pose, row in result["table_1"].items():
        paper = theirs["configurations"][pose]
        values = [(paper["f_d_hz"], row.get("true_f_d_hz")), (paper["zeta"], row.get("true_zeta"))]
        compare("Table 1", f"{pose}, f_d in Hz and ζ of ", "{:.3g}", values, 0.02, 0.0)
    low, high = result["f_d_range_hz"] or (None, None)
    compare("span of f_d over the workspace", "", "{:.1f} Hz", [(6.0, low), (15.0, high)], 0.05, 0.0)
    for motion, table in result["table_2"].items():
        for name, kinds, column, form, share, least in OF_MOTION:
            values = [(theirs["table_2"][motion][kind][column], table[kind][column]) for kind in kinds]
            compare(name, f"{motion}, ", form, values, share, least)
    compare("figure 4, EI over 6 to 15 Hz", "", "{:.4g} %", [(36.0, 35.82)], 0.02, 0.0)
    return entries


def table_2(table: dict[str, Any], digits: int) -> list[tuple[str, ...]]:
    """Return the rows of Table 2: motion, kind and source, and the figures; RV has `digits` decimals."""
    forms = {
        "delay_ms": ".1f", "stabilisation_ms": ".1f", "cycle_ms": ".1f", "overshoot_m": ".1e",
        "residual_vibration_m_s2": f".{digits}f",
    }  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for motion, ours in table.items():
        both = (("paper", published()["table_2"][motion]), ("here", ours))
        for kind in ("unshaped", "shaped"):
            for who, source in both:
                figures = (_form(source[kind][key], form) for key, form in forms.items())
                rows.append((motion, f"{kind}, {who}", *figures))
        for who, source in both:
            percents = (_form(source["impact_percent"][key], "+.1f", " %") for key in IMPACTS)
            rows.append((motion, f"impact, {who}", "", *percents))
    return rows


def methods(result: dict[str, Any], motion: str, first: str) -> list[tuple[str, ...]]:
    """Return rows of a motion's method table; `first`, such as "**{}**", formats the method first at rest."""
    rows = result["baselines"][motion]
    known = [row["still_after_ms"] for row in rows.values() if row["still_after_ms"] is not None]
    soonest = min(known, default=None)

    def label(name: str) -> str:
        said = "waiting, unshaped" if name == "unshaped" else str(result["methods"][name])
        return first.format(said) if rows[name]["still_after_ms"] == soonest else said

    return cells([{"label": label(name), **row} for name, row in rows.items()], METHODS)


def beside(arms: Sequence[dict[str, Any]]) -> list[tuple[str, ...]]:
    """Return heading and rows of the table of origins, with the paper's figures and those of each arm."""
    heading = ("figure", "paper", *(title for one in arms for title in (one["robot"], "origin")))
    return [heading, *(
        (same[0]["figure"], same[0]["paper"], *(row[key] for row in same for key in ("here", "origin")))
        for same in zip(*(one["origins"] for one in arms), strict=True)
    )]  # fmt: skip


def _form(value: float | None, form: str, unit: str = "") -> str:
    return "–" if value is None else f"{value:{form}}{unit}"
