"""A cell in time: what it does in every tick."""

from typing import Protocol

import numpy as np

from tvist_controller.cell.bodies import joined, part_body, tool_body
from tvist_controller.cell.description import Cell, Tool, bit_of
from tvist_controller.cell.gripper import Gripper
from tvist_controller.cell.urcap import PORT, answer
from tvist_controller.cell.wires import Wires
from tvist_controller.commands.events import Emit
from tvist_controller.kinematics.arm import Arm
from tvist_controller.paths.poses import Placement, placement
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import Floats
from tvist_plant.plant import Gripping, Loadable, Plant
from tvist_protocol.values import Pose

TRANSFER = 100
"""Ticks (0.2 s) in which the weight of a part goes over to the arm and back, as when it is lifted off its support."""
NEAR = 0.1
"""Distance up to which a part that closing fingers have missed is worth a warning [m]."""
THIS_MACHINE = ("127.0.0.1", "localhost", "::1")
"""Names by which programs call the machine on which the URCap runs."""
STALLED = 0.004
"""Way by which fingers that really hold are behind when something has stopped them [m]."""
_SWAPPED = np.diag([-1.0, -1.0, 1.0])
"""Half a turn about z."""


class Terminals(Protocol):
    """Terminals of the robot, and the place where its tool centre point is declared."""

    @property
    def digital_outputs(self) -> int:
        """Digital outputs, a bit each."""

    def set_digital_inputs(self, mask: int, values: int) -> None:
        """Apply signals to the digital inputs that the mask selects."""

    def set_tcp(self, pose: Pose) -> None:
        """Declare the tool centre point in the flange frame."""


class LiveCell:
    """A cell around a robot.

    Args:
        cell: The cell, which has been checked.
        description: The robot.
        plant: Its arm; what that carries at the start is the first tool unless a test wants something else.
        terminals: What the wires connect.
        emit: Emits events.

    Raises:
        ValueError: Parts or tools would change what the arm carries, and the plant cannot.
    """

    def __init__(
        self, cell: Cell, description: RobotDescription, plant: Plant, terminals: Terminals, emit: Emit
    ) -> None:
        if cell.changes_load and not isinstance(plant, Loadable):
            name = type(plant).__name__
            raise ValueError(
                f"cell: the plant {name} cannot carry another payload while it moves, since it has no load: leave "
                "parts and all tools but one out"
            )
        if cell.tools:
            terminals.set_tcp(cell.tools[0].tcp)
        self._cell, self._plant, self._terminals, self._emit = cell, plant, terminals, emit
        self._hand = plant if isinstance(plant, Gripping) else None
        self._kinematics = Arm(description)
        self._kinematics.pose(np.zeros(description.joints))  # its kernel is loaded before the first tick
        self.gripper = (
            None if cell.gripper is None else Gripper(cell.gripper.stroke, activated=cell.gripper.activated)
        )
        """The gripper; None if there is none."""
        tool = cell.gripping_tool
        self._tcp = placement(None if tool is None else tool.tcp)
        self._changers = [(bit_of(tool.while_on), tool) for tool in cell.tools[1:] if tool.while_on]
        self.begin(plant.payload)

    @property
    def empty(self) -> Payload:
        """What the arm carries at the start, without a part."""
        return self._first_load

    def begin(self, load: Payload) -> None:
        """Begin as at the start.

        Args:
            load: What the arm carries, without a part.
        """
        self._wires = Wires(self._cell.wires)
        if self.gripper is not None:
            self.gripper.begin()
        self._places = [placement(part.pose) for part in self._cell.parts]
        self._tool = self._cell.tools[0] if self._cell.tools else None
        self._load = self._first_load = load
        self._met: int | None = None
        """Number of the part that the closing fingers have met in this tick."""
        self._held: int | None = None
        """Number of the part between the fingers."""
        self._grip = placement(None)
        """Pose of that part in the frame of the flange."""
        self._part = Payload()
        """Body of the part that is held, or was last."""
        self._share = 0
        """Ticks of `TRANSFER` by which its weight has gone over to the arm."""

    def answer(self, request: bytes) -> bytes:
        """Carry out a request of the gripper's protocol; see `urcap`.

        Raises:
            ValueError: There is no gripper.
        """
        if self.gripper is None:
            raise ValueError("the cell has no gripper")
        return answer(self.gripper, request)

    def reaches(self, address: str, port: int) -> bool:
        """Return whether a program that connects to a machine reaches the gripper."""
        return self.gripper is not None and port == PORT and address.strip().lower() in THIS_MACHINE

    def tick(self, tick: int, q: Floats) -> None:
        """Follow the outputs and the arm; what the cell does counts from the next tick on.

        Args:
            tick: Number of the tick that has been computed.
            q: Measured joint positions, shape (n,) [rad].
        """
        before, outputs = (self._tool, self._share), self._terminals.digital_outputs
        if self._changers:
            first = self._cell.tools[0]
            self._mount(next((tool for bit, tool in self._changers if outputs & bit), first), q)
        if self.gripper is not None and self._hand is not None:
            self._move_real_fingers(self.gripper, self._hand)
        elif self.gripper is not None:
            self._move_fingers(self.gripper, q)
        if self._held is not None:
            self._share = min(self._share + 1, TRANSFER)
        elif self._share:
            self._share -= 1
        if (self._tool, self._share) != before and isinstance(self._plant, Loadable):
            self._plant.load(joined(self._load, self._part, self._share / TRANSFER))
        mask, values = self._wires.tick(tick, outputs)
        if mask:
            self._terminals.set_digital_inputs(mask, values)

    # ------------------------------------------------------------------ parts

    def _mount(self, tool: Tool, q: Floats) -> None:
        if tool is self._tool:
            return
        if self._held is not None:
            self._put_down(q)
            self._share = 0  # it stays behind with the tool
        self._tool = tool
        self._load = self._first_load if tool is self._cell.tools[0] else tool_body(tool)
        self._emit("text", why=f"cell: the tool {tool.name} ({tool.mass:g} kg) is on the flange")

    def _move_real_fingers(self, gripper: Gripper, hand: Gripping) -> None:
        """Move fingers that touch things: what stops them is between them, and what they hold does not fall."""
        opening = hand.opening()
        if gripper.holds and opening < gripper.opening - STALLED:
            self._emit("warning", why="cell: the gripper has lost what it held")
            gripper.lose()

        def meet(_: float, narrow: float) -> float | None:
            return opening if opening - narrow > STALLED else None

        moved = gripper.tick(meet)
        if moved.gripped:
            self._emit("text", why=f"cell: the gripper holds something {1e3 * opening:.1f} mm wide")
        hand.grip(0.0 if gripper.holds else gripper.opening, gripper.grip_force)

    def _move_fingers(self, gripper: Gripper, q: Floats) -> None:
        moved = gripper.tick(lambda wide, narrow: self._between(wide, narrow, q))
        if moved.released and self._held is not None:
            self._put_down(q)
        if moved.gripped and self._met is not None:
            self._pick_up(self._met, q)
        if moved.met_nothing:
            self._tell_missed(q)

    def _between(self, wide: float, narrow: float, q: Floats) -> float | None:
        """Return the width of the part that fingers meet on their way between two openings [m]; see `Meet`."""
        self._met, limits, nearest = None, self._cell.gripper, np.inf
        if limits is None or self._tool is not self._cell.gripping_tool:  # the fingers are not on the arm
            return None
        for number, part in enumerate(self._cell.parts):
            if narrow <= part.size[1] <= wide + 1e-9:
                distance, angle = self._away(number, q)
                if distance <= min(limits.tolerance, nearest) and angle <= limits.angle_tolerance:
                    self._met, nearest = number, distance
        return None if self._met is None else self._cell.parts[self._met].size[1]

    def _flange(self, q: Floats) -> Placement:
        return Placement(*self._kinematics.pose(q))

    def _away(self, number: int, q: Floats) -> tuple[float, float]:
        """Distance [m] and angle [rad] between a part and the tool centre point."""
        away = (self._flange(q) @ self._tcp).inverse @ self._places[number]
        cosine = max(np.trace(away.rotation), np.trace(away.rotation @ _SWAPPED)) / 2.0 - 0.5
        return float(np.linalg.norm(away.position)), float(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def _pick_up(self, number: int, q: Floats) -> None:
        part = self._cell.parts[number]
        self._grip = self._flange(q).inverse @ self._places[number]
        self._held, self._part, self._share = number, part_body(part, self._grip), 0
        self._emit("text", why=f"cell: the gripper holds {part.name} ({part.mass:g} kg)")

    def _put_down(self, q: Floats) -> None:
        assert self._held is not None
        place = self._places[self._held] = self._flange(q) @ self._grip
        where = ", ".join(f"{value:.4f}" for value in place.vector)
        self._emit("text", why=f"cell: {self._cell.parts[self._held].name} lies at p[{where}]")
        self._held = None

    def _tell_missed(self, q: Floats) -> None:
        """Warn of a part that was nearly gripped."""
        limits = self._cell.gripper
        away = [(*self._away(number, q), part.name) for number, part in enumerate(self._cell.parts)]
        if limits is None or self._tool is not self._cell.gripping_tool or not away or min(away)[0] > NEAR:
            return
        distance, angle, name = min(away)
        self._emit(
            "warning",
            why=f"the gripper closed on nothing: {name} lies {1e3 * distance:.1f} mm and {angle:.2f} rad from the tool "
            f"centre point; it is gripped within {1e3 * limits.tolerance:g} mm and {limits.angle_tolerance:g} rad",
        )
