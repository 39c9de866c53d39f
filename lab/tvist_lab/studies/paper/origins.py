"""Origin of each figure: fitted to the paper, tuned to it, predicted, or not matched."""

from collections.abc import Mapping, Sequence
from typing import Any

from tvist_lab.studies.paper.published import published

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
)
"""Figures of each motion: name, where in Table 2, form, and tolerance: relative, and what is granted in any case."""
ADJUSTED = {
    "UR5e": {"Table 1": FITTED, "RV unshaped": TUNED, "RV reduced by": TUNED},
    "UR5e_stiction": {"Table 1": FITTED} | dict.fromkeys([name for name, *_ in OF_MOTION[1:]], TUNED),
}
"""Which figures the parameters of an arm were fitted or tuned to, by its model; all others are predicted."""


def origins(robot: str, result: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return an entry for each figure: its name, the paper's value, that of an arm, and the origin of the latter.

    Args:
        robot: Model of the arm.
        result: Table 1, the span of f_d and Table 2 of the arm, see `report.as_dict`.
    """
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
