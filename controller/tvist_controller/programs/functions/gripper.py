"""Functions of Robotiq's URCap for programs that do not contain them in their preamble."""

from math import ceil, floor
from typing import Annotated

from tvist_controller.cell.gripper import CLOSED, MOVING, OPEN, Gripper
from tvist_controller.programs.arguments import number, whole
from tvist_controller.programs.functions.family import Family
from tvist_controller.programs.journey import Turns
from tvist_urscript import Fault

_ONE = "1"  # gripper of a call without one; ignored, because the cell has one gripper


Counts = Annotated[int, whole(0, 255)]
Percent = Annotated[int, lambda name, value: ceil(number(name, value, 0.0, 100.0) / 100.0 * 255.0)]
"""A percentage as counts."""


class GripperFunctions(Family):
    """Functions of the cell's gripper."""

    title = "Gripper"

    # ------------------------------------------------------------------ activation

    def rq_activate(self, gripper_socket: object = _ONE) -> None:
        """Activate the gripper unless it is active; it opens its fingers."""
        if self._gripper.read("STA") != 3:
            self.rq_reset(gripper_socket)
            self._write(ACT=1)

    def rq_activate_and_wait(self, gripper_socket: object = _ONE) -> Turns:
        """Activate the gripper unless it is active, and wait for it."""
        yield from self._arm.finish()
        self.rq_activate(gripper_socket)
        while self._gripper.read("STA") != 3:
            yield

    def rq_reset(self, gripper_socket: object = _ONE) -> None:
        """Deactivate the gripper; its fingers stay where they are."""
        self._write(ACT=0, ATR=0)

    def rq_is_gripper_activated(self, gripper_socket: object = _ONE) -> bool:
        """Return whether the gripper is active."""
        return self._gripper.read("STA") == 3

    # ------------------------------------------------------------------ fingers

    def rq_open(self, gripper_socket: object = _ONE) -> None:
        """Start opening the fingers."""
        self.rq_move(0, gripper_socket)

    def rq_close(self, gripper_socket: object = _ONE) -> None:
        """Start closing the fingers."""
        self.rq_move(255, gripper_socket)

    def rq_open_and_wait(self, gripper_socket: object = _ONE) -> Turns:
        """Open the fingers."""
        return self.rq_move_and_wait(0, gripper_socket)

    def rq_close_and_wait(self, gripper_socket: object = _ONE) -> Turns:
        """Close the fingers until they meet a part or each other."""
        return self.rq_move_and_wait(255, gripper_socket)

    def rq_move(self, pos: Counts, gripper_socket: object = _ONE) -> None:
        """Start moving the fingers to a position: 0 is open, 255 closed."""
        self._write(POS=pos, GTO=1)

    def rq_move_and_wait(self, pos: Counts, gripper_socket: object = _ONE) -> Turns:
        """Move the fingers to a position, 0 to 255, or until they meet a part."""
        yield from self._arm.finish()
        self.rq_move(pos, gripper_socket)
        yield from self.rq_wait(gripper_socket)

    def rq_move_and_wait_norm(self, pos_norm: Percent, gripper_socket: object = _ONE) -> Turns:
        """Move the fingers to a position, 0 to 100, or until they meet a part."""
        return self.rq_move_and_wait(pos_norm, gripper_socket)

    def rq_move_and_wait_mm(self, pos_in_mm: object, gripper_socket: object = _ONE) -> Turns:
        """Move the fingers to a distance in millimetres, or until they meet a part."""
        return self.rq_move_and_wait(self._counts(pos_in_mm), gripper_socket)

    def rq_stop(self, gripper_socket: object = _ONE) -> None:
        """Stop the fingers."""
        self._write(GTO=0)

    def rq_go_to(self, gripper_socket: object = _ONE) -> None:
        """Start moving the fingers to the set position."""
        self._write(GTO=1)

    def rq_wait(self, gripper_socket: object = _ONE) -> Turns:
        """Wait until the fingers have stopped."""
        yield from self._arm.finish()
        gripper = self._gripper
        if gripper.read("STA") != 3:
            raise Fault("the gripper is not active: call rq_activate_and_wait() first")
        while gripper.read("OBJ") == MOVING and gripper.read("GTO"):
            yield

    # ------------------------------------------------------------------ settings

    def rq_set_pos(self, pos: Counts, gripper_socket: object = _ONE) -> None:
        """Set the position for `rq_go_to`, 0 to 255."""
        self._write(GTO=0, POS=pos)

    def rq_set_speed(self, speed: Counts, gripper_socket: object = _ONE) -> None:
        """Set the speed of the fingers, 0 to 255."""
        self._write(SPE=speed)

    def rq_set_speed_norm(self, speed_norm: Percent, gripper_socket: object = _ONE) -> None:
        """Set the speed of the fingers, 0 to 100."""
        self.rq_set_speed(speed_norm, gripper_socket)

    def rq_set_force(self, force: Counts, gripper_socket: object = _ONE) -> None:
        """Set the force of the fingers, 0 to 255; without a world, every grip is firm."""
        self._write(FOR=force)

    def rq_set_force_norm(self, force_norm: Percent, gripper_socket: object = _ONE) -> None:
        """Set the force of the fingers, 0 to 100; see `rq_set_force`."""
        self.rq_set_force(force_norm, gripper_socket)

    # ------------------------------------------------------------------ state

    def rq_is_object_detected(self, gripper_socket: object = _ONE) -> bool:
        """Return whether a part has stopped the fingers."""
        return self._gripper.read("OBJ") in {1, 2}

    def rq_is_motion_complete(self, gripper_socket: object = _ONE) -> bool:
        """Return whether the fingers have stopped."""
        return self._gripper.read("OBJ") != MOVING

    def rq_current_pos(self, gripper_socket: object = _ONE) -> int:
        """Return the position of the fingers, 0 to 255."""
        return self._gripper.read("POS") or 0

    def rq_current_pos_norm(self, gripper_socket: object = _ONE) -> int:
        """Return the position of the fingers, 0 to 100."""
        return floor(self.rq_current_pos(gripper_socket) / 255.0 * 100.0)

    def rq_current_pos_mm(self, gripper_socket: object = _ONE) -> float:
        """Return the distance between the fingers in millimetres."""
        return 1e3 * self._gripper.opening

    # ------------------------------------------------------------------ parts

    @property
    def _gripper(self) -> Gripper:
        cell = self._access.cell
        gripper = None if cell is None else cell.gripper
        if gripper is None:
            raise Fault("there is no gripper: give the robot a cell that has one (--cell FILE.toml)")
        return gripper

    def _write(self, **values: int) -> None:
        gripper = self._gripper
        self._arm.then(lambda: gripper.write(values))

    def _counts(self, millimetres: object) -> int:
        """Return the position for a distance of the fingers, rounded to counts."""
        stroke = 1e3 * self._gripper.stroke
        return round(CLOSED - number("pos_in_mm", millimetres, 0.0, stroke) / stroke * (CLOSED - OPEN))
