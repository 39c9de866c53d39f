"""Robots on the stage: arms, ghosts and traces, put where a moment has them."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from viser import SceneApi

from tvist_protocol.geometry import Geometry
from tvist_protocol.stream import State, Truth
from tvist_protocol.values import Payload
from tvist_view.appearance import Appearance
from tvist_view.chain import Chain, Floats
from tvist_view.drawn_arm import CAP, Colour, DrawnArm

TRACE = 90
"""Points of a trace: three seconds at 30 a second."""


@dataclass(frozen=True)
class Moment:
    """A robot at one tick."""

    state: State
    truth: Truth | None
    """None where the robot does not tell it."""


class DrawnRobot:
    """One robot on the stage.

    Args:
        scene: Scene of the page.
        name: Root of its names in the scene, `/robot`.
        geometry: Its geometry.
        payload: What to draw on its flange.
        at: Where its base stands, shape (3,) [m].
        colour: Colour of its joints and of its trace.
        label: Word above it.
    """

    def __init__(
        self,
        scene: SceneApi,
        name: str,
        geometry: Geometry,
        payload: Payload,
        *,
        at: tuple[float, float, float] = (0.0, 0.0, 0.0),
        colour: Colour = CAP,
        label: str = "",
    ) -> None:
        self.chain = Chain(geometry)
        self._arm, self._ghost = (
            DrawnArm(
                scene,
                f"{name}/{part}",
                self.chain,
                payload=payload,
                payload_radius=geometry.payload_radius,
                at=at,
                ghost=part == "ghost",
                colour=colour,
            )
            for part in ("arm", "ghost")
        )
        self._trace: deque[Floats] = deque(maxlen=TRACE)
        self._line = scene.add_line_segments(
            f"{name}/trace", np.zeros((1, 2, 3)), colour, thickness=3.0, thickness_units="screen"
        )
        if label:
            x, y, z = at
            scene.add_label(f"{name}/label", label, position=(x, y, z + 1.15), anchor="bottom-center")

    def show(self, moment: Moment, appearance: Appearance) -> Floats:
        """Draw a moment; where the flange is drawn, shape (3,) [m]."""
        state, truth = moment.state, moment.truth
        if truth is None:
            flange = self._arm.move(np.array(state.actual_q), np.zeros(0))
        else:
            flange = self._arm.move(*appearance.magnification.drawn(truth))
        self._ghost.show(visible=appearance.ghost)
        if appearance.ghost:
            self._ghost.move(np.array(state.reference_q), np.zeros(0))
        self._line.visible = appearance.trace
        if appearance.trace:
            self._trace.append(flange)
            points = np.array(self._trace)
            if len(points) > 1:
                self._line.points = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)
        return flange

    def forget_trace(self) -> None:
        """Begin the trace anew."""
        self._trace.clear()
