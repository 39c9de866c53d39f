"""Notes of many motions in few lines."""

import re
from collections.abc import Sequence

from tvist_lab.metrics.table import MotionResult

NAMED = 3
"""Largest number of motions that a line names; of more it says how many they are."""


def grouped_notes(results: Sequence[MotionResult]) -> list[str]:
    """Return one line for each kind of note, with the motions and figures it concerns.

    Notes that differ in their numbers alone are of one kind; the first one stands for all.
    """
    kinds: dict[str, dict[str, set[int]]] = {}
    first: dict[str, str] = {}
    for index, result in enumerate(results, 1):
        for name, note in result.notes.items():
            kind = re.sub(r"\d[\d.]*", "0", note)
            first.setdefault(kind, note)
            kinds.setdefault(kind, {}).setdefault(name, set()).add(index)
    lines = []
    for kind, names in kinds.items():
        numbers = sorted(set().union(*names.values()))
        which = f"motion {', '.join(map(str, numbers))}"
        if len(numbers) == len(results) > 1:
            which = "all motions"
        elif len(numbers) > NAMED:
            which = f"{len(numbers)} of {len(results)} motions"
        same = all(result.notes.get(name) in (None, first[kind]) for result in results for name in names)
        lines.append(f"{which}, {', '.join(names)}: {'' if same else 'as '}{first[kind]}")
    return lines
