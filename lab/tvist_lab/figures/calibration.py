"""Figures of an identification: its moves, the fit, and the modes over the workspace beside the true ones."""

from typing import Any

import numpy as np
import pinocchio as pin
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from tvist_controller.api.line import body
from tvist_lab.figures.style import (
    FAINT,
    INK,
    OF_SHAPED,
    OF_UNSHAPED,
    UNSHAPED,
    explain,
    legend,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.identification.jogs import JogPlan
from tvist_lab.identification.workspace_map import WorkspaceMap
from tvist_lab.recordings import Floats
from tvist_plant.model import rigid_model

LABELS = {
    "f_d_hz": ("$f_d$", "damped frequency of the lowest mode", "Hz"),
    "zeta": (r"$\zeta$", "damping ratio of the lowest mode", "–"),
}  # symbol, meaning and unit of each map, by its key
NARROW = 5.0  # width up to which maps are drawn one below the other [inch]
LEVELS = 9  # largest number of levels of a map


def move_plan_figure(plan: JogPlan) -> Figure:
    """Draw the arm from the side and from above: at present, in postures on the way, and where jogs end."""
    model = rigid_model(plan.arm.description, body(plan.arm.payloads[0]))
    data = model.createData()

    def line(q: Floats) -> Floats:
        pin.framesForwardKinematics(model, data, q)
        joints = [np.zeros(3), *(data.oMi[joint].translation for joint in range(1, model.njoints))]
        return np.array([*joints, data.oMf[model.getFrameId("flange")].translation])

    figure, axes = panels(1, 4.6, columns=2, share_x=False)
    passed = [line(q) for jog in plan.jogs for q in jog.way[:-1]]
    rings = [line(jog.q) for jog in plan.jogs]
    drawn = (
        ("Passed on the way", passed, {"color": tint(INK, 0.3)}),
        ("Rings here", rings, {"color": tint(OF_UNSHAPED.color, 0.5)}),
        ("Stands now", [line(plan.at)], {"color": OF_SHAPED.color, "linewidth": 2.5}),
    )
    for panel, across, what in ((axes[0], 2, "from the side"), (axes[1], 1, "from above")):
        for label, lines, how in drawn:
            for number, points in enumerate(lines):
                panel.plot(points[:, 0], points[:, across], label=None if number else label, **how)
        for number, points in enumerate(rings, 1):
            note(panel, str(number), (points[-1, 0], points[-1, across]), (3, 3))
        panel.margins(0.08)
        panel.set(aspect="equal", xlabel="x (m)", ylabel="z (m)" if across == 2 else "y (m)")
        title(panel, f"{plan.arm.description.robot.model} {what}")
    legend(figure, axes[0])
    return figure


def identified_figure(name: str, measured: Floats, fitted: Floats) -> Figure:
    """Draw the lowest mode at each ring-down: fitted to the others against fitted to this one alone.

    `measured` and `fitted` hold f_d [Hz] and ζ [-], shape (2, N); `name` is the calibration's.
    """
    figure, axes = panels(2, 7.6, share_x=False)
    for panel, own, others, quantity in zip(
        axes, measured, fitted, ("$f_d$ (Hz)", r"$\zeta$ (–)"), strict=True
    ):
        panel.axline((own[0], own[0]), slope=1.0, color=FAINT, linewidth=1.0, label="Equal")
        panel.plot(own, others, **OF_SHAPED.points(2.5, label="Lowest mode of a ring-down"))
        panel.set(xlabel=f"Measured {quantity}", ylabel=f"Fitted to the others {quantity}")
    title(axes[0], f"{name}: {measured.shape[1]} ring-downs")
    legend(figure, axes[0], {"$f_d$": "damped frequency", r"$\zeta$": "damping ratio"})
    return figure


def workspace_map_figure(found: WorkspaceMap, key: str, words: str) -> Figure:
    """Draw maps of "f_d_hz" or "zeta": identified, true, and the error; `words` complete the heading."""
    # Areas where the arm would touch itself or the floor are white. In a narrow figure the maps are stacked.
    symbol, meaning, unit = LABELS[key]
    if beside := rcParams["figure.figsize"][0] > NARROW:
        figure, axes = panels(1, 3.0, columns=3, share_x=False, share_y=True)
    else:
        figure, axes = panels(3, 8.4)
    identified, true = found.identified[key], found.true[key]
    error = np.abs(found.error(key))
    levels = _levels(float(np.nanmin([identified, true])), float(np.nanmax([identified, true])))
    _map(axes[0], found, identified, levels, "Identified", labelled=True)
    drawn = _map(axes[1], found, true, levels, "True", labelled=True)
    bar: dict[str, Any] = {"pad": 0.02, "aspect": 25.0, "format": lambda value, _: f"{value:.3g}"}
    figure.colorbar(drawn, ax=axes[:2], label=f"{symbol} ({unit})", **bar)
    levels = _levels(0.0, float(np.nanmax(error)))
    drawn = _map(axes[2], found, error, levels, "Size of the error", labelled=False)
    figure.colorbar(drawn, ax=axes[2:], label="Error (%)", **bar)
    rows, across = (name.replace("_", " ").capitalize() for name in found.names)
    for panel in axes if beside else axes[-1:]:
        panel.set_xlabel(f"{across} (°)")
    for panel in axes[:1] if beside else axes:
        panel.set_ylabel(f"{rows} (°)")
    explain(figure, {symbol: f"{meaning}; {words}"})
    return figure


def _map(
    panel: Axes, found: WorkspaceMap, values: Floats, levels: Floats, heading: str, *, labelled: bool
) -> QuadContourSet:
    """Draw filled contours with lines between them, and the robot's poses."""
    title(panel, heading)
    rows, across = (np.degrees(angles) for angles in found.angles)
    panel.grid(visible=False)
    drawn = panel.contourf(across, rows, values, levels=levels, cmap="cividis", extend="neither")
    inner = levels[1:-1]
    # White on the dark half of the colours, ink on the light one.
    colors = ["white" if place < 0.6 * len(inner) else INK for place in range(len(inner))]
    lines = panel.contour(across, rows, values, levels=inner, colors=colors, linewidths=0.7)
    small = 7.0 / 8.0 * rcParams["font.size"]
    for label in panel.clabel(lines, list(inner[::2]) if labelled else [], fmt="%.3g", fontsize=small):
        label.set_rotation(0.0)
    at: dict[tuple[float, float], list[str]] = {}
    for name, (row, column) in found.poses.items():
        at.setdefault((float(np.degrees(column)), float(np.degrees(row))), []).append(name)
    for place, names in at.items():
        dot: Any = {"color": UNSHAPED, "markeredgecolor": "white", "markersize": 5.0}
        panel.plot(*place, "o", clip_on=False, zorder=5, **dot)
        note(panel, ", ".join(names), place, (5, 4), fontsize=small)
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_major_locator(MultipleLocator(60.0))
    return drawn


def _levels(low: float, high: float) -> Floats:
    return np.asarray(MaxNLocator(LEVELS).tick_values(low, max(high, low + 1e-3 * abs(low) + 1e-6)))
