"""Signals of the control line in a tick."""

from msgspec import Struct

from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.drive_feed_forward import MotorReference
from tvist_controller.line.line_mode import LineMode, Obstacle
from tvist_controller.line.line_tick import QD, QDD, TORQUE, Q
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import Measurement


class Sample(Struct, frozen=True, eq=False, gc=False):
    """Signals along the control line in one tick."""

    mode: LineMode  # mode of the line
    reference: Floats  # q before shaping, shape (n,) [rad]
    references: tuple[Floats, Floats, Floats]
    """The last three references before shaping, see `ShapedReference`."""
    window: tuple[Floats, Floats, Floats]
    """The last three shaped references, newest last, each of shape (n,) [rad]."""
    signals: Floats  # all signals before the arm, shape (9, n), see `line_tick`
    command: DriveCommand  # command to the drives
    measured: Measurement  # measurement of the arm
    motors: MotorReference | None = None  # motor motion of elastic feed-forward; None without it
    refused: Obstacle | None = None
    """Reason for a stop instead of the reference; None if the reference was played."""

    external: Floats | None = None
    """Reading of a user's force sensor that replaces the arm's own, see `wrench`; None without one."""

    @property
    def wrench(self) -> Floats | None:
        """Force and torque at the flange from the sensor in use, shape (6,) [N, N m]; None without one."""
        return self.measured.wrench if self.external is None else self.external

    @property
    def target(self) -> Target:
        """q* and its derivatives at the previous tick, due to central differences."""
        return Target(self.signals[Q], self.signals[QD], self.signals[QDD])

    @property
    def unshaped(self) -> tuple[Floats, Floats, Floats] | None:
        """Unshaped references around the target's tick; None if equal to the shaped ones to the bit."""
        references, shaped = self.references, self.window
        if references is shaped:
            return None
        for k in (2, 1, 0):  # comparing bytes is several times as fast as comparing arrays
            if references[k].tobytes() != shaped[k].tobytes():
                return references
        return None

    @property
    def torque(self) -> Floats:
        """τ* of the rigid arm for the target, shape (n,) [N m]."""
        torque: Floats = self.signals[TORQUE]
        return torque
