"""Compute and print the residual vibration of shapers for a wrong frequency."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Misuse, failing_on
from tvist_cli.figure_files import FigureOptions
from tvist_cli.output import number, out, table, write_json
from tvist_cli.shapers_of import of_impulses
from tvist_cli.studying import print_result

if TYPE_CHECKING:
    from tvist_shaping import Shaper

STANDARD = ("zv", "zvd", "ei")  # shapers of the paper's Figure 4
TABLED = (-0.2, -0.1, 0.0, 0.1, 0.2)  # frequency errors in the table [-]
POINTS = 401


def print_sensitivity(
    shapers: Sequence[str],
    zeta: float,
    errors: tuple[float, float],
    output: Path | None,
    figures: Path | None,
    look: FigureOptions,
    *,
    json: bool,
) -> None:
    """Compute and print residual vibration that shapers leave if they assume a wrong frequency of a mode."""
    import numpy as np

    from tvist_lab.figures import sensitivity_figure
    from tvist_lab.frequency_error import residual_over_error
    from tvist_shaping import ShapingError
    from tvist_shaping.impulse_train import check_mode

    low, high = errors
    if not -90.0 <= low < high <= 900.0:
        raise Misuse(f"errors is {low:g} {high:g}: must be two increasing percentages from -90 to 900")
    chosen = list({one.name: one for one in (of_impulses(name) for name in shapers or STANDARD)}.values())
    span = 0.01 * np.linspace(low, high, POINTS)
    curves: list[dict[str, Any]] = []
    for shaper in chosen:
        with failing_on(ShapingError, exit_code=2):
            check_mode(1.0, zeta, shaper.zeta_max)
            left = residual_over_error(shaper, zeta, span)
            about = _about(shaper, zeta)
        curves.append({**about, "residual_percent": (100.0 * left).tolist()})
    result = {"zeta": zeta, "error_percent": (100.0 * span).tolist(), "shapers": curves}
    if output is not None:
        write_json(output, result)
    look.write(figures, lambda: {"sensitivity": sensitivity_figure(chosen, zeta, span)})
    print_result(result, lambda: _print(chosen, zeta, curves), json=json)


def _print(shapers: "list[Shaper]", zeta: float, curves: list[dict[str, Any]]) -> None:
    import numpy as np

    from tvist_lab.frequency_error import residual_over_error

    rows = []
    for shaper, curve in zip(shapers, curves, strict=True):
        left = 100.0 * residual_over_error(shaper, zeta, np.array(TABLED))
        rows.append((
            shaper.name, number(curve["delay_periods"], 2), *(number(float(value), 1) for value in left),
            *(number(end, 1) for end in curve["error_of_5_percent"]),
        ))  # fmt: skip
    wrong = [f"{100.0 * error:+.0f} %" for error in TABLED]
    table(
        f"residual vibration in % when the assumed frequency is too high by, ζ = {zeta:g}",
        ("shaper", "delay", *wrong, "5 % from", "to"),
        rows,
    )
    out.print(
        "delay: in damped periods; 5 %: errors in percent between which at most that much vibration remains"
    )


def _about(shaper: "Shaper", zeta: float) -> dict[str, Any]:
    """Return name, delay, and the frequency errors between which ≤ 5 % vibration remains (None: no bound)."""
    low, high = shaper.band(0.05 * (1.0 + 1e-4), zeta)  # a peak of exactly 5 % counts as inside
    ends = [
        None if not math.isfinite(ratio) or ratio <= 0.0 else 100.0 * (1.0 / ratio - 1.0)
        for ratio in (high, low)
    ]
    return {
        "name": shaper.name,
        "delay_periods": shaper.impulses(1.0, zeta).duration,
        "error_of_5_percent": ends,
    }
