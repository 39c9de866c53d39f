"""A motion through a bridge: what is sent and what follows, and what is left after the stop."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proof.bridge.in_lockstep import Bridge, HiddenRobot
from tvist_controller.api.line import paper_payload
from tvist_controller.api.robot import truth_of
from tvist_lab.figures.files import save
from tvist_lab.figures.style import ALPHA, FAINT, OF_ALPHA, SERIES, legend, panels, title
from tvist_lab.metrics.vibration import amplitude
from tvist_lab.recordings import Floats
from tvist_plant.description import load
from tvist_plant.plant import GRAVITY, PERIOD
from tvist_protocol.commands import MoveJ
from tvist_server.moving.servo_lag import ServoLag

ROBOT, SHAPER, TARGET, JOINT = "ur5e", "auto", "Q2", 0
"""The robot, its shaper, where the motion from Q1 ends, and the joint whose angle is drawn."""
SENT: dict[str, Any] = {"color": FAINT, "linewidth": 1.0, "label": "Set-points sent"}
"""How they are drawn."""
BEFORE, AFTER = 0.1, 0.2
"""Time before and after the stop that is drawn [s]."""


def draw(seed: int, path: Path) -> None:
    """Draw the end of a motion of a hidden robot.

    Args:
        seed: Seed of the hidden robot.
        path: File to write.
    """
    description = load(ROBOT)
    start, payload = np.array(description.poses["Q1"]), paper_payload(description)

    def bridge(lag: ServoLag | None) -> Bridge:
        return Bridge(description, seed, start, payload, SHAPER, lag=lag)

    sides: dict[str, HiddenRobot | Bridge] = {
        "Unshaped": HiddenRobot(description, seed, start, payload),
        "Shaped in the robot": HiddenRobot(description, seed, start, payload, SHAPER),
        "In front of it, lag compensated": bridge(ServoLag.simulated()),
        "In front of it, lag left": bridge(None),
    }
    figure, (angles, accelerations) = panels(2, 4.6)
    stop = 0.0
    for (name, side), style in zip(sides.items(), SERIES, strict=False):
        wanted, target, sent, alpha = _made(side, description.poses[TARGET])
        time = PERIOD * (np.arange(len(target)) - side.late)
        end = wanted[-1]
        if isinstance(side, Bridge):
            if "left" not in name:
                angles.plot(time, 1e3 * (sent - end), **SENT)
            angles.plot(time, 1e3 * (target - end), **style.line(label=name))
        elif name != "Unshaped":
            stop = PERIOD * float(np.flatnonzero(np.abs(np.diff(wanted)) > 1e-6)[-1])
            angles.plot(time, 1e3 * (target - end), **style.line(label=name))
        accelerations.plot(time, alpha, **style.line(label=name))
    shown = (stop - BEFORE, stop + AFTER)
    angles.set(xlim=shown, ylim=(-7.5, 0.7), ylabel="Base from end (mrad)")
    accelerations.set(xlim=shown, ylim=(0.0, None), xlabel="Time (s)", ylabel=ALPHA)
    title(angles, "The base's target before its end: late by 33 ms, unless the set-points sent lead it")
    title(accelerations, "The tool around the stop")
    accelerations.plot([], [], **SENT)
    legend(figure, accelerations, OF_ALPHA)
    save(figure, path)


def _made(side: HiddenRobot | Bridge, target: Sequence[float]) -> tuple[Floats, Floats, Floats, Floats]:
    """Make the motion; return a joint's wanted, target and sent angles, each of shape (T,) [rad], and |α| [m/s²]."""
    side.send(MoveJ, q=tuple(target))
    rows, rest = [], 0
    while rest < AFTER / PERIOD + 50:
        state = side.tick()
        truth = truth_of(side.robot.plant)
        rest += side.controller.cycle.mode.at_rest
        own = side.robot.controller.latest if isinstance(side, Bridge) else state
        sent = side.port.sent[JOINT] if isinstance(side, Bridge) else np.nan
        up = Rotation.from_matrix(truth.flange_rotation).inv().apply([0.0, 0.0, GRAVITY])
        rows.append((side.wanted[JOINT], own.target_q[JOINT], sent, *(truth.specific_force - up)))
    table = np.array(rows)
    return table[:, 0], table[:, 1], table[:, 2], amplitude(table[:, 3:])
