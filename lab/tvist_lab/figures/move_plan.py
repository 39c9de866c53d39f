"""Figure of the moves of an identification."""

import numpy as np
import pinocchio as pin
from matplotlib.figure import Figure

from tvist_controller.api.line import body
from tvist_lab.figures.style import INK, OF_SHAPED, OF_UNSHAPED, legend, note, panels, tint, title
from tvist_lab.identification.jogs import JogPlan
from tvist_lab.recordings import Floats
from tvist_plant.model import rigid_model


def move_plan_figure(plan: JogPlan) -> Figure:
    """Draw the arm from the side and from above: at present, in every posture on the way, and where it rings."""
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
        panel.set_aspect("equal")
        panel.margins(0.08)
        panel.set(xlabel="x (m)", ylabel="z (m)" if across == 2 else "y (m)")
        title(panel, f"{plan.arm.description.robot.model} {what}")
    legend(figure, axes[0])
    return figure
