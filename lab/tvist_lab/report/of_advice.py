"""The web page of an advice."""

import math
from collections.abc import Sequence
from pathlib import Path

from tvist_lab.advice import Advice, command, verdict
from tvist_lab.figures.advice import advice_figures
from tvist_lab.figures.sheets import house_style
from tvist_lab.metrics import MeasuredRecording
from tvist_lab.report.page import PageTable, ReportPage, Section, picture

MODES = ("mode\nf_d Hz", "damping\nζ", "motions", "largest\nm/s²")
OPTIONS = ("shaper", "aimed at", "longer\nms", "left\n% rms", "by modes\n%", "still\nms after")
WORST = "The tool's acceleration after the stop that rings most: recorded, and predicted with the shaper."
COSTS = (
    "Each shaper that keeps the arm's limits: what it leaves of the vibration, against the time that it adds."
)
SHOWN = 16  # number of shapers in the table
WORDS = {
    "left": "rms of the tool's acceleration for up to 0.5 s after the shaped stop, over that after the unshaped one, "
    "by the recorded acceleration convolved with the shaper. Medians over the motions that ring.",
    "by modes": "The same by the modes that were fitted to each stop.",
    "aimed at": "Modes from the logs, the same for all motions or others for each; or what the robot itself estimated. "
    "Of repeated motions, one half is predicted from the modes of the other.",
    "still": "Time from the unshaped stop until the tool shakes by less than 0.1 m/s².",
    "longer": "Time by which the shaped motion ends later.",
}


def modes_rows(advice: Advice) -> list[tuple[str, ...]]:
    """Return the rows of the table of modes, with intervals on second lines."""
    return [
        (f"{one.f_d:.2f}\n({one.f_d_interval[0]:.2f}–{one.f_d_interval[1]:.2f})",
         f"{one.zeta:.3f}\n({one.zeta_interval[0]:.3f}–{one.zeta_interval[1]:.3f})",
         f"{one.motions} of {len(advice.ringing)}", f"{one.amplitude:.2f}")
        for one in advice.modes
    ]  # fmt: skip


def option_rows(advice: Advice) -> list[tuple[str, ...]]:
    """Return the rows of the table of shapers, the recommended one first, then by settling time."""
    best = [] if advice.best is None else [advice.best]
    return [
        (f"{one.name}{'' if one.keeps_limits else ' *'}", one.aim.scope, f"{1e3 * one.added_s:.0f}",
         f"{one.left_percent:.0f}", "–" if one.modes_percent is None else f"{one.modes_percent:.0f}",
         f"{1e3 * one.still_s:.0f}" if math.isfinite(one.still_s) else "–")
        for one in [*best, *(one for one in advice.options if one is not advice.best)][:SHOWN]
    ]  # fmt: skip


@house_style()
def advice_page(
    advice: Advice, logs: Sequence[MeasuredRecording], paths: Sequence[Path], typed: str
) -> ReportPage:
    """Build the page of an advice; `typed` is the command for its provenance."""
    said, lines = verdict(advice, logs), command(advice, logs)
    sections = []
    if advice.best is not None:
        drawn = [picture(*both) for both in zip(advice_figures(advice), (WORST, COSTS), strict=True)]
        sections.append(Section("What convinces", pictures=drawn))
    if lines:
        sections.append(Section("How to use it", points=lines))
    if advice.modes:
        sections.append(Section("What rings", tables=[PageTable(MODES, modes_rows(advice))]))
    if advice.options:
        caption = "* exceeds the limits of velocity and acceleration, and is not recommended"
        sections.append(Section("Shapers", tables=[PageTable(OPTIONS, option_rows(advice), caption)]))
        sections.append(Section("What the words mean", facts=WORDS, explains=True))
    if advice.refused:
        points = [f"{paths[file].name}, motion {number}: {why}" for file, number, why in advice.refused]
        sections.append(Section("Not measured", points=points))
    files = ", ".join(path.name for path in paths)
    sections.append(Section("This page", facts={"Logs": files, "Command": typed}))
    return ReportPage("Which shaper?", said, sections)
