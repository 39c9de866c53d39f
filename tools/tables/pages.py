"""The documentation pages with tables: path, command, and the data of their templates."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from tools.tables.markdown import in_markdown, markdown_table
from tvist_lab.studies import bench, robustness
from tvist_lab.studies.arms.about import REDUCED, SIZE
from tvist_lab.studies.paper.report import MEANINGS, beside
from tvist_lab.study.columns import Column, across, cells
from tvist_lab.study.held_out import said

ARMS = (
    Column("name", lambda one: f"`{one['name']}`"), *SIZE,
    Column("largest torques N m", lambda one: ", ".join(f"{torque:g}" for torque in one["torque_n_m"])),
    Column("calibrations", lambda one: ", ".join(one["calibrations"])),
)  # fmt: skip
"""Columns of the table of arms."""
MEASUREMENTS = (
    Column("arm", lambda one: f"`{one['name']}`"),
    Column("springs", lambda one: f"{one['stiffness']:g}"),
    Column("f_d off by %", lambda one: f"{one['f_d_error_percent'][0]:.1f}"),
    Column("less %", lambda one: "/".join(cells([one], REDUCED[:2])[0])), *REDUCED[2:],
)  # fmt: skip
"""Columns of the table of measurements."""
METHOD = Column(
    "method",
    lambda one: f"{one['delay_ms']:.0f}, {one['peak_reduction_percent']:.1f}, {one['still_after_ms']:.0f}",
)
"""Cell of the table of the paper's methods."""
BOTH = Column("less", lambda one: "/".join(cells([one], (robustness.LESS, robustness.WORST))[0]))
"""Cell with the median and the 5th percentile of the reduction."""
FINE, ALIKE = ("-5 %", "+5 %"), ("zv_3_modes_frozen_at_end",)
"""Errors that the robustness page leaves out, and shapers that it shows by another name."""
LEFT_OUT = ("worst arm", "moving", "q̇/limit", "µs")
"""Columns of `tvist study bench` that its page leaves out."""


def _robots(result: dict[str, Any]) -> dict[str, Any]:
    measured = [
        {"name": one["name"], **found} for one in result["robots"] for found in one.get("measured", ())
    ]
    return {"measured": measured, "measurements": MEASUREMENTS}


def _paper(result: dict[str, Any]) -> dict[str, Any]:
    arms = [result, *result["others"]]
    of_origins, *rows = beside(arms)
    entries = [
        {"method": "waiting" if name == "unshaped" else result["methods"][name], "motion": motion, **row}
        for motion, found in result["baselines"].items()
        for name, row in found.items()
    ]
    methods = across(entries, "method", "motion", METHOD)
    return {
        "arms": arms,
        "methods_of": in_markdown(methods.entries, methods.columns),
        "meanings": MEANINGS,
        "origins": markdown_table(of_origins, rows),
    }


def _stiction(result: dict[str, Any]) -> dict[str, Any]:
    found = across(result["summary"], "controller", "shaper", BOTH)
    columns = (Column("known friction", "controller"), *found.columns[1:])
    return {"table": in_markdown(found.entries, columns, left=len(columns))}


def _robustness(result: dict[str, Any]) -> dict[str, Any]:
    found = robustness.cells(result)
    shown = {
        kind: [one for one in entries if one["error"] not in FINE and one["shaper"] not in ALIKE]
        for kind, entries in found.items()
    }
    return {
        "tables": {
            kind: across(entries, "shaper", "error", BOTH, [robustness.DELAY])
            for kind, entries in shown.items()
        }
    }


def _bench(result: dict[str, Any]) -> dict[str, Any]:
    name = Column("shaper", lambda one: f"**{one['shaper']}**" if one["pareto"] else one["shaper"])
    shown = [one for one in bench.COLUMNS if one.title not in LEFT_OUT]
    return {"ranked": bench.ranked(result), "columns": (name, *shown)}


@dataclass(frozen=True)
class Page:
    """A page of the documentation."""

    path: str  # path in the repository
    command: str  # command whose result it shows
    more: Callable[[dict[str, Any]], dict[str, Any]]  # returns what its template needs besides the result
    files: str = ""  # options for further files of the page
    result: str = ""  # path of the stored result; empty if it is not stored


PAGES = {
    "paper": Page("docs/results/paper.md", "tvist demo --runs 10 --seed 0", _paper),
    "arms": Page("docs/reference/robots.md", "tvist robots", lambda _: {"arms": ARMS}),
    "robots": Page("docs/results/robots.md", "tvist robots --measure --vary 50", _robots),
    "stiction": Page(
        "docs/results/stiction.md",
        "tvist study tools/tables/stiction.py",
        _stiction,
        "--output build/stiction",
    ),
    "robustness": Page(
        "docs/results/robustness.md",
        "tvist study robustness --shapers zv auto auto-target smoothing elastic elastic-16 elastic-auto "
        "zv_3_modes_frozen_at_end --seed 20261123",
        _robustness,
        "--output build/robustness --figures docs/images",
        "docs/results/robustness.json",
    ),
    "shaperbench": Page(
        "docs/results/shaperbench.md",
        "tvist study bench --moves 100",
        _bench,
        "--output build/bench --figures docs/images",
        "docs/results/leaderboard.json",
    ),
}
"""The pages by name, which is also the name of their template."""


def page_of(name: str, result: dict[str, Any]) -> str:
    """Return a page of `PAGES`; `result` is the output of its command with `--json`."""
    environment = Environment(  # noqa: S701  this is Markdown
        loader=PackageLoader("tools.tables", "templates"), undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.globals |= {"in_markdown": in_markdown, "markdown_table": markdown_table}
    held_out = said(result["seed"]) if "seed" in result else ""
    more = {"held_out": held_out, "command": PAGES[name].command, **result, **PAGES[name].more(result)}
    return environment.get_template(f"{name}.md.j2").render(more)
