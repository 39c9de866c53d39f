"""Figure 2: a flexible actuator with an inertia that depends on a second angle."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

from tvist_lab.figures.style import (
    FAINT,
    INK,
    LIMIT,
    MUTED,
    SERIES,
    UNSHAPED,
    legend,
    note,
    panels,
    remark,
    title,
)
from tvist_lab.one_joint import OneJointModes, Plucked

APART = 0.62  # distance between the shoulders of neighbouring poses in the figure [m]
WORDS = ("\nincreased inertia", "", "\ndecreased inertia")
"""The paper's words for the first and the last pose."""
SPRING_TURNS = 2.5


def figure_2(modes: OneJointModes) -> Figure:
    """Draw the arm at three elbow angles, and its frequency and damping over that angle.

    Top: the arm from above, with its inertia about the shoulder. Below: f_d and ζ, as lines from the formula
    and as points from the simulated accelerometer after a pluck.
    """
    figure, (arms, frequencies, dampings) = panels(3, 7.2, share_x=False, ratios=(1.35, 1.25, 0.8))
    title(arms, f"The arm from above, with {modes.description.payload.mass:g} kg")
    upper, forearm = modes.description.kinematics.a
    for number, (pose, word) in enumerate(zip(modes.poses, WORDS, strict=True)):
        _draw_arm(arms, number * APART, upper, forearm, pose, word)
    note(arms, "Actuator with\nflexibility", (-0.09, 0.0), ha="right", va="center", wrap=False)
    arms.set(xlim=(-0.36, 2 * APART + 0.36), ylim=(-0.23, upper + forearm + 0.03), aspect="equal")
    arms.set_axis_off()
    masses = sorted({one.mass for one in modes.curve})
    for mass, style in zip(masses, SERIES, strict=False):
        here = [one for one in modes.curve if one.mass == mass]
        elbow = np.degrees([one.elbow for one in here])
        hollow = style.points(4.5, markerfacecolor="white", label=f"{mass:g} kg, simulated", zorder=3)
        for panel, name in ((frequencies, "f_d"), (dampings, "zeta")):
            formula, simulated = (
                [getattr(one, f"{kind}{name}") for one in here] for kind in ("", "simulated_")
            )
            panel.plot(elbow, formula, **style.line(1.6, label=f"{mass:g} kg, formula"))
            panel.plot(elbow, simulated, **hollow)
    for panel in (frequencies, dampings):
        panel.set(xlim=(-4.0, 154.0), xticks=np.arange(0.0, 151.0, 30.0))
        panel.set_ylim(bottom=0.0)
        for pose in modes.poses:
            panel.axvline(np.degrees(pose.elbow), color=FAINT, linewidth=0.9, linestyle=LIMIT)
    frequencies.set_ylabel("Damped frequency $f_d$ (Hz)")
    frequencies.tick_params(labelbottom=False)
    dampings.set(ylabel="Damping ratio ζ (–)", xlabel="Elbow $q$, 0 stretched out (°)")
    said = f"    simulated within {modes.worst_f_d:.2f} %"
    remark(frequencies, r"$f_d=\frac{1}{2\pi}\sqrt{\frac{K}{I(q)}\,}\sqrt{1-\zeta^2}$" + said, (0.02, 0.1))
    said = f"    simulated within {modes.worst_zeta:.1f} %"
    remark(dampings, r"$\zeta=\frac{D}{2\sqrt{K\,I(q)}}$" + said, (0.02, 0.14))
    symbols = {"$I$": "inertia about the shoulder", "$K$, $D$": "stiffness and damping of its flexible drive"}
    legend(figure, frequencies, symbols)
    figure.align_ylabels([frequencies, dampings])
    return figure


def _draw_arm(panel: Axes, x: float, upper: float, forearm: float, pose: Plucked, word: str) -> None:
    """Draw one pose with its shoulder at (x, 0), the upper arm upright and the forearm turned by the elbow."""
    elbow = pose.elbow
    tip = x + forearm * np.sin(elbow), upper + forearm * np.cos(elbow)
    panel.plot([x, x], [upper, upper + 0.62 * forearm], color=FAINT, linewidth=0.9, linestyle=LIMIT)
    panel.plot([x, x], [0.0, upper], color=INK, linewidth=9.0, solid_capstyle="round", zorder=2)
    panel.plot([x, tip[0]], [upper, tip[1]], color=MUTED, linewidth=7.0, solid_capstyle="round", zorder=3)
    for place, radius in (((x, upper), 0.022), (tip, 0.04), ((x, 0.0), 0.062)):
        panel.add_patch(Circle(place, radius, facecolor="white", edgecolor=INK, linewidth=1.4, zorder=4))
    angles = {"theta1": 90.0 - np.degrees(elbow), "theta2": 90.0}
    panel.add_patch(Arc((x, upper), 0.19, 0.19, **angles, color=INK, linewidth=1.0, zorder=5))
    turn = np.linspace(0.0, SPRING_TURNS * 2.0 * np.pi, 200)
    radius = 0.008 + 0.046 * turn / turn[-1]
    spring = x + radius * np.sin(turn), radius * np.cos(turn)
    panel.plot(*spring, color=UNSHAPED, linewidth=1.2, zorder=5)
    note(panel, f"$q$ = {np.degrees(elbow):.0f}°", (x - 0.02, upper + 0.1), ha="right", va="center")
    words = f"$I$ = {pose.inertia:.3f} kg m²{word}"
    panel.annotate(words, (x, -0.085), ha="center", va="top")
