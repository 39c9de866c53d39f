"""What the control line computes in a tick."""

from msgspec import Struct

from tvist_controller.line.differentiator import Floats, Target
from tvist_controller.line.drive_feed_forward import MotorReference
from tvist_controller.line.guard import Obstacle
from tvist_controller.line.line_mode import LineMode
from tvist_controller.line.line_tick import QD, QDD, TORQUE, Q
from tvist_plant.drives import DriveCommand
from tvist_plant.plant import Measurement


class Sample(Struct, frozen=True, eq=False, gc=False):
    """Signals along the control line in one tick."""

    mode: LineMode
    """What the line did."""
    reference: Floats
    """q before shaping, shape (n,) [rad]."""
    references: tuple[Floats, Floats, Floats]
    """The last three references before shaping, see `ShapedReference`."""
    window: tuple[Floats, Floats, Floats]
    """The last three shaped references, the newest last, each of shape (n,) [rad]."""
    signals: Floats
    """All signals before the arm, shape (9, n), see `line_tick`."""
    command: DriveCommand
    """What the drives receive."""
    measured: Measurement
    """Measurement of the arm."""
    motors: MotorReference | None = None
    """Motion of the motors that elastic feed-forward asks for; None without it."""
    refused: Obstacle | None = None
    """Why a reference was not played, so that a stop was made instead; None if it was played."""

    external: Floats | None = None
    """Force and torque that a sensor of the user's feels in place of the arm's own, see `wrench`; None without one."""

    @property
    def wrench(self) -> Floats | None:
        """Force and torque at the flange by the sensor that counts, shape (6,) [N, N m]; None without a sensor."""
        return self.measured.wrench if self.external is None else self.external

    @property
    def target(self) -> Target:
        """q* and its derivatives at the previous tick, since central differences cost one tick of delay."""
        return Target(self.signals[Q], self.signals[QD], self.signals[QDD])

    @property
    def unshaped(self) -> tuple[Floats, Floats, Floats] | None:
        """The references before shaping around the tick of the target; None if they are the shaped ones to the bit."""
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
