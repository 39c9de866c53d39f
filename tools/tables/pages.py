"""What the templates of the pages need besides the result of their command."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from tools.tables.markdown import best_in_bold, in_markdown, markdown_table
from tvist_lab.studies import leaderboard, robustness
from tvist_lab.studies.arms.about import REDUCED, SIZE, frequencies
from tvist_lab.studies.paper.report import FIGURES, MEANINGS, METHODS, beside, methods, table_2
from tvist_lab.study.held_out import said
from tvist_lab.study.tables import Shown

ARMS = (
    Shown("name", lambda one: f"`{one['name']}`"), *SIZE,
    Shown("largest torques N m", lambda one: ", ".join(f"{torque:g}" for torque in one["torque_n_m"])),
    Shown("calibrations", lambda one: ", ".join(one["calibrations"])),
)  # fmt: skip
"""Columns of the table of arms."""
MEASUREMENTS = (
    Shown("arm", lambda one: f"`{one['name']}`"),
    Shown("springs", lambda one: f"{100.0 * (one['stiffness'] - 1.0):+.0f} %"), Shown("calibration", "calibration"),
    frequencies("f_d off by %"), Shown("moves", "counted"), Shown("too weak", "too_weak"), *REDUCED,
    Shown("sag off by %", "sag_error_percent", 2),
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
    rows: dict[str, dict[str, str]] = {}
    for one in result["summary"]:
        less = one["reduction_percent"]
        rows.setdefault(one["controller"], {})[one["shaper"]] = f"{less['median']:.1f} / {less['p5']:.1f}"
    heading = ("known friction", *next(iter(rows.values())))
    return {"table": markdown_table(heading, [(name, *cells.values()) for name, cells in rows.items()])}


def _robustness(result: dict[str, Any]) -> dict[str, Any]:
    columns = robustness.columns(result["hidden"])
    tables = {
        f"{'Plants by name' if kind == robustness.PLANT else f'Wrong {kind}'}: {share}": [
            *robustness.FIRST, *(Shown(one, f"{kind}.{one}.reduction_percent.{share}", 1) for one in those),
        ]
        for kind, those in columns.items()
        for share in ("median", "p5")
    }  # fmt: skip
    plants = [(one.name, one.label) for one, _ in columns[robustness.PLANT].values()]
    return {"tables": tables, "plants": plants}


def _shaperbench(result: dict[str, Any]) -> dict[str, Any]:
    name = Shown("shaper", lambda row: f"**{row['name']}**" if row["pareto"] else row["name"])
    columns = (name, *leaderboard.ON_TERMINAL[1:])
    return {"ranked": leaderboard.ranked(result), "columns": columns, "best_in_bold": best_in_bold}


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
        "tvist study robustness --against zv auto auto-target smoothing elastic elastic-16 elastic-auto "
        "zv_3_modes_frozen_at_end --moves 60 --seed 20261123",
        _robustness,
        "--output docs/reference/robustness.json --figures docs/images",
    ),
    "shaperbench": Page(
        "docs/reference/shaperbench.md",
        "tvist shaperbench --moves 100 --seed 0",
        _shaperbench,
        "--output docs/reference/leaderboard.json --figures docs/images",
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
