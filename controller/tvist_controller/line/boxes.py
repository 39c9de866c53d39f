"""The boxes of the paper's Figure 6 after the trajectory generator, in the picture's order."""

from typing import Self

import numpy as np
from msgspec import Struct

from tvist_controller.line.differentiator import Floats
from tvist_controller.line.drive_feed_forward import DriveFeedForward
from tvist_controller.line.inverse_dynamics import InverseDynamics
from tvist_controller.line.limits import arm_limits
from tvist_controller.line.line_filter import LineFilter
from tvist_controller.line.line_tick import SIGNALS, to_drives
from tvist_controller.line.shaped_reference import ShapedReference
from tvist_plant.description import Payload, RobotDescription
from tvist_plant.plant import PERIOD, Plant, Supervised
from tvist_shaping.base import Filter, Posture


class Boxes(Struct, frozen=True, eq=False):
    """Filter, differentiator, inverse dynamics, joint controllers and arm. Only the control line changes them."""

    filter: LineFilter
    """TVIST: shaper, estimator and fractional-delay filter, from the reference to the shaped one."""
    shaped: ShapedReference
    """Shaped reference and its derivatives."""
    dynamics: InverseDynamics
    """Torques of the rigid arm with its declared payload."""
    drives: DriveFeedForward
    """Joint controllers: what the drives are sent for a target."""
    plant: Plant
    """The arm."""
    kernel_parts: tuple[Floats, Floats, Floats]
    """Links, scratch and joint controllers, as `line_tick` takes them."""

    @classmethod
    def of(
        cls,
        description: RobotDescription,
        tvist: Filter,
        q: Floats,
        declared: Payload,
        plant: Plant,
        *,
        compensate_sag: bool = False,
    ) -> Self:
        """Return the boxes of a robot; see `ControlCycle` for the arguments."""
        dynamics = InverseDynamics(description, declared)
        drives = DriveFeedForward(
            description, PERIOD, compensate_sag=compensate_sag, positions=isinstance(plant, Supervised)
        )
        return cls(
            LineFilter(tvist, arm_limits(description)),
            ShapedReference(q, PERIOD),
            dynamics,
            drives,
            plant,
            (dynamics.chain, dynamics.scratch, drives.rows),
        )

    def rest_at(self, q: Floats) -> Floats:
        """Restart at rest at joint positions q, shape (n,) [rad], and return the signals there, see `to_drives`."""
        self.dynamics.settle()
        self.shaped.reset(q)
        self.filter.begin(self.filter.tvist, q)
        self.drives.reset(self.dynamics.gravity(q))
        return self.to_drives(q)

    def enter(self, sample: Floats, posture_of: Posture | None = None) -> None:
        """Change between samples of the joints and of a path's parameter, at rest; see `ShapedReference.enter`."""
        self.shaped.enter(posture_of, sample)
        self.filter.begin(self.filter.tvist, sample, posture_of)

    def to_drives(self, reference: Floats) -> Floats:
        """Return the signals from the shaped reference to the drives, shape (9, n), see `line_tick`.

        Args:
            reference: Reference of this tick before shaping, shape (n,) [rad].
        """
        signals = np.empty((SIGNALS, len(reference)))
        before, middle, last = self.shaped.joints.window
        to_drives(before, middle, last, reference, PERIOD, *self.kernel_parts, signals)
        return signals
