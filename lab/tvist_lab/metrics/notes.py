"""Notes of many motions in few lines."""

from collections.abc import Sequence

from tvist_lab.metrics.table import MotionResult


def grouped_notes(results: Sequence[MotionResult]) -> list[str]:
    """Return one line for each note, with the figures and the numbers of the motions, from 1, that it concerns."""
    places: dict[str, dict[str, list[int]]] = {}
    for index, result in enumerate(results, 1):
        for name, note in result.notes.items():
            places.setdefault(note, {}).setdefault(name, []).append(index)
    lines = []
    for note, names in places.items():
        numbers = sorted({index for indices in names.values() for index in indices})
        which = (
            "all motions" if len(numbers) == len(results) > 1 else f"motion {', '.join(map(str, numbers))}"
        )
        lines.append(f"{which}, {', '.join(names)}: {note}")
    return lines
