"""Landings of all shapers on all surfaces: their figures, and a picture."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from proof.impact.landing import DEEP, PROGRAMS, Landing, landed
from tvist_lab.figures.files import save
from tvist_lab.figures.style import ALPHA, OF_ALPHA, SERIES, legend, panels, title
from tvist_lab.metrics.vibration import amplitude
from tvist_plant.plant import PERIOD

Landings = Mapping[tuple[str, float, str], Landing]
"""By program, stiffness and shaper."""
SHAPERS = ("none", "zv", "auto", "elastic")
SOFT, HARD = sorted(DEEP)
SHOWN = 0.5
"""Time after a stop that is drawn [s]."""


def landings(robot: str, shapers: Sequence[str], seed: int, progress: Callable[[str], None]) -> Landings:
    """Let a robot run each program on each surface with each shaper."""
    made: dict[tuple[str, float, str], Landing] = {}
    for program in PROGRAMS:
        for stiffness in DEEP:
            for shaper in shapers:
                progress(f"{program} with {shaper} on {stiffness:g} N/m")
                made[program, stiffness, shaper] = landed(robot, program, stiffness, shaper, seed)
    return made


def report(made: Landings) -> dict[str, Any]:
    """Return the rows of figures of each program, and of the rings of the moves."""
    rows: dict[str, list[dict[str, Any]]] = {**{name: [] for name in PROGRAMS}, "rings": []}
    for (program, stiffness, shaper), one in made.items():
        which = {"surface": f"{stiffness:g} N/m", "shaper": shaper}
        row = {**which, **one.impact()}
        if program == "guarded":
            row["rests_ms"] = 1e3 * PERIOD * (one.marks["down"] - one.touch())
        if program == "moves":
            air, free = one.ring("near", "up")
            touching, held = one.ring("pressed", None)
            rows["rings"].append(
                {**which, "in_air": air, "f_d_in_air": free, "touching": touching, "f_d_touching": held}
            )
        rows[program].append(row)
    return rows


def tables(result: Mapping[str, Any]) -> list[tuple[Sequence[str], Sequence[Sequence[str]]]]:
    """Return a table for each kind of row."""
    made: list[tuple[Sequence[str], Sequence[Sequence[str]]]] = []
    for name, rows in result.items():
        columns = list(rows[0])
        cells = [[_said(row[column]) for column in columns] for row in rows]
        made.append(([f"{name}: surface", *columns[1:]], cells))
    return made


def _said(value: str | float | None) -> str:
    return "" if value is None else value if isinstance(value, str) else f"{value:.3g}"


def draw(made: Landings, path: Path) -> None:
    """Draw the force of a landing on the hard surface, and the tool after a stop in air and on the soft one."""
    figure, (force, air, touching) = panels(3, 6.6, share_x=False)
    shapers = dict.fromkeys(shaper for _, _, shaper in made)
    for shaper, style in zip(shapers, SERIES, strict=False):
        look = style.line(label="unshaped" if shaper == "none" else shaper)
        one = made["moves", HARD, shaper]
        land = one.marks["land"]
        pressed = one.force[land : land + round(1.0 / PERIOD)]
        force.plot(PERIOD * np.arange(len(pressed)), pressed, **look)
        one = made["moves", SOFT, shaper]
        for panel, stop in ((air, "near"), (touching, "pressed")):
            alpha = amplitude(one.alpha[one.marks[stop] :][: round(SHOWN / PERIOD)])
            panel.plot(PERIOD * np.arange(len(alpha)), alpha, **look)
    force.set(xlim=(0.35, 1.0), ylim=(0.0, None), xlabel="Time since the move began (s)", ylabel="Force (N)")
    for panel, most in ((air, 1.0), (touching, 0.25)):
        panel.set(xlim=(0.0, SHOWN), ylim=(0.0, most), xlabel="Time since the stop (s)", ylabel=ALPHA)
    title(force, "A move that ends on a surface of 1e5 N/m")
    title(air, "The tool after a stop in the air")
    title(touching, "The tool after a stop on a surface of 1e4 N/m, in contact all the time")
    legend(figure, force, OF_ALPHA)
    save(figure, path)
