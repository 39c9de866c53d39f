"""Effect of elastic feed-forward: the same motion unshaped, with `auto`, and with `elastic`."""

import numpy as np
from matplotlib.figure import Figure

from tvist_controller.api.line import (
    ControlCycle,
    JointLine,
    MotionLimits,
    body,
    choose_filter,
    elastic_feed_forward,
    load_calibration,
    modal_estimator,
    paper_payload,
    quickest_motion,
)
from tvist_controller.api.robot import truth_of
from tvist_lab.figures.style import OF_SHAPED, OF_THIRD, OF_UNSHAPED, explain, legend, panels
from tvist_lab.recordings import Floats
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_shaping import BUILT_IN

LIMITS = MotionLimits(1.5, 2.0, 100.0)
SHOWN = (-0.12, 0.4)
"""Times shown, from the stop of the unshaped reference [s]."""


def elastic_figure() -> Figure:
    """A clean UR5e with 5 kg comes to rest after a move from Q1 to Q2, with three shapers.

    Top: the tool's acceleration. Bottom: reference before and after the filter, which all have the same end.
    """
    figure, (forces, references) = panels(2, 4.2)
    for name, label, style in (
        ("none", "Unshaped", OF_UNSHAPED),
        ("auto", "auto", OF_THIRD),
        ("elastic", "elastic", OF_SHAPED),
    ):
        time, force, left = _stop(name)
        forces.plot(time, force, **style.line(1.2, label=label))
        references.plot(time, left, **style.line(1.2))
    forces.set_ylabel(r"$|\alpha|$ (m/s²)")
    forces.set_ylim(-0.1, 2.1)
    references.set_ylabel("Angle left to turn (mrad)")
    references.set_xlabel("Time after the unshaped reference's stop (ms)")
    references.set(xlim=tuple(1e3 * time for time in SHOWN), ylim=(-0.2, 4.0))
    legend(figure, forces)
    explain(figure, {r"$|\alpha|$": "acceleration of the tool, without gravity"})
    return figure


def _stop(name: str) -> tuple[Floats, Floats, Floats]:
    """Time [ms], true acceleration of the tool [m/s²] and angle left of the first joint [mrad] around the stop."""
    description = load("ur5e").clean()
    payload, calibration = paper_payload(description), load_calibration("ur5e_modal")
    start, end = (np.array(description.poses[pose]) for pose in ("Q1", "Q2"))
    estimator = modal_estimator(calibration, description, payload, BUILT_IN.modes_of(name))
    tvist = choose_filter(name, estimator, description.joints)
    cycle = ControlCycle(
        description,
        tvist,
        elastic=elastic_feed_forward(tvist, description, calibration),
        q=start,
        declared=body(payload),
        carried=body(payload),
        seed=0,
    )
    motion = quickest_motion(JointLine(start, end), LIMITS, PERIOD)
    stop = round(motion.duration / PERIOD)
    cycle.begin(motion)
    force, left = [], []
    for _ in range(stop + round(SHOWN[1] / PERIOD)):
        sample = cycle.step()
        force.append(truth_of(cycle.line.plant).specific_force)
        left.append(float(end[0] - sample.target.q[0]))
    felt = np.array(force)
    time = 1e3 * PERIOD * np.arange(-stop, len(felt) - stop, dtype=np.float64)
    away: Floats = np.sqrt(((felt - felt[-1]) ** 2).sum(axis=1))
    return time, away, 1e3 * np.array(left)
