"""Figure 2: an actuator with flexibility, and an inertia that depends on a second angle."""

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
from tvist_lab.one_joint.plucks import Modes, Plucked
from tvist_lab.recordings import Floats

APART = 0.62
"""Distance between the shoulders of two poses that are drawn side by side [m]."""
WORDS = ("increased inertia", "", "decreased inertia")
"""The paper's words for the first and the last pose."""
SPRING_TURNS = 2.5


def figure_2(modes: Modes) -> Figure:
    """Draw the arm at the three angles of the elbow, and its frequency and damping over that angle.

    Top: the arm from above, with its inertia about the shoulder. Below: f_d and ζ by the formula, as lines, and as the
    simulated arm's accelerometer tells them after a pluck, as points.

    Args:
        modes: What was computed and measured.
    """
    figure, (arms, frequencies, dampings) = panels(3, 7.2, share_x=False, ratios=(1.35, 1.25, 0.8))
    _draw_arms(arms, modes)
    masses = sorted({one.mass for one in modes.curve})
    for mass, style in zip(masses, SERIES, strict=False):
        here = [one for one in modes.curve if one.mass == mass]
        elbow = np.degrees([one.elbow for one in here])
        for panel, formula, simulated in (
            (frequencies, [one.f_d for one in here], [one.simulated_f_d for one in here]),
            (dampings, [one.zeta for one in here], [one.simulated_zeta for one in here]),
        ):
            panel.plot(elbow, formula, **style.line(1.6, label=f"{mass:g} kg, formula"))
            panel.plot(
                elbow,
                simulated,
                **style.points(4.5, markerfacecolor="white", label=f"{mass:g} kg, simulated", zorder=3),
            )
    for panel in (frequencies, dampings):
        panel.set(xlim=(-4.0, 154.0), xticks=np.arange(0.0, 151.0, 30.0))
        panel.set_ylim(bottom=0.0)
        for pose in modes.poses:
            panel.axvline(np.degrees(pose.elbow), color=FAINT, linewidth=0.9, linestyle=LIMIT)
    frequencies.set_ylabel("Damped frequency $f_d$ (Hz)")
    frequencies.tick_params(labelbottom=False)
    dampings.set(ylabel="Damping ratio ζ (–)", xlabel="Elbow $q$, 0 stretched out (°)")
    remark(
        frequencies,
        r"$f_d = \frac{1}{2\pi}\sqrt{\frac{K}{I(q)}\,}\sqrt{1 - \zeta^2}$"
        f"    simulated within {modes.worst_f_d:.2f} %",
        (0.02, 0.1),
    )
    remark(
        dampings,
        r"$\zeta = \frac{D}{2\sqrt{K I(q)}}$" + f"    simulated within {modes.worst_zeta:.1f} %",
        (0.02, 0.14),
    )
    legend(
        figure,
        frequencies,
        {"$I$": "inertia about the shoulder", "$K$, $D$": "stiffness and damping of its flexible drive"},
    )
    figure.align_ylabels([frequencies, dampings])
    return figure


def _draw_arms(panel: Axes, modes: Modes) -> None:
    """The arm from above, once a pose."""
    panel.set_aspect("equal")
    panel.set_axis_off()
    upper, forearm = modes.description.kinematics.a
    for number, (pose, word) in enumerate(zip(modes.poses, WORDS, strict=True)):
        _draw_arm(panel, np.array([number * APART, 0.0]), upper, forearm, pose, word)
    note(panel, "Actuator with\nflexibility", (-0.09, 0.0), ha="right", va="center")
    title(panel, f"The arm from above, with {modes.description.payload.mass:g} kg")
    panel.set(xlim=(-0.36, 2 * APART + 0.36), ylim=(-0.23, upper + forearm + 0.03))


def _draw_arm(panel: Axes, shoulder: Floats, upper: float, forearm: float, pose: Plucked, word: str) -> None:
    """One pose: the upper arm points up, the forearm is turned by q."""
    elbow = pose.elbow
    joint = shoulder + np.array([0.0, upper])
    tip = joint + forearm * np.array([np.sin(elbow), np.cos(elbow)])
    ahead = joint + np.array([0.0, 0.62 * forearm])
    panel.plot(*np.transpose([joint, ahead]), color=FAINT, linewidth=0.9, linestyle=LIMIT)
    panel.plot(*np.transpose([shoulder, joint]), color=INK, linewidth=9.0, solid_capstyle="round", zorder=2)
    panel.plot(*np.transpose([joint, tip]), color=MUTED, linewidth=7.0, solid_capstyle="round", zorder=3)
    panel.add_patch(
        Circle((joint[0], joint[1]), 0.022, facecolor="white", edgecolor=INK, linewidth=1.2, zorder=4)
    )
    panel.add_patch(Circle((tip[0], tip[1]), 0.04, facecolor="white", edgecolor=INK, linewidth=1.4, zorder=4))
    panel.add_patch(
        Arc(
            (joint[0], joint[1]),
            0.19,
            0.19,
            theta1=90.0 - np.degrees(elbow),
            theta2=90.0,
            color=INK,
            linewidth=1.0,
            zorder=5,
        )
    )
    panel.add_patch(
        Circle((shoulder[0], shoulder[1]), 0.062, facecolor="white", edgecolor=INK, linewidth=1.4, zorder=4)
    )
    turn = np.linspace(0.0, SPRING_TURNS * 2.0 * np.pi, 200)
    radius = 0.008 + 0.046 * turn / turn[-1]
    panel.plot(
        shoulder[0] + radius * np.sin(turn), shoulder[1] + radius * np.cos(turn),
        color=UNSHAPED, linewidth=1.2, zorder=5,
    )  # fmt: skip
    note(panel, f"$q$ = {np.degrees(elbow):.0f}°", (joint[0] - 0.02, joint[1] + 0.1), ha="right", va="center")
    lines = [f"$I$ = {pose.inertia:.3f} kg m²", word]
    panel.annotate(
        "\n".join(filter(None, lines)), (shoulder[0], shoulder[1] - 0.085), ha="center", va="top", fontsize=9,
        color=INK,
    )  # fmt: skip
