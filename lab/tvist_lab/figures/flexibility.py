"""Figure 1: where an arm is flexible, and what each spring adds to the deflection of its tool."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from matplotlib.axes import Axes
from matplotlib.figure import Figure

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
    OF_SHAPED,
    OF_THIRD,
    OF_UNSHAPED,
    legend,
    note,
    panels,
    tint,
    title,
)
from tvist_lab.recordings import Floats
from tvist_plant.description import RobotDescription, load
from tvist_plant.model import FlexibleModel, flexible_model
from tvist_plant.plant import PERIOD
from tvist_shaping import Fixed

LIMITS = MotionLimits(1.5, 2.0, 100.0)
RAISED = 0.6
"""Angle of the shoulder over the stretched arm at which the motion starts [rad]."""
WATCHED = 0.3
"""Time after the stop in which the largest deflection is looked for [s]."""
MAGNIFIED = 600.0
"""By how much the deflection is drawn larger [-]."""


@dataclass(frozen=True)
class Bent:
    """The arm's largest deflection after a stop, without its sag."""

    flexible: FlexibleModel
    q: Floats
    """Angles of the joints, shape (n,) [rad]."""
    gears: Floats
    """Wind-up of each gear, shape (n,) [rad]."""
    links: Floats
    """Angle of each virtual joint of a bending link [rad]."""

    def line(self, magnified: float = 1.0, only: tuple[str, int] | None = None) -> Floats:
        """Positions of joints and of the middles of bending links, from the base to the flange, shape (P, 3) [m].

        Args:
            magnified: Factor on the deflections [-].
            only: "gear" or "link" with an index, to let a single spring yield.
        """
        y = np.zeros(self.flexible.model.nq)
        gears, links = magnified * self.gears, magnified * self.links
        if only is not None:
            kind, place = only
            gears = gears * (np.arange(len(gears)) == place) * (kind == "gear")
            links = links * (np.arange(len(links)) == place) * (kind == "link")
        y[self.flexible.joints] = self.q + gears
        y[self.flexible.flexes] = links
        data = self.flexible.model.createData()
        pin.framesForwardKinematics(self.flexible.model, data, y)
        places = [
            np.zeros(3),
            *(data.oMi[joint].translation for joint in range(1, self.flexible.model.njoints)),
        ]
        return np.array([*places, data.oMf[self.flexible.flange].translation])

    def moved(self, only: tuple[str, int]) -> float:
        """Distance by which one spring displaces the flange [m]."""
        return float(np.linalg.norm(self.line(only=only)[-1] - self.line(0.0)[-1]))


def figure_1() -> Figure:
    """Draw the UR5e with 5 kg, stretched out, at its largest deflection after a stop of the shoulder.

    Top: the arm from the side, rigid and as it bends, drawn larger. Bottom: by how much each gear and each link alone
    displaces the flange.
    """
    description = load("ur5e").clean()
    bent = largest_deflection(description)
    figure, (arm, parts) = panels(2, 5.4, share_x=False, ratios=(1.5, 1.0))
    _draw_arm(arm, bent)
    title(arm, "UR5e with 5 kg, from the side, after a stop")
    joints = description.robot.joints
    bars = {f"gear of {name.replace('_', ' ')}": ("gear", place) for place, name in enumerate(joints)}
    bending = [name.removesuffix("_bending_z") for name in bent.flexible.model.names if "_bending_z" in name]
    for place, name in enumerate(bending):
        bars[f"link after {name.replace('_', ' ')}"] = ("link", 2 * place)
    moved = {
        name: 1e3
        * np.hypot(bent.moved(part), bent.moved(("link", part[1] + 1)) if part[0] == "link" else 0.0)
        for name, part in bars.items()
    }
    names = sorted((name for name in moved if moved[name] > 1e-4), key=lambda name: moved[name], reverse=True)
    colors = [OF_SHAPED.color if name.startswith("gear") else OF_UNSHAPED.color for name in names]
    parts.barh(names, [moved[name] for name in names], color=colors, height=0.6)
    parts.invert_yaxis()
    parts.set(xlabel="Displacement of the flange by this spring alone (mm)")
    title(parts, "Where it comes from")
    legend(figure, arm)
    return figure


def _draw_arm(panel: Axes, bent: Bent) -> None:
    """The arm in its vertical plane: rigid, and with its deflections magnified."""
    rigid, deflected = bent.line(0.0), bent.line(MAGNIFIED)
    panel.plot(
        rigid[:, 0], rigid[:, 2], color=tint(FAINT, 0.5), linewidth=6.0, solid_capstyle="round", label="Rigid"
    )
    panel.plot(
        deflected[:, 0],
        deflected[:, 2],
        color=INK,
        linewidth=2.0,
        label=f"Deflection drawn {MAGNIFIED:g} times larger",
    )
    joints = bent.flexible.joints + 1
    links = bent.flexible.flexes[::2] + 1
    where = deflected[joints]
    panel.plot(
        where[:, 0], where[:, 2], **OF_SHAPED.points(8.0, markerfacecolor="white", zorder=4, label="Gear")
    )
    where = deflected[links]
    panel.plot(
        where[:, 0], where[:, 2], **OF_UNSHAPED.points(6.0, markerfacecolor="white", zorder=4, label="Link")
    )
    tool = deflected[-1]
    panel.plot([tool[0]], [tool[2]], **OF_THIRD.points(6.0, label="Payload", zorder=5))
    panel.set_aspect("equal")
    panel.margins(0.08, 0.35)
    panel.set(xlabel="Along the arm (m)", ylabel="Height (m)")
    gone = 1e3 * np.linalg.norm(bent.line()[-1] - rigid[-1])
    note(panel, f"flange {gone:.2f} mm away", (tool[0], tool[2]), (6, 12), ha="right")


def largest_deflection(description: RobotDescription) -> Bent:
    """Simulate a stop of the shoulder with the arm stretched out, unshaped; return the deflection farthest from rest.

    Args:
        description: The UR5e.
    """
    payload = paper_payload(description)
    end = np.array(description.poses["Q1"])
    start = end.copy()
    start[1] += RAISED
    cycle = ControlCycle(
        description,
        choose_filter("none", Fixed([10.0], [0.1]), description.joints),
        q=start,
        declared=body(payload),
        carried=body(payload),
        seed=0,
    )
    motion = quickest_motion(JointLine(start, end), LIMITS, PERIOD)
    cycle.begin(motion)
    stop, after = round(motion.duration / PERIOD), round(WATCHED / PERIOD)
    gears, links = [], []
    for _ in range(stop + 4 * after):
        cycle.step()
        truth = truth_of(cycle.plant)
        gears.append(truth.gear_deflection)
        links.append(truth.link_deflection)
    g, s = np.array(gears) - gears[-1], np.array(links) - links[-1]
    flexible = flexible_model(description, body(payload))
    rows = [Bent(flexible, end, g[row], s[row]) for row in range(stop + 10, stop + after)]
    home = rows[0].line(0.0)[-1]
    return max(rows, key=lambda bent: float(np.linalg.norm(bent.line()[-1] - home)))
