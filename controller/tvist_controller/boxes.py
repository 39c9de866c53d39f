"""The boxes of a control period: what each is called, where it is, and which functions it consists of.

Profiles bind to this table alone. Whoever moves or renames one of these functions changes its row here.
"""

from typing import Any, NamedTuple

from tvist_controller.control.drive_feed_forward import DriveFeedForward
from tvist_controller.control.shaped_reference import ShapedReference
from tvist_controller.control.unshaped_reference import UnshapedReference
from tvist_controller.controller import Controller
from tvist_controller.cycle import ControlCycle
from tvist_controller.declared_payload import DeclaredPayload
from tvist_controller.filters import Filters
from tvist_controller.host import Host
from tvist_controller.instruments.snapshot import Instruments
from tvist_controller.line_filter import LineFilter
from tvist_controller.look_ahead import LookAhead
from tvist_controller.motion import MotionControl
from tvist_controller.protection import Protection
from tvist_controller.report import Report
from tvist_controller.reporting import Reporter
from tvist_controller.trajectory import Trajectory
from tvist_plant import flexible_arm
from tvist_plant.flexible_arm import FlexibleArm
from tvist_shaping.estimators.base import Estimator


class Place(NamedTuple):
    """A function of a box: an attribute of a module or class, and of its subclasses that have their own."""

    owner: Any
    name: str


class Box(NamedTuple):
    """A box of a control period."""

    name: str
    within: str | None
    """Name of the box that it is a part of; None for the whole tick."""
    rest: str
    """What its own time is spent on, besides its parts."""
    places: tuple[Place, ...]
    """Its functions. They count only if they are called from the box that it is a part of."""


def _box(name: str, within: str | None, rest: str, *places: tuple[Any, str]) -> Box:
    return Box(name, within, rest, tuple(Place(*place) for place in places))


BOXES: tuple[Box, ...] = (
    _box("tick", None, "host: order of a tick, sinks", (Host, "tick")),
    _box("programs and time-outs", "tick", "", (Controller, "begin_tick")),
    _box("inputs and outputs", "tick", "", (Controller, "changed_io")),
    _box("controller", "tick", "order of its parts", (Controller, "complete_tick")),
    _box("motion control", "controller", "end of motions", (MotionControl, "step")),
    _box("Figure 6", "motion control", "between the boxes", (ControlCycle, "step")),
    _box("trajectory generator", "Figure 6", "", (Trajectory, "next")),
    _box("TVIST filter", "Figure 6", "delay line, weighted sum", (LineFilter, "filter")),
    _box("estimator", "TVIST filter", "", (Estimator, "estimate"), (Estimator, "settle")),
    _box("look-ahead", "Figure 6", "", (LookAhead, "__call__")),
    _box("unshaped reference", "Figure 6", "", (UnshapedReference, "push")),
    _box("differentiator", "Figure 6", "", (ShapedReference, "push")),
    _box("inverse dynamics", "Figure 6", "", (ControlCycle, "_to_drives")),
    _box("drive feed-forward", "Figure 6", "", (DriveFeedForward, "command")),
    _box("plant", "Figure 6", "commands in, measurement out", (FlexibleArm, "step")),
    _box("integrate, evaluate", "plant", "", (flexible_arm, "tick")),
    _box("measure", "plant", "", (FlexibleArm, "_measured")),
    _box("overload", "motion control", "", (Protection, "dangers")),
    _box("payload monitor", "controller", "", (DeclaredPayload, "watch")),
    _box("warnings of filters", "controller", "", (Filters, "watch")),
    _box("reporting", "controller", "", (Reporter, "report")),
    _box("encoding", "tick", "", (Report, "_write")),
    _box("UR instruments", "tick", "", (Instruments, "snapshot")),
)
"""The boxes, each after the one that it is a part of, in the order of a tick."""
