"""Functions of Robotiq's URCap for programs that do not contain them in their preamble."""

from collections.abc import Callable
from math import ceil, floor
from typing import Annotated, Any

from tvist_controller.cell.gripper import CLOSED, MOVING, OPEN, Gripper
from tvist_controller.programs.arguments import number, whole
from tvist_controller.programs.blended_moves import Turns
from tvist_controller.programs.functions.group import FunctionGroup, described
from tvist_urscript import Fault

_ONE = "1"  # gripper of a call without one; ignored, because the cell has one gripper


Counts = Annotated[int, whole(0, 255)]
Percent = Annotated[int, lambda name, value: ceil(number(name, value, 0.0, 100.0) / 100.0 * 255.0)]
"""A percentage as counts."""


def _reads(what: str, read: Callable[[Gripper], Any]) -> Callable[["GripperFunctions", object], Any]:
    def get(self: "GripperFunctions", gripper_socket: object = _ONE) -> Any:  # noqa: ARG001  see `_ONE`
        return read(self._gripper)

    return described(get, what)


def _writes(what: str, **values: int) -> Callable[["GripperFunctions", object], None]:
    def write(self: "GripperFunctions", gripper_socket: object = _ONE) -> None:  # noqa: ARG001  likewise
        self._write(**values)

    return described(write, what)


def _percent(gripper: Gripper) -> int:
    return floor((gripper.read("POS") or 0) / 255.0 * 100.0)


class GripperFunctions(FunctionGroup):
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

    rq_reset = _writes("Deactivate the gripper; its fingers stay where they are.", ACT=0, ATR=0)
    rq_is_gripper_activated = _reads(
        "Return whether the gripper is active.", lambda one: one.read("STA") == 3
    )

    # ------------------------------------------------------------------ fingers

    rq_open = _writes("Start opening the fingers.", POS=0, GTO=1)
    rq_close = _writes("Start closing the fingers.", POS=255, GTO=1)

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

    rq_stop = _writes("Stop the fingers.", GTO=0)
    rq_go_to = _writes("Start moving the fingers to the set position.", GTO=1)

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

    rq_is_object_detected = _reads(
        "Return whether a part has stopped the fingers.", lambda one: one.read("OBJ") in {1, 2}
    )
    rq_is_motion_complete = _reads(
        "Return whether the fingers have stopped.", lambda one: one.read("OBJ") != MOVING
    )
    rq_current_pos = _reads("Return the position of the fingers, 0 to 255.", lambda one: one.read("POS") or 0)
    rq_current_pos_norm = _reads("Return the position of the fingers, 0 to 100.", _percent)
    rq_current_pos_mm = _reads(
        "Return the distance between the fingers in millimetres.", lambda one: 1e3 * one.opening
    )

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
