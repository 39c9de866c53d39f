"""What the templates of the pages need besides the result of their command."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from tools.tables.markdown import in_markdown, markdown_table
from tvist_lab.studies import bench, robustness
from tvist_lab.studies.arms.about import REDUCED, SIZE, frequencies
from tvist_lab.studies.paper.report import FIGURES, MEANINGS, METHODS, beside, methods, table_2
from tvist_lab.study.columns import Column, across
from tvist_lab.study.held_out import said

ARMS = (
    Column("name", lambda one: f"`{one['name']}`"), *SIZE,
    Column("largest torques N m", lambda one: ", ".join(f"{torque:g}" for torque in one["torque_n_m"])),
    Column("calibrations", lambda one: ", ".join(one["calibrations"])),
)  # fmt: skip
"""Columns of the table of arms."""
MEASUREMENTS = (
    Column("arm", lambda one: f"`{one['name']}`"),
    Column("springs", lambda one: f"{100.0 * (one['stiffness'] - 1.0):+.0f} %"), Column("calibration", "calibration"),
    frequencies("f_d off by %"), Column("moves", "counted"), Column("too weak", "too_weak"), *REDUCED,
    Column("sag off by %", "sag_error_percent", 2),
)  # fmt: skip
"""Columns of the table of measurements."""


def _robots(result: dict[str, Any]) -> dict[str, Any]:
    measured = [
        {"name": one["name"], **found} for one in result["robots"] for found in one.get("measured", ())
    ]
    return {"arms": ARMS, "measured": measured, "measurements": MEASUREMENTS}


def _paper(result: dict[str, Any]) -> dict[str, Any]:
    headings, arms = [column.title for column in METHODS], [result, *result["others"]]
    of_origins, *rows = beside(arms)
    return {
        "arms": arms,
        "second": [markdown_table(("motion", "", *FIGURES), table_2(one["table_2"], 2)) for one in arms],
        "methods_of": {
            motion: markdown_table(headings, methods(result, motion, "**{}**"))
            for motion in result["baselines"]
        },
        "meanings": MEANINGS,
        "origins": markdown_table(of_origins, rows),
    }


def _stiction(result: dict[str, Any]) -> dict[str, Any]:
    found = across(result["summary"], "controller", "shaper", robustness.BOTH)
    columns = (Column("known friction", "controller"), *found.columns[1:])
    return {"table": in_markdown(found.entries, columns, left=len(columns))}


def _robustness(result: dict[str, Any]) -> dict[str, Any]:
    shown = (robustness.LESS, robustness.WORST)
    tables = [table for kind in robustness.errors() for table in robustness.tables(result, kind, shown)]
    named = dict.fromkeys(one["error"] for one in robustness.cells(result)[robustness.PLANT])
    return {"tables": tables, "plants": [(name, result["arms"][name]) for name in named]}


def _bench(result: dict[str, Any]) -> dict[str, Any]:
    ranked = bench.ranked(result)
    name = Column("shaper", lambda one: f"**{one['shaper']}**" if one["pareto"] else one["shaper"])
    order = [one["shaper"] for one in ranked]
    apart = {"arm": result["by_arm"], "error": [
        one | {"error": f"{100.0 * one['payload_error']:+.0f} %"} for one in result["by_payload_error"]
    ]}  # fmt: skip

    def best(key: str, cell: Column) -> str:
        those = sorted(
            (one for one in apart[key] if one["shaper"] in order), key=lambda one: order.index(one["shaper"])
        )
        found = across(those, "shaper", key, cell, best=True)
        return in_markdown(found.entries, found.columns)

    return {
        "ranked": ranked, "columns": (name, *bench.COLUMNS),
        "tables": {one.title: [best(key, one) for key in apart] for one in (bench.STILL, bench.RING)},
    }  # fmt: skip


@dataclass(frozen=True)
class Page:
    """A page of the documentation."""

    path: str
    """Where it is in the repository."""
    command: str
    """The command whose result it shows."""
    more: Callable[[dict[str, Any]], dict[str, Any]]
    """Returns what its template needs besides the result."""
    files: str = ""
    """Options for the other files that belong to the page."""
    result: str = ""
    """Where the result is kept; empty if it is not."""


PAGES = {
    "paper": Page("docs/reference/paper.md", "tvist demo --runs 10 --seed 0", _paper),
    "robots": Page("docs/reference/robots.md", "tvist robots --measure --vary 50", _robots),
    "stiction": Page(
        "docs/reference/stiction.md",
        "tvist study tools/tables/stiction.py",
        _stiction,
        "--output build/stiction",
    ),
    "robustness": Page(
        "docs/reference/robustness.md",
        "tvist study robustness --shapers zv auto auto-target smoothing elastic elastic-16 elastic-auto "
        "zv_3_modes_frozen_at_end --seed 20261123",
        _robustness,
        "--output build/robustness --figures docs/images",
        "docs/reference/robustness.json",
    ),
    "shaperbench": Page(
        "docs/reference/shaperbench.md",
        "tvist study bench --moves 100",
        _bench,
        "--output build/bench --figures docs/images",
        "docs/reference/leaderboard.json",
    ),
}
"""The pages by name, which is also that of their template."""


def page_of(name: str, result: dict[str, Any]) -> str:
    """Return a page.

    Args:
        name: One of `PAGES`.
        result: What its command prints with `--json`.
    """
    environment = Environment(  # noqa: S701  this is Markdown
        loader=PackageLoader("tools.tables", "templates"), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.globals |= {"in_markdown": in_markdown, "markdown_table": markdown_table}
    held_out = said(result["seed"]) if "seed" in result else ""
    more = {"held_out": held_out, "command": PAGES[name].command, **result, **PAGES[name].more(result)}
    return environment.get_template(f"{name}.md.j2").render(more)
