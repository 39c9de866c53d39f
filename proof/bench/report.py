"""Speed on this machine: figures beside references from the same run."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import msgspec

from proof.bench.figure import Figure
from proof.bench.line import line, whole_motion
from proof.bench.many_robots import memory
from proof.bench.programs import programs
from proof.bench.start import start
from tvist_lab.bench.machine import this_machine

Tell = Callable[[str], None]


PARTS: Mapping[str, Callable[[Tell], Mapping[str, Any]]] = {
    "line": line,
    "motion": whole_motion,
    "programs": programs,
    "start": start,
    "memory": memory,
}
"""The parts, in the order in which they are measured; the last two serve robots."""


def bench(tell: Tell, only: Collection[str] = PARTS) -> dict[str, Any]:
    """Measure.

    Args:
        tell: Called with a description of each measurement before it starts.
        only: Parts to measure.
    """
    found: dict[str, Any] = {}
    for name in only:
        found |= PARTS[name](tell)
    figures = {key: one for key, one in found.items() if isinstance(one, Figure)}
    values = {key: figures[key].value if key in figures else one for key, one in found.items()}
    machine = msgspec.to_builtins(this_machine())
    return {"machine": machine, "figures": msgspec.to_builtins(figures), **values}


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the table of figures with references, and one of the others."""
    figures = result["figures"]
    others = {key: value for key, value in result.items() if key not in {*figures, "figures", "machine"}}
    flat = {
        f"{key}: {name}" if name else key: one
        for key, value in others.items()
        for name, one in (value.items() if isinstance(value, dict) else [("", value)])
    }
    columns = ("figure", "value", "unit", "reference", "value", "ratio", "95 %", "n")
    return [
        (("machine", ""), [[key, _plain(value)] for key, value in result["machine"].items()]),
        (columns, [_row(one) for one in figures.values()]),
        (("without a reference", "figure"), [[key, f"{value:.4g}"] for key, value in flat.items()]),
    ]


def _plain(value: Any) -> str:
    """Return a text or a number; of several versions, a list."""
    return ", ".join(map(" ".join, value.items())) if isinstance(value, dict) else f"{value}"


def _row(one: dict[str, Any]) -> list[str]:
    ratio, low, high = one["compared"], one["low"], one["high"]
    return [
        one["what"],
        f"{one['value']:.4g}",
        one["unit"],
        one["reference"],
        f"{one['reference_value']:.4g}",
        "–" if ratio is None else f"{ratio:.3g}",
        "" if low is None else f"{low:.3g} to {high:.3g}",
        str(one["repetitions"]),
    ]
