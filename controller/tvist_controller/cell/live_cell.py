"""Simulation of a cell, tick by tick."""

from collections import deque
from collections.abc import Sequence
from typing import Protocol

import numpy as np
import pinocchio as pin

from tvist_controller.cell.description import Cell, CellWire, Tool, bit_of
from tvist_controller.cell.gripper import PORT, Gripper, answer
from tvist_controller.events import Emit
from tvist_controller.kinematics.arm import Arm
from tvist_controller.kinematics.pose import Placement, placement
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.model import Floats, payload_inertia
from tvist_plant.plant import PERIOD, Plant
from tvist_protocol.values import Pose

TRANSFER = 100
"""Ticks (0.2 s) in which a part's weight moves to the arm and back, as when lifted off its support."""
MISSED_BY = 0.1  # distance up to which a missed part causes a warning [m]
THIS_MACHINE = ("127.0.0.1", "localhost", "::1")  # names by which programs address the machine of the URCap
STALLED = 0.004  # lag by which simulated fingers count as stopped by an object [m]
_SWAPPED = np.diag([-1.0, -1.0, 1.0])  # half a turn about z


class Terminals(Protocol):
    """Terminals of the robot and its tool centre point."""

    @property
    def digital_outputs(self) -> int:
        """Digital outputs, one bit each."""

    def set_digital_inputs(self, mask: int, values: int) -> None:
        """Set the digital inputs selected by the mask."""

    def set_tcp(self, pose: Pose) -> None:
        """Declare the tool centre point in the flange frame."""


class Wires:
    """The delayed wires of a cell."""

    def __init__(self, wires: Sequence[CellWire]) -> None:
        self._wires = [
            (bit_of(one.output), bit_of(one.input), max(1, round(one.after / PERIOD)), one.inverted)
            for one in wires
        ]
        self._outputs: int | None = None  # outputs of the last tick; None before the first
        # Entries of one wire are in order of time, since its delay is constant.
        self._under_way: list[deque[tuple[int, bool]]] = [deque() for _ in wires]

    def tick(self, tick: int, outputs: int) -> tuple[int, int]:
        """Return the inputs that change for the next tick as a mask and values; others keep their signal."""
        if outputs == self._outputs and not any(self._under_way):
            return 0, 0
        before, self._outputs = self._outputs, outputs
        mask = values = 0
        for (output, input_, ticks, inverted), waiting in zip(self._wires, self._under_way, strict=True):
            on = bool(outputs & output) != inverted
            if before is None:  # as if the outputs had been so for a long time
                mask, values = mask | input_, values | (input_ if on else 0)
            elif (before ^ outputs) & output:
                waiting.append((tick + ticks, on))
            while waiting and waiting[0][0] <= tick + 1:
                _, on = waiting.popleft()
                mask, values = mask | input_, values & ~input_ | (input_ if on else 0)
        return mask, values


class LiveCell:
    """A checked cell around a robot.

    The plant carries the first tool at the start, unless a test sets another payload.
    """

    def __init__(
        self, cell: Cell, description: RobotDescription, plant: Plant, terminals: Terminals, emit: Emit
    ) -> None:
        if (cell.parts or len(cell.tools) > 1) and not plant.can(Plant.load):
            name = type(plant).__name__
            raise ValueError(
                f"cell: the plant {name} cannot carry another payload while it moves, since it has no load: leave "
                "parts and all tools but one out"
            )
        if cell.tools:
            terminals.set_tcp(cell.tools[0].tcp)
        self._cell, self._plant, self._terminals, self._emit = cell, plant, terminals, emit
        grips = all(plant.can(one) for one in (Plant.mount, Plant.grip, Plant.opening))
        self._hand = plant if grips else None
        self._kinematics = Arm(description)
        self.gripper = (
            None if cell.gripper is None else Gripper(cell.gripper.stroke, activated=cell.gripper.activated)
        )  # the gripper; None for none
        tool = cell.gripping_tool
        self._tcp = placement(None if tool is None else tool.tcp)
        self._changers = [(bit_of(tool.while_on), tool) for tool in cell.tools[1:] if tool.while_on]
        self.begin(plant.payload)

    def begin(self, load: Payload) -> None:
        """Reset to the start; `load` is the carried payload while the gripper holds no part."""
        self._wires = Wires(self._cell.wires)
        if self.gripper is not None:
            self.gripper.begin()
        self._places = [placement(part.pose) for part in self._cell.parts]
        self._tool = self._cell.tools[0] if self._cell.tools else None
        self._load = self.empty = load  # without a part, now and at the start
        self._met: int | None = None  # number of the part met by the closing fingers in this tick
        self._held: int | None = None  # number of the part between the fingers
        self._grip = placement(None)  # pose of that part in the flange frame
        self._part = Payload()  # body of the held or last held part
        self._share = 0  # ticks of `TRANSFER` completed

    def answer(self, request: bytes) -> bytes:
        """Carry out a request of the gripper's protocol."""
        if self.gripper is None:
            raise ValueError("the cell has no gripper")
        return answer(self.gripper, request)

    def reaches(self, address: str, port: int) -> bool:
        """Return whether a program connecting to this address reaches the gripper."""
        return self.gripper is not None and port == PORT and address.strip().lower() in THIS_MACHINE

    def tick(self, tick: int, q: Floats) -> None:
        """Update the cell from outputs and measured posture; effects start with the next tick."""
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
        if (self._tool, self._share) != before and self._plant.can(Plant.load):
            self._plant.load(_joined(self._load, self._part, self._share / TRANSFER))
        mask, values = self._wires.tick(tick, outputs)
        if mask:
            self._terminals.set_digital_inputs(mask, values)

    # ------------------------------------------------------------------ parts

    def _mount(self, tool: Tool, q: Floats) -> None:
        if tool is self._tool:
            return
        if self._held is not None:
            self._put_down(q)
            self._share = 0  # the part stays with the removed tool
        self._tool = tool
        own = Payload(mass=tool.mass, com=tool.cog, inertia=tool.inertia)
        self._load = self.empty if tool is self._cell.tools[0] else own
        self._emit("text", why=f"cell: the tool {tool.name} ({tool.mass:g} kg) is on the flange")

    def _move_real_fingers(self, gripper: Gripper, hand: Plant) -> None:
        """Move fingers whose contacts the plant simulates: an object that stops fingers counts as gripped."""
        opening = hand.opening()
        if gripper.holds and opening < gripper.opening - STALLED:
            self._emit("warning", why="cell: the gripper has lost what it held")
            gripper.holds = False

        def meet(_: float, narrow: float) -> float | None:
            return opening if opening - narrow > STALLED else None

        if gripper.tick(meet).gripped:
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
        """Return the width of the part that closing fingers meet between two openings [m]; see `Meet`."""
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
        """Return distance [m] and angle [rad] between a part and the tool centre point."""
        away = (self._flange(q) @ self._tcp).inverse @ self._places[number]
        cosine = max(np.trace(away.rotation), np.trace(away.rotation @ _SWAPPED)) / 2.0 - 0.5
        return float(np.linalg.norm(away.position)), float(np.arccos(np.clip(cosine, -1.0, 1.0)))

    def _pick_up(self, number: int, q: Floats) -> None:
        part = self._cell.parts[number]
        self._grip = self._flange(q).inverse @ self._places[number]
        own = payload_inertia(Payload(mass=part.mass, com=part.cog, inertia=part.inertia))
        carried = _payload(pin.SE3(self._grip.rotation, self._grip.position).act(own))
        self._held, self._part, self._share = number, carried, 0
        self._emit("text", why=f"cell: the gripper holds {part.name} ({part.mass:g} kg)")

    def _put_down(self, q: Floats) -> None:
        assert self._held is not None
        place = self._places[self._held] = self._flange(q) @ self._grip
        where = ", ".join(f"{value:.4f}" for value in place.vector)
        self._emit("text", why=f"cell: {self._cell.parts[self._held].name} lies at p[{where}]")
        self._held = None

    def _tell_missed(self, q: Floats) -> None:
        limits = self._cell.gripper
        away = [(*self._away(number, q), part.name) for number, part in enumerate(self._cell.parts)]
        if (
            limits is None
            or self._tool is not self._cell.gripping_tool
            or not away
            or min(away)[0] > MISSED_BY
        ):
            return
        distance, angle, name = min(away)
        self._emit(
            "warning",
            why=f"the gripper closed on nothing: {name} lies {1e3 * distance:.1f} mm and {angle:.2f} rad from the tool "
            f"centre point; it is gripped within {1e3 * limits.tolerance:g} mm and {limits.angle_tolerance:g} rad",
        )


def _joined(tool: Payload, part: Payload, share: float) -> Payload:
    """Return tool and part as one body; the part counts with a share of its mass, 0 to 1."""
    if share == 0.0 or part.mass == 0.0:
        return tool
    own = payload_inertia(part)
    return _payload(payload_inertia(tool) + pin.Inertia(share * own.mass, own.lever, share * own.inertia))


def _payload(inertia: pin.Inertia) -> Payload:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.inertia.tolist()
    x, y, z = inertia.lever.tolist()
    return Payload(mass=float(inertia.mass), com=(x, y, z), inertia=(xx, xy, xz, yy, yz, zz))
