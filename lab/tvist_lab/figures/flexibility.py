"""Figures 1 and 2: where an arm is flexible, and how its inertia changes its frequency and damping."""

from typing import Any

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

from tvist_controller.api.line import (
    ControlCycle,
    JointLine,
    MotionLimits,
    body,
    choose_filter,
    paper_payload,
    quickest_motion,
)
from tvist_controller.api.robot import truth_of
from tvist_lab.figures.style import (
    FAINT,
    INK,
    LIMIT,
    MUTED,
    OF_SHAPED,
    OF_THIRD,
    OF_UNSHAPED,
    SERIES,
    UNSHAPED,
    legend,
    note,
    panels,
    remark,
    tint,
    title,
)
from tvist_lab.one_joint import OneJointModes, Plucked
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription, load
from tvist_plant.model import flexible_model
from tvist_plant.plant import PERIOD
from tvist_shaping import Fixed

RAISED = 0.6  # angle of the shoulder above the stretched arm at which the motion starts [rad]
WATCHED = 0.3  # time after the stop in which the largest deflection is sought [s]
MAGNIFIED = 600.0  # magnification of the deflection [-]
APART = 0.62  # distance between the shoulders of neighbouring poses in the figure [m]
WORDS = ("\nincreased inertia", "", "\ndecreased inertia")
"""The paper's words for the first and the last pose."""
SPRING_TURNS = 2.5


class _Arm:
    """The stretched UR5e with 5 kg and deflected springs."""

    def __init__(self, description: RobotDescription) -> None:
        self.payload = body(paper_payload(description))
        self.q = np.array(description.poses["Q1"])
        self.flexible = flexible_model(description, self.payload)
        self._data = self.flexible.model.createData()

    def line(self, springs: Floats) -> Floats:
        """Return the joints and the middles of bending links, from base to flange, shape (P, 3) [m].

        `springs` holds the angles of the gears, and two for each bending link [rad].
        """
        model, gears = self.flexible.model, len(self.q)
        y = np.zeros(model.nq)
        y[self.flexible.joints] = self.q + springs[:gears]
        y[self.flexible.flexes] = springs[gears:]
        pin.framesForwardKinematics(model, self._data, y)
        joints = [self._data.oMi[joint].translation for joint in range(1, model.njoints)]
        return np.array([np.zeros(3), *joints, self._data.oMf[self.flexible.flange].translation])

    def moved(self, springs: Floats) -> float:
        """Return the distance by which springs displace the flange [m]."""
        return float(np.linalg.norm(self.line(springs)[-1] - self.line(0.0 * springs)[-1]))

    def largest_deflection(self, description: RobotDescription) -> Floats:
        """Stop the shoulder unshaped; return the spring angles when the flange is farthest from rest."""
        start = self.q + RAISED * np.eye(len(self.q))[1]
        unshaped = choose_filter("none", Fixed([10.0], [0.1]), description.joints)
        cycle = ControlCycle(
            description, unshaped, q=start, declared=self.payload, carried=self.payload, seed=0
        )
        motion = quickest_motion(JointLine(start, self.q), MotionLimits(1.5, 2.0, 100.0))
        cycle.begin(motion)
        stop, after = round(motion.duration / PERIOD), round(WATCHED / PERIOD)
        rows = []
        for _ in range(stop + 4 * after):
            cycle.step()
            truth = truth_of(cycle.plant)
            rows.append([*truth.gear_deflection, *truth.link_deflection])
        springs = np.array(rows) - rows[-1]
        return max(springs[stop + 10 : stop + after], key=self.moved)


def figure_1() -> Figure:
    """Draw the UR5e with 5 kg, stretched out, at its largest deflection after a stop of the shoulder.

    Top: the arm from the side, rigid and with magnified bending. Bottom: displacement of the flange by each
    gear and link.
    """
    description = load("ur5e").clean()
    arm = _Arm(description)
    springs = arm.largest_deflection(description)
    flexible, alone = arm.flexible, np.diag(springs)
    figure, (side, parts) = panels(2, 5.4, share_x=False, ratios=(1.5, 1.0))

    rigid, bent = arm.line(0.0 * springs), arm.line(MAGNIFIED * springs)
    thick: Any = {"color": tint(FAINT, 0.5), "linewidth": 6.0, "solid_capstyle": "round"}
    side.plot(rigid[:, 0], rigid[:, 2], label="Rigid", **thick)
    words = f"Deflection drawn {MAGNIFIED:g} times larger"
    side.plot(bent[:, 0], bent[:, 2], color=INK, linewidth=2.0, label=words)
    for label, rows, how in (
        ("Gear", flexible.joints + 1, OF_SHAPED.points(8.0, markerfacecolor="white", zorder=4)),
        ("Link", flexible.flexes[::2] + 1, OF_UNSHAPED.points(6.0, markerfacecolor="white", zorder=4)),
        ("Payload", [-1], OF_THIRD.points(6.0, zorder=5)),
    ):
        side.plot(bent[rows, 0], bent[rows, 2], label=label, **how)
    side.margins(0.08, 0.35)
    side.set(aspect="equal", xlabel="Along the arm (m)", ylabel="Height (m)")
    note(side, f"flange {1e3 * arm.moved(springs):.2f} mm away", tuple(bent[-1, ::2]), (6, 12), ha="right")
    title(side, "UR5e with 5 kg, from the side, after a stop")

    joints = len(arm.q)
    moved = {
        f"gear of {name.replace('_', ' ')}": 1e3 * arm.moved(alone[place])
        for place, name in enumerate(description.robot.joints)
    }
    bending = [name.removesuffix("_bending_z") for name in flexible.model.names if "_bending_z" in name]
    for place, name in enumerate(bending):
        first, second = (arm.moved(alone[joints + 2 * place + axis]) for axis in (0, 1))
        moved[f"link after {name.replace('_', ' ')}"] = 1e3 * float(np.hypot(first, second))
    names = sorted((name for name in moved if moved[name] > 1e-4), key=lambda name: -moved[name])
    colors = [(OF_SHAPED if name.startswith("gear") else OF_UNSHAPED).color for name in names]
    parts.barh(names, [moved[name] for name in names], color=colors, height=0.6)
    parts.invert_yaxis()
    parts.set(xlabel="Displacement of the flange by this spring alone (mm)")
    title(parts, "Where it comes from")
    legend(figure, side)
    return figure


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
    for mass, style in zip(sorted({one.mass for one in modes.curve}), SERIES, strict=False):
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
        panel.set(xlim=(-4.0, 154.0), xticks=np.arange(0.0, 151.0, 30.0), ylim=(0.0, None))
        for pose in modes.poses:
            panel.axvline(np.degrees(pose.elbow), color=FAINT, linewidth=0.9, linestyle=LIMIT)
    frequencies.set_ylabel("Damped frequency $f_d$ (Hz)")
    frequencies.tick_params(labelbottom=False)
    dampings.set(ylabel="Damping ratio ζ (–)", xlabel="Elbow $q$, 0 stretched out (°)")
    said = f"    simulated within {modes.worst('f_d'):.2f} %"
    remark(frequencies, r"$f_d=\frac{1}{2\pi}\sqrt{\frac{K}{I(q)}\,}\sqrt{1-\zeta^2}$" + said, (0.02, 0.1))
    said = f"    simulated within {modes.worst('zeta'):.1f} %"
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
    panel.annotate(f"$I$ = {pose.inertia:.3f} kg m²{word}", (x, -0.085), ha="center", va="top")
