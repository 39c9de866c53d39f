"""`python -m tools.figures`: draw `elastic.png`, `mean_delay.png` and `tails.png` for the documentation.

Two show a motion of a UR5e through several filters: elastic feed-forward, and a varying mean delay. The third
shows how both arms of the paper's experiment settle.
"""

from pathlib import Path
from typing import Any

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
from tvist_lab.figures import house_style, save
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
from tvist_lab.metrics.paper import REPEATABILITY, distance
from tvist_lab.recordings import Floats
from tvist_lab.studies.paper.experiment import simulate
from tvist_lab.studies.paper.published import ARMS, MOTIONS, published
from tvist_plant.description import load
from tvist_plant.plant import PERIOD
from tvist_shaping import BUILT_IN

IMAGES = Path(__file__).parents[1] / "docs" / "images"
LIMITS = MotionLimits(1.5, 2.0, 100.0)
SHOWN = (-0.12, 0.4)
"""Start and end time in the figure of elastic feed-forward, from the unshaped reference's stop [s]."""
MODES = 3  # number of modes in the product of zero-vibration shapers
TICKS_AFTER = 100  # ticks shown after the stop of the reference


def elastic_figure() -> Figure:
    """A UR5e without noise, carrying 5 kg, comes to rest after a move from Q1 to Q2, with three shapers.

    Top: the tool's acceleration. Bottom: reference before and after the filter; all have the same end.
    """
    figure, (forces, references) = panels(2, 4.2)
    styles = {"none": OF_UNSHAPED, "auto": OF_THIRD, "elastic": OF_SHAPED}
    for name, style in styles.items():
        time, force, left = _stop(name)
        forces.plot(time, force, **style.line(1.2, label="Unshaped" if name == "none" else name))
        references.plot(time, left, **style.line(1.2))
    forces.set(ylabel=ALPHA, ylim=(-0.1, 2.1))
    references.set(xlabel="Time after the unshaped reference's stop (ms)", ylabel="Angle left to turn (mrad)")
    references.set(xlim=tuple(1e3 * time for time in SHOWN), ylim=(-0.2, 4.0))
    legend(figure, forces, OF_ALPHA)
    return figure


def _stop(name: str) -> tuple[Floats, Floats, Floats]:
    """Return time [ms], true tool acceleration [m/s²] and joint 1's remaining angle [mrad] near the stop."""
    description = load("ur5e").clean()
    payload, calibration = paper_payload(description), load_calibration("ur5e_modal")
    start, end = (np.array(description.poses[pose]) for pose in ("Q1", "Q2"))
    estimator = modal_estimator(calibration, description, payload, BUILT_IN.modes_of(name))
    tvist = choose_filter(name, estimator, description.joints)
    elastic, carried = elastic_feed_forward(tvist, description, calibration), body(payload)
    cycle = ControlCycle(
        description, tvist, elastic=elastic, q=start, declared=carried, carried=carried, seed=0
    )
    motion = quickest_motion(JointLine(start, end), LIMITS)
    stop = round(motion.duration / PERIOD)
    cycle.begin(motion)
    force, left = [], []
    for _ in range(stop + round(SHOWN[1] / PERIOD)):
        sample = cycle.step()
        force.append(truth_of(cycle.plant).specific_force)
        left.append(1e3 * float(end[0] - sample.target.q[0]))
    away = np.linalg.norm(np.array(force) - force[-1], axis=1)
    time = 1e3 * PERIOD * np.arange(-stop, len(away) - stop, dtype=np.float64)
    return time, away, np.array(left)


def mean_delay_figure() -> Figure:
    """A UR5e from Q3 to Q1: mean delay, velocity and acceleration of the shaped elbow, with two filters.

    Top: the mean delay. Middle and bottom: velocity and acceleration, with the reference's limits.
    """
    description = load("ur5e")
    payload, calibration = paper_payload(description), load_calibration("ur5e_modal")
    start, end = (np.array(description.poses[name]) for name in ("Q3", "Q1"))
    joint = int(np.argmax(np.abs(end - start)))
    figure, (delays, velocities, accelerations) = panels(3, 5.6)
    drawn = {"zv": ("zv of three modes", OF_UNSHAPED), "auto": ("auto, its mean delay constant", OF_SHAPED)}
    for name, (label, style) in drawn.items():
        estimator = modal_estimator(calibration, description, payload, BUILT_IN.modes_of(name, MODES))
        tvist = BUILT_IN.make_filter(name, estimator, joints=description.joints)
        tvist.reset(start)
        motion = quickest_motion(JointLine(start, end), LIMITS)
        rows: list[tuple[float, float]] = []
        while not motion.finished or len(rows) < motion.duration / PERIOD + TICKS_AFTER:
            q = tvist.filter(motion.next())
            rows.append((1e3 * tvist.mean_delay, abs(q[joint] - start[joint])))
        delay, along = np.array(rows).T
        time = PERIOD * np.arange(len(rows))
        delays.plot(time, delay, **style.line(label=label))
        velocities.plot(time[1:], np.diff(along) / PERIOD, **style.line())
        accelerations.plot(time[1:-1], np.diff(along, 2) / PERIOD**2, **style.line())
    dashed(velocities, LIMITS.velocity)
    for side in (-1.0, 1.0):
        dashed(accelerations, side * LIMITS.acceleration)
    delays.set_ylabel("Mean delay (ms)")
    velocities.set_ylabel("Velocity (rad/s)")
    accelerations.set(xlabel="Time (s)", ylabel="Acceleration (rad/s²)")
    legend(figure, delays)
    return figure


def tails_figure() -> Figure:
    """Both arms of the paper's experiment come to rest: E after the stop, unshaped above, shaped below.

    A thick line lasts from t_enter to t_cycle of the paper's Table 2; a dotted one marks its overshoot.
    """
    figure, axes = panels(2, 4.8, columns=len(MOTIONS), share_y=True)
    places = [(motion, kind) for kind in ("unshaped", "shaped") for motion in MOTIONS]
    for name, style in zip(ARMS, (OF_SHAPED, OF_UNSHAPED), strict=True):
        done = simulate(free_setup(robot=name), runs=1, seed=0)
        for panel, key in zip(axes, places, strict=True):
            recording = done.first[key]
            motion = motions(recording)[0]
            time = 1e3 * (recording.time[motion.start : motion.end] - recording.time[motion.shaped_stop])
            E = np.maximum(1e3 * distance(recording, motion), 1e-4)
            panel.plot(time, E, color=style.color, linewidth=1.1, label=name)
    paper, limit = published(), 1e3 * REPEATABILITY
    for panel, (name, kind) in zip(axes, places, strict=True):
        row = paper["table_2"][name][kind]
        cycle = row["cycle_ms"] - row["delay_ms"] - 1e3 * paper["reference_duration_s"][name]
        span, overshoot = (cycle - row["stabilisation_ms"], cycle), 1e3 * row["overshoot_m"]
        title(panel, f"{name} {kind}")
        dashed(panel, limit)
        thick: Any = {"color": INK, "linewidth": 2.6, "markersize": 9.0, "label": "Paper, outside 0.03 mm"}
        panel.plot(span, [limit] * 2, "|-", **thick)
        if overshoot > limit:
            panel.plot(span, [overshoot] * 2, ":", color=INK, linewidth=1.2, label="Paper, overshoot")
        panel.set(yscale="log", xlim=(-120.0, 1400.0), ylim=(1e-3, 3.0))
        decades(panel, "y")
    axes[0].set_ylabel("Distance $E$ (mm)")
    axes[-2].set_xlabel("Time after the shaped stop (ms)")
    legend(figure, axes[0])
    return figure


def main() -> None:
    """Write all figures."""
    figures = {"elastic": elastic_figure, "mean_delay": mean_delay_figure, "tails": tails_figure}
    with house_style():
        for name, draw in figures.items():
            print(save(draw(), IMAGES / f"{name}.png"))


if __name__ == "__main__":
    main()
