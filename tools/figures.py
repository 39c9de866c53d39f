"""`python -m tools.figures`: draws `elastic.png`, `mean_delay.png` and `tails.png`, three figures of the documents.

Two show a motion of a UR5e through several filters: elastic feed-forward, and a varying mean delay. The third shows how
both arms of the paper's experiment settle.
"""

from pathlib import Path

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
from tvist_lab.figures import FigureFiles
from tvist_lab.figures.style import (
    ALPHA,
    INK,
    OF_ALPHA,
    OF_SHAPED,
    OF_THIRD,
    OF_UNSHAPED,
    dashed,
    decades,
    legend,
    panels,
    title,
)
from tvist_lab.in_process import free_setup
from tvist_lab.metrics import motions
from tvist_lab.metrics.settling import REPEATABILITY, distance
from tvist_lab.recordings import Floats
from tvist_lab.studies.paper.experiment import simulate
from tvist_lab.studies.paper.published import ARMS, MOTIONS, published
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_shaping import BUILT_IN
from tvist_shaping.base import Filter

IMAGES = Path(__file__).parents[1] / "docs" / "images"
LIMITS = MotionLimits(1.5, 2.0, 100.0)
SHOWN = (-0.12, 0.4)
"""Times shown of the rest after elastic feed-forward, from the stop of the unshaped reference [s]."""
MODES = 3
"""Number of modes in the product of zero-vibration shapers."""
NAMES = ("zv of three modes", "auto, its mean delay constant")
TICKS_AFTER = 100
"""Number of ticks shown after the reference has stopped."""


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
    forces.set_ylabel(ALPHA)
    forces.set_ylim(-0.1, 2.1)
    references.set_ylabel("Angle left to turn (mrad)")
    references.set_xlabel("Time after the unshaped reference's stop (ms)")
    references.set(xlim=tuple(1e3 * time for time in SHOWN), ylim=(-0.2, 4.0))
    legend(figure, forces, OF_ALPHA)
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
        force.append(truth_of(cycle.plant).specific_force)
        left.append(float(end[0] - sample.target.q[0]))
    felt = np.array(force)
    time = 1e3 * PERIOD * np.arange(-stop, len(felt) - stop, dtype=np.float64)
    away: Floats = np.sqrt(((felt - felt[-1]) ** 2).sum(axis=1))
    return time, away, 1e3 * np.array(left)


def mean_delay_figure() -> Figure:
    """A UR5e from Q3 to Q1: mean delay, velocity and acceleration of the shaped elbow, with two filters.

    Top: the mean delay. Middle and bottom: velocity and acceleration, with the reference's limits.
    """
    description = load("ur5e")
    payload, calibration = paper_payload(description), load_calibration("ur5e_modal")
    joints = description.joints
    filters = [
        BUILT_IN.make_filter(
            name,
            modal_estimator(calibration, description, payload, BUILT_IN.modes_of(name, MODES)),
            joints=joints,
        )
        for name in ("zv", "auto")
    ]
    start, end = (np.array(description.poses[name]) for name in ("Q3", "Q1"))
    figure, (delays, velocities, accelerations) = panels(3, 5.6)
    for tvist, style, name in zip(filters, (OF_UNSHAPED, OF_SHAPED), NAMES, strict=True):
        delay, q = _shape(tvist, start, end)
        time = PERIOD * np.arange(len(q))
        joint = int(np.argmax(np.abs(end - start)))
        along = (q[:, joint] - start[joint]) / (end - start)[joint] * abs(end - start).max()
        delays.plot(time, 1e3 * delay, **style.line(label=name))
        velocities.plot(time[1:], np.diff(along) / PERIOD, **style.line())
        accelerations.plot(time[1:-1], np.diff(along, 2) / PERIOD**2, **style.line())
    dashed(velocities, LIMITS.velocity)
    for side in (-1.0, 1.0):
        dashed(accelerations, side * LIMITS.acceleration)
    delays.set_ylabel("Mean delay (ms)")
    velocities.set_ylabel("Velocity (rad/s)")
    accelerations.set_ylabel("Acceleration (rad/s²)")
    accelerations.set_xlabel("Time (s)")
    legend(figure, delays)
    return figure


def _shape(tvist: Filter, start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Mean delay [s] and shaped reference [rad] at each tick of a motion, shapes (N,) and (N, joints)."""
    motion = quickest_motion(JointLine(start, end), LIMITS, PERIOD)
    tvist.reset(start)
    delays: list[float] = []
    references: list[Floats] = []
    while not motion.finished or len(references) < motion.duration / PERIOD + TICKS_AFTER:
        references.append(tvist.filter(motion.next()))
        delays.append(tvist.mean_delay)
    return np.array(delays), np.array(references)


def tails_figure() -> Figure:
    """Both arms of the paper's experiment come to rest: E after the stop, unshaped above, shaped below.

    A thick line lasts from t_enter to t_cycle in the paper's Table 2, a dotted one is at its overshoot.
    """
    figure, axes = panels(2, 4.8, columns=len(MOTIONS), share_y=True)
    places = [(motion, kind) for kind in ("unshaped", "shaped") for motion in MOTIONS]
    for name, style in zip(ARMS, (OF_SHAPED, OF_UNSHAPED), strict=True):
        done = simulate(free_setup(robot=name), runs=1, seed=0)
        for panel, key in zip(axes, places, strict=True):
            recording = done.first[key]
            motion = motions(recording)[0]
            time = recording.time[motion.start : motion.end] - recording.time[motion.shaped_stop]
            E = 1e3 * distance(recording, motion)
            panel.plot(1e3 * time, np.maximum(E, 1e-4), color=style.color, linewidth=1.1, label=name)
    paper, limit = published(), 1e3 * REPEATABILITY
    for panel, (name, kind) in zip(axes, places, strict=True):
        row = paper["table_2"][name][kind]
        cycle = row["cycle_ms"] - row["delay_ms"] - 1e3 * paper["reference_duration_s"][name]
        span, overshoot = (cycle - row["stabilisation_ms"], cycle), 1e3 * row["overshoot_m"]
        title(panel, f"{name} {kind}")
        dashed(panel, limit)
        panel.plot(
            span, [limit] * 2, "|-", color=INK, linewidth=2.6, markersize=9.0, label="Paper, outside 0.03 mm"
        )
        if overshoot > limit:
            panel.plot(span, [overshoot] * 2, ":", color=INK, linewidth=1.2, label="Paper, overshoot")
        panel.set(yscale="log", xlim=(-120.0, 1400.0), ylim=(1e-3, 3.0))
        decades(panel, "y")
    axes[0].set_ylabel("Distance $E$ (mm)")
    axes[-2].set_xlabel("Time after the shaped stop (ms)")
    legend(figure, axes[0])
    return figure


def main() -> None:
    """Write all files."""
    drawn = {"elastic": elastic_figure(), "mean_delay": mean_delay_figure(), "tails": tails_figure()}
    for name, figure in drawn.items():
        print(FigureFiles(IMAGES, "png").write(figure, name))


if __name__ == "__main__":
    main()
