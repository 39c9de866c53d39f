"""`tvist shapers`: list the input shapers, or compute their sensitivity."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Misuse, failing_on
from tvist_cli.figure_files import DEFAULT_FIGURES, FigureOptions
from tvist_cli.offered import SHAPERS as OFFERED
from tvist_cli.output import out, table
from tvist_cli.sensitivity import print_sensitivity
from tvist_cli.shapers_of import load_given
from tvist_cli.studying import print_result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tvist_shaping import Impulses
    from tvist_shaping.named import AnyShaper

F_D = 10.0  # damped frequency of the mode in the list [Hz]
ERRORS = (-40.0, 60.0)  # range of frequency errors for --sensitivity [%]
BANDS = {"5": 0.05, "10": 0.1}  # residual vibration that bounds each band [-], by its percentage
TOUCHING = 1.0 + 1e-4  # factor on the bound: rounding must not exclude a peak that just reaches the bound


def shapers(
    *,
    f_d: float = F_D,
    zeta: float = 0.0,
    shaper: Annotated[list[str] | None, OFFERED] = None,
    sensitivity: Annotated[list[str] | None, OFFERED, Parameter(consume_multiple=True)] = None,
    errors: tuple[float, float] = ERRORS,
    output: Path | None = None,
    figures: Path | None = None,
    look: FigureOptions = DEFAULT_FIGURES,
    json: bool = False,
) -> None:
    """List the input shapers that a robot can use, with their properties for one mode.

    Args:
        f_d: Set the damped frequency of the mode in Hz.
        zeta: Set the damping ratio of the mode.
        shaper: Add the shaper FILE.py:NAME to the list, repeatable; the file is executed.
        sensitivity: Compute instead the residual vibration of these shapers, names or FILE.py:NAME, if they
            assume a wrong frequency [zv zvd ei].
        errors: With --sensitivity, set the lowest and highest percentage by which the assumed frequency is too high.
        output: With --sensitivity, write the curves to this JSON file.
        figures: Write figures to this folder: residual vibration for a wrong frequency, and settling time
            against delay; with --sensitivity, the curves.
        look: How to write the figures.
        json: Print one JSON object.
    """
    look.check(figures, output)
    if sensitivity is None and (output is not None or errors != ERRORS):
        raise Misuse("--errors and --output are for --sensitivity: give it, or leave them out")
    if sensitivity is not None:
        if f_d != F_D:
            raise Misuse("--sensitivity does not depend on the frequency: leave --f-d out")
        if shaper:
            raise Misuse("--sensitivity takes the shapers as its values: leave --shaper out")
        print_sensitivity(sensitivity, zeta, errors, output, figures, look, json=json)
        return
    from tvist_shaping import BUILT_IN, SHAPERS, Registry, ShapingError
    from tvist_shaping.named import OF_SEVERAL_MODES, USES

    with failing_on(ShapingError, exit_code=2):
        SHAPERS["none"].function(f_d, zeta)
        own = Registry(load_given(place).shaper for place in shaper or []).own
    listed: list[AnyShaper] = [*SHAPERS.values(), *own.values()]
    others = [
        {
            "name": name, "description": description, "use": USES.get(name), "modes": BUILT_IN.modes_of(name),
            "feed_forward": BUILT_IN.feed_forward_of(name),
        }
        for name, description in OF_SEVERAL_MODES.items()
    ]  # fmt: skip
    found = [_about(one, f_d, zeta) for one in listed]
    result = {"f_d_hz": f_d, "zeta": zeta, "shapers": found, "for_calibrated_arms": others}
    look.write(figures, lambda: _figures(listed, f_d, zeta))
    print_result(result, lambda: _print(result), json=json)


def _figures(listed: "list[AnyShaper]", f_d: float, zeta: float) -> "dict[str, Figure]":
    from tvist_lab.figures import catalogue_figure, settling_against_delay_figure
    from tvist_shaping import Shaper

    of_impulses = [one for one in listed if isinstance(one, Shaper)]
    return {
        "shapers": catalogue_figure(of_impulses, zeta),
        "settling": settling_against_delay_figure(of_impulses, f_d, zeta),
    }


def _print(result: dict[str, Any]) -> None:
    table(
        f"input shapers for a mode of {result['f_d_hz']:g} Hz, ζ = {result['zeta']:g}",
        ("shaper", "impulses", "ms", "mean ms", "5 % band", "10 % band", "ζ ≤", "peak"),
        [_row(about) for about in result["shapers"]],
    )
    _list(result["shapers"])
    out.print("\nfor arms with a modal calibration, whose modes and springs they know:")
    _list(result["for_calibrated_arms"])
    out.print(
        "\nms: how much later a motion ends; mean ms: delay during motion at constant velocity;\n"
        "band: ratios of true to assumed frequency for which at most that much vibration remains;\n"
        "ζ ≤: largest damping ratio it supports; peak: largest factor on the reference's acceleration"
    )


def _list(entries: list[dict[str, Any]]) -> None:
    width = max(len(one["name"]) for one in entries)
    for one in entries:
        out.print(f"{one['name']:{width}}  {one['description']}")
        if use := one.get("use"):
            out.print(f"{'':{width}}  take it for {use}")


def _about(shaper: "AnyShaper", f_d: float, zeta: float) -> dict[str, Any]:
    """Return a shaper's properties for a mode, or why the shaper does not support the mode."""
    from tvist_shaping import ShapingError
    from tvist_shaping.failures import FAILURES, words
    from tvist_shaping.impulse_train import check_mode

    said: dict[str, Any] = {
        "name": shaper.name,
        "description": shaper.description,
        "duration_periods": getattr(shaper, "duration_periods", None),
        "zeta_max": getattr(shaper, "zeta_max", 1.0),
        "peak": shaper.peak,
    }
    try:
        impulses = shaper.impulses(f_d, zeta)
        check_mode(f_d, zeta, said["zeta_max"])
    except FAILURES as error:
        why = str(error) if isinstance(error, ShapingError) else f"it {words(error)}"
        return said | {"not_for_this_mode": why}
    return said | {
        "amplitudes": impulses.A.tolist(),
        "times_s": impulses.tau.tolist(),
        "duration_ms": 1000.0 * impulses.duration,
        "mean_delay_ms": 1000.0 * impulses.mean_delay,
        **{f"band_{percent}_percent": _band(impulses, f_d, V, zeta) for percent, V in BANDS.items()},
    }


def _band(impulses: "Impulses", f_d: float, V: float, zeta: float) -> list[float | None] | None:
    """Return lower and upper f/f_d of the band around f_d (upper None: unbounded); None: f_d is outside."""
    from tvist_shaping import band

    low, high = (f / f_d for f in band(impulses, f_d, zeta, V * TOUCHING))
    return None if math.isnan(low) else [low, high if math.isfinite(high) else None]


def _row(about: dict[str, Any]) -> tuple[str, ...]:
    limit, peak = f"{about['zeta_max']:g}", f"{about['peak']:g}"
    if "not_for_this_mode" in about:
        return about["name"], *("–" for _ in range(3 + len(BANDS))), limit, peak
    bands = (about[f"band_{percent}_percent"] for percent in BANDS)
    spans = (
        "–" if band is None else "–".join("∞" if end is None else f"{end:.3f}" for end in band)
        for band in bands
    )
    times = (f"{about[key]:.1f}" for key in ("duration_ms", "mean_delay_ms"))
    return about["name"], str(len(about["amplitudes"])), *times, *spans, limit, peak
