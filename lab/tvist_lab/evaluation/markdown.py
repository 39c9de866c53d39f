"""The benchmark's results as a page of the documentation."""

from collections.abc import Sequence
from typing import Any

COLUMNS = (
    "shaper", "still ms", "p90", "ring m/s²", "less %", "p5", "worst arm: less %", "delay ms", "in motion", "q̈/limit",
    "q̇/limit", "bend mrad", "µs",
)  # fmt: skip


def page(result: dict[str, Any], command: str) -> str:
    """Return all tables, with explanations of their columns.

    Args:
        result: What was measured, with the leaderboard.
        command: The command that made the page, as it was typed.
    """
    ranked = [row for row in result["shapers"] if row["ranked"]]
    arms = list(result["arms"])
    return f"""# ShaperBench

Measured on {result["date"]} by

```sh
{command}
```

The command also writes the numbers with all digits to [leaderboard.json](leaderboard.json). The bench has {
        result["moves"]
    } random
moves, seed {
        result["seed"]
    }, with payloads of 0 to 5 kg, of which 100, 110 and 90 % are declared to the controller, and {
        len(arms)
    } arms.
The calibration is `{result["calibration"]}`, which was made for the first of these.
[Evaluate a shaper](../how-to/evaluate-a-shaper.md) says how to add a shaper of your own.

{
        _table(
            COLUMNS,
            [
                [("**" + row["name"] + "**") if row["pareto"] else row["name"], *_figures(row)]
                for row in ranked
            ],
        )
    }

A shaper in bold keeps the limits, and no other shaper that keeps them is better in both *still* and *ring*. All figures
are medians over moves, arms and payload errors, except for the peaks and *bend*, which are maxima.{
        _told(ranked)
    }

![Time until still against residual vibration](../images/pareto.png)

- *still*: last time at which |α|, the true acceleration of the tool, exceeds 0.1 m/s², from the stop of the
  **unshaped** reference;
- *ring*: envelope of α from 3 to 60 Hz after the shaped reference's own stop; *less*: reduction of *ring* compared with
  waiting, for moves where waiting leaves at least 0.2 m/s²; *worst arm*: the arm with the smallest median of it;
- *in motion*: rms of the difference between α and that of the rigid arm, divided by the value for waiting;
- *q̈/limit*, *q̇/limit*: peaks of the shaped reference divided by the limits, which the unshaped reference uses fully. A
  robot plans its motions with less acceleration if a shaper exceeds 1 (`move_j` with `auto` and `short`); the bench
  does not;
- *bend*: largest distance in joint space between a path round a corner and the commanded path;
- *µs*: processor time per tick with its estimates, on the machine that made this page, under other load.

| name | description |
|---|---|
{chr(10).join(f"| {row['name']} | {row['label']} |" for row in result["shapers"])}

## Results by arm and payload error

The first two tables show the median time until still in ms, on each arm and with each payload error. The best of each
column is in bold.

{_by(ranked, "by_arm", arms, ("time_until_still_ms", "median"), 0)}

{_by(ranked, "by_payload_error", list(ranked[0]["by_payload_error"]), ("time_until_still_ms", "median"), 0)}

The other two tables show the median of *ring* in m/s².

{_by(ranked, "by_arm", arms, ("residual_m_s2", "median"), 3)}

{_by(ranked, "by_payload_error", list(ranked[0]["by_payload_error"]), ("residual_m_s2", "median"), 3)}

## The arms

| name | properties |
|---|---|
{chr(10).join(f"| {name} | {label} |" for name, label in result["arms"].items())}
"""


def _told(ranked: Sequence[dict[str, Any]]) -> str:
    """Return a sentence about the candidates that know the target of a move."""
    names = [f"`{row['name']}`" for row in ranked if row["told_target"]]
    if not names:
        return ""
    return f"""

These shapers are given the end of each move before it begins, and are checked for causality with this knowledge:
{", ".join(names)}. The end of a stream is unknown,
so the double S and frozen shapers cannot be used there, and `auto-target` uses the present position of the arm, as
`auto` does."""


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [" | ".join(columns), "|".join(["---"] + ["---:"] * (len(columns) - 1))]
    return "\n".join(f"| {line} |" for line in [*lines[:1], lines[1], *(" | ".join(row) for row in rows)])


def _figures(row: dict[str, Any]) -> list[str]:
    still, less = row["time_until_still_ms"], row["reduction_percent"]
    return [
        _said(still["median"], 0), _said(still["p90"], 0), _said(row["residual_m_s2"]["median"], 3),
        _said(less["median"], 1), _said(less["p5"], 1), _worst(row), _said(row["delay_ms"]["median"], 0),
        _said(row["in_motion_ratio"], 2), _said(row["peak_acceleration_ratio"]["max"], 3),
        _said(row["peak_velocity_ratio"]["max"], 3), _said(row["path_error_mrad"], 1), _said(row["cost_us"], 0),
    ]  # fmt: skip


def _worst(row: dict[str, Any]) -> str:
    worst = row["worst_arm"]
    return "–" if worst is None else f"{worst['name']}: {worst['reduction_percent']['median']:.1f}"


def _by(
    ranked: Sequence[dict[str, Any]], key: str, names: Sequence[str], path: tuple[str, str], digits: int
) -> str:
    """Return a table with one column for each name, and the best value of each in bold."""
    values = {row["name"]: [row[key][name][path[0]][path[1]] for name in names] for row in ranked}
    best = [
        min((column[place] for column in values.values() if column[place] is not None), default=None)
        for place in range(len(names))
    ]
    rows = [
        [name, *(_best(value, best[place], digits) for place, value in enumerate(column))]
        for name, column in values.items()
    ]
    return _table(("shaper", *names), rows)


def _best(value: float | None, best: float | None, digits: int) -> str:
    said = _said(value, digits)
    return f"**{said}**" if value is not None and value == best else said


def _said(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
