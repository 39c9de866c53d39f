"""Functions that control the force at the tool, let the arm be moved by hand, and detect contacts."""

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.motion.task_frame import Feature
from tvist_controller.programs.access import Access
from tvist_controller.programs.arguments import bounds, flag, integer, number, numbers, pose, shown
from tvist_controller.programs.arm import ProgramArm
from tvist_controller.programs.journey import Turns
from tvist_controller.trajectory import ForceTask
from tvist_protocol.forces import Push
from tvist_protocol.io import Length
from tvist_protocol.values import Mass
from tvist_urscript import Array, Fault, costs

MOST_LIMIT = 1e3
"""Largest limit of an axis that is passed on: nothing reaches it [m/s, m, rad]."""
ALL = Array((1,) * 6)
NOWHERE = Array((0,) * 3)


class ForceFunctions:
    """Lets one robot give way to forces.

    Args:
        access: The robot.
        arm: Its arm.
    """

    def __init__(self, access: Access, arm: ProgramArm) -> None:
        self._access, self._arm = access, arm
        self._damping, self._gain = ForceTask.damping, ForceTask.gain

    @costs(120)
    def force_mode(
        self, task_frame: object, selection_vector: object, wrench: object, type: object, limits: object
    ) -> Turns:
        """Give way along the axes of a frame that are selected until a wrench is reached, and go on in the others."""
        feature, kind = pose("task_frame", task_frame), integer("type", type, 1, 3)
        task = ForceTask(
            _choice("selection_vector", selection_vector),
            np.array(numbers("wrench", wrench, 6, Push)),
            _limits(limits),
            self._damping,
            self._gain,
        )
        yield from self._arm.give_way(lambda: self._access.force.begin(task, feature, kind))

    @costs(100)
    def end_force_mode(self) -> None:
        """Hold the position again; a motion in the other axes ends, too."""
        self._arm.hold_again(by_hand=False)

    def force_mode_set_damping(self, damping: object) -> None:
        """Set how quickly the arm slows down in force mode where nothing touches it, from 0 to 1."""
        self._damping = number("damping", damping, 0.0, 1.0)

    def force_mode_set_gain_scaling(self, scaling: object) -> None:
        """Scale how strongly force mode answers a difference of forces, from 0 to 2; above 1 it may get unstable."""
        self._gain = number("scaling", scaling, 0.0, 2.0)

    @costs(120)
    def freedrive_mode(self, freeAxes: object = ALL, feature: object = "base") -> Turns:
        """Let the arm be moved by hand along and about the axes of a frame that are free."""
        axes, frame = _choice("freeAxes", freeAxes), _feature(feature)
        yield from self._arm.give_way(lambda: self._access.force.free(axes, frame))

    @costs(100)
    def end_freedrive_mode(self) -> None:
        """Hold the position again."""
        self._arm.hold_again(by_hand=True)

    def get_freedrive_status(self) -> int:
        """Return 0, or 1 where a singular posture hinders the arm from being moved by hand, 2 where it forbids it."""
        return self._access.force.hindrance

    @costs(120)
    def teach_mode(self) -> Turns:
        """Let the arm be moved by hand in all directions."""
        yield from self.freedrive_mode()

    @costs(100)
    def end_teach_mode(self) -> None:
        """Hold the position again."""
        self._arm.hold_again(by_hand=True)

    def ft_rtde_input_enable(
        self,
        enable: object,
        sensor_mass: object = 0,
        sensor_measuring_offset: object = NOWHERE,
        sensor_cog: object = NOWHERE,
    ) -> Turns:
        """Use the force sensor whose values clients write by RTDE; its mass is part of the payload to declare."""
        number("sensor_mass", sensor_mass, *bounds(Mass))
        numbers("sensor_cog", sensor_cog, 3, Length)
        offset = numbers("sensor_measuring_offset", sensor_measuring_offset, 3, Length)
        if self._access.force.compliant is not None:
            raise Fault(
                "the force sensor stays the same in force mode and freedrive: call end_force_mode before"
            )
        self._access.force.external.use(offset if flag("enable", enable) else None)
        yield  # what the program asks for next is told by that sensor

    enable_external_ft_sensor = ft_rtde_input_enable

    @costs(250)
    def tool_contact(self, direction: object = None) -> int:
        """Return the number of steps since just before the tool touched something in a direction; 0 if it does not."""
        way = (0.0,) * 3 if direction is None else numbers("direction", direction, 6)[:3]
        return self._access.force.touched(way)


def _choice(name: str, value: object) -> Floats:
    return np.array(
        [integer(f"{name}[{k}]", one, 0, 1) for k, one in enumerate(numbers(name, value, 6))], float
    )


def _limits(value: object) -> Floats:
    found = [number(f"limits[{k}]", one, 0.0) for k, one in enumerate(numbers("limits", value, 6))]
    return np.minimum(found, MOST_LIMIT)


def _feature(value: object) -> Feature:
    if isinstance(value, Array):
        return pose("feature", value)
    if value == "base":
        return "base"
    if value == "tool":
        return "tool"
    raise Fault(f'feature is {shown(value)}: it must be "base", "tool" or a pose')
