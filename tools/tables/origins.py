"""Origin of each figure: fitted to the paper, tuned to it, predicted, or not matched."""

from typing import Any

from tvist_lab.studies.paper.published import published

FITTED = "fitted"
TUNED = "tuned"
PREDICTED = "predicted"
NOT_MATCHED = "not matched"

MEANINGS = {
    FITTED: "a parameter of the arm was solved for to match this figure",
    TUNED: "a parameter was adjusted by hand until this figure was near the paper's",
    PREDICTED: "no parameter was adjusted for this figure",
    NOT_MATCHED: "the figure differs, and the table shows by how much",
}

OF_MOTION = (
    (
        "delay", "shaped", "delay_ms", "{:.1f} ms", PREDICTED, "half a damped period at the end, in whole ticks",
    ),
    (
        "RV unshaped", "unshaped", "residual_vibration_m_s2", "{:.2f} m/s²", TUNED,
        "share of the gears' wind-up that is fed forward",
    ),
    (
        "RV reduced by", "impact_percent", "residual_vibration", "{:.1f} %", TUNED,
        "width and share of fed-forward friction; the shaper itself was not changed",
    ),
    (
        "cycle time", "impact_percent", "cycle", "{:+.1f} %", NOT_MATCHED,
        "the direction is tuned with friction; the paper's tails of 0.5 to 1 s do not occur here",
    ),
    (
        "stabilisation", "impact_percent", "stabilisation", "{:+.1f} %", NOT_MATCHED,
        "a threshold of 0.03 mm on a creeping tail; the direction is right",
    ),
    (
        "overshoot", "impact_percent", "overshoot", "{:+.1f} %", NOT_MATCHED,
        "the same threshold; the direction is right",
    ),
)  # fmt: skip
"""Figures of each motion: name, place in Table 2, form, origin and reason."""


def origins(result: dict[str, Any]) -> list[tuple[str, str, str, str, str]]:
    """Return rows of the figure, the paper's value, ours, the origin of ours, and the reason.

    Args:
        result: Result of `report.as_dict`, with the truth.
    """
    theirs = published()
    rows = []
    for name, row in result["table_1"].items():
        paper = theirs["configurations"][name]
        true = f"{row['true_f_d_hz']:.2f} Hz, {row['true_zeta']:.3f}"
        rows.append((
            f"Table 1, {name}", f"{paper['f_d_hz']} Hz, {paper['zeta']}", true, FITTED,
            "stiffness of gears and gains of drives",
        ))  # fmt: skip
    low, high = result["f_d_range_hz"]
    rows.append((
        "span of f_d over the workspace", "6 to 15 Hz", f"{low:.1f} to {high:.1f} Hz", NOT_MATCHED,
        "only the lower end matches; bent poses of this arm are stiffer than the paper's stiffest",
    ))  # fmt: skip
    for motion, ours in result["table_2"].items():
        for name, kind, column, form, origin, remark in OF_MOTION:
            values = (one[kind][column] for one in (theirs["table_2"][motion], ours))
            paper, here = ("–" if value is None else form.format(value) for value in values)
            rows.append((f"{motion}, {name}", paper, here, origin, remark))
    rows.append((
        "figure 4, EI over 6 to 15 Hz", "36 %", "35.82 %", PREDICTED, "follows from the shaper's formula",
    ))  # fmt: skip
    return rows
