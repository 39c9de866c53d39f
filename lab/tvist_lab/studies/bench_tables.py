"""Tables of ShaperBench: columns of its entries for each reader, and the best of each arm and error in bold."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from tvist_lab.markdown_table import markdown_table
from tvist_lab.study.tables import Entry, Shown


def _worst(colon: str) -> Shown:
    def text(entry: Entry) -> str | None:
        worst = entry["worst_arm"]
        return worst and f"{worst['name']}{colon} {worst['reduction_percent']['median']:.1f}"

    return Shown("worst arm", text)


def _starred(before: str, after: str) -> Shown:
    return Shown("shaper", lambda row: f"{before}{row['name']}{after}" if row["pareto"] else row["name"])


_STILL = (Shown("still ms", "time_until_still_ms.median", 0), Shown("p90", "time_until_still_ms.p90", 0))
_LESS = (Shown("less %", "reduction_percent.median", 1), Shown("p5", "reduction_percent.p5", 1))
_RING = Shown("ring m/s²", "residual_m_s2.median", 3)
_DELAY = Shown("delay ms", "delay_ms.median", 0)
_PEAKS = (
    Shown("q̈/limit", "peak_acceleration_ratio.max", 3), Shown("q̇/limit", "peak_velocity_ratio.max", 3),
    Shown("bend mrad", "path_error_mrad", 1), Shown("µs", "cost_us", 0),
)  # fmt: skip
ON_TERMINAL = (
    _starred("", " *"), *_STILL, _RING, *_LESS, _worst(""), _DELAY, Shown("moving", "in_motion_ratio", 2), *_PEAKS,
)  # fmt: skip
ON_PAGE = (
    _starred("**", "**"), *_STILL, _RING, *_LESS, Shown("worst arm: less %", _worst(":").of), _DELAY,
    Shown("in motion", "in_motion_ratio", 2), *_PEAKS,
)  # fmt: skip
IN_REPORT = (
    _starred("", " *"), *_STILL, Shown("vibration m/s²", "residual_m_s2.median", 3),
    Shown("less than waiting", "reduction_percent.median", 1, " %"), Shown("p5", "reduction_percent.p5", 1, " %"),
    _DELAY, Shown("largest q̈ / limit", "peak_acceleration_ratio.max", 3),
)  # fmt: skip


def ranked(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the entries that have a place."""
    return [row for row in result["shapers"] if row["ranked"]]


def best_in_bold(
    entries: Iterable[Entry], key: str, names: Sequence[str], path: tuple[str, str], digits: int
) -> str:
    """Return a table in Markdown with a column for each name, and the best value of each in bold."""
    values = {row["name"]: [row[key][name][path[0]][path[1]] for name in names] for row in entries}
    best = [
        min((column[place] for column in values.values() if column[place] is not None), default=None)
        for place in range(len(names))
    ]

    def cell(value: float | None, place: int) -> str:
        said = "–" if value is None else f"{value:.{digits}f}"
        return f"**{said}**" if value is not None and value == best[place] else said

    rows = [
        (name, *(cell(value, place) for place, value in enumerate(column))) for name, column in values.items()
    ]
    return markdown_table(("shaper", *names), rows, left=1)
