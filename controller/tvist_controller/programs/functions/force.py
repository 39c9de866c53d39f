"""Functions for force control, freedrive and contact detection."""

from typing import Annotated, Any

import numpy as np

from tvist_controller.line.differentiator import Floats
from tvist_controller.motion.force_control import Feature
from tvist_controller.programs import arguments as args
from tvist_controller.programs.blended_moves import Turns
from tvist_controller.programs.functions.group import FunctionContext, FunctionGroup, reads
from tvist_controller.trajectory import ForceTask
from tvist_protocol.forces import Push
from tvist_protocol.io import Length
from tvist_protocol.values import Mass
from tvist_urscript import Array, Fault, costs

MAX_LIMIT = 1e3  # largest limit of an axis; larger values have no effect [m/s, m, rad]
ALL: Any = Array((1,) * 6)
NOWHERE: Any = Array((0,) * 3)


def _axes(name: str, value: object) -> Floats:
    return np.array(
        [args.integer(f"{name}[{k}]", one, 0, 1) for k, one in enumerate(args.numbers(name, value, 6))], float
    )


def _limits(name: str, value: object) -> Floats:
    found = [args.number(f"{name}[{k}]", one, 0.0) for k, one in enumerate(args.numbers(name, value, 6))]
    return np.minimum(found, MAX_LIMIT)


def _feature(name: str, value: object) -> Feature:
    if isinstance(value, Array):
        return args.pose(name, value)
    if value == "base":
        return "base"
    if value == "tool":
        return "tool"
    raise Fault(f'{name} is {args.shown(value)}: it must be "base", "tool" or a pose')


Axes = Annotated[Floats, _axes]
Place = Annotated[tuple[float, ...], args.several(3, Length)]


class ForceFunctions(FunctionGroup):
    """Force control of one robot."""

    title = "Force"

    def __init__(self, on: FunctionContext) -> None:
        super().__init__(on)
        self._damping, self._gain = ForceTask.damping, ForceTask.gain

    @costs(120)
    def force_mode(
        self,
        task_frame: args.Target,
        selection_vector: Axes,
        wrench: Annotated[tuple[float, ...], args.several(6, Push)],
        type: Annotated[int, args.whole(1, 3)],
        limits: Annotated[Floats, _limits],
    ) -> Turns:
        """Comply with forces along the selected axes of a frame, up to a wrench; other axes stay stiff."""
        task = ForceTask(selection_vector, np.array(wrench), limits, self._damping, self._gain)
        yield from self._arm.start_compliance(lambda: self._access.force.begin(task, task_frame, type))

    @costs(100)
    def end_force_mode(self) -> None:
        """End force mode and hold the position; also ends a motion in the other axes."""
        self._arm.end_compliance(by_hand=False)

    def force_mode_set_damping(self, damping: Annotated[float, args.within(0.0, 1.0)]) -> None:
        """Set the damping of force mode in free space, from 0 to 1."""
        self._damping = damping

    def force_mode_set_gain_scaling(self, scaling: Annotated[float, args.within(0.0, 2.0)]) -> None:
        """Scale the gain of force mode, from 0 to 2; above 1 it may become unstable."""
        self._gain = scaling

    @costs(120)
    def freedrive_mode(self, freeAxes: Axes = ALL, feature: Annotated[Feature, _feature] = "base") -> Turns:
        """Let the arm be moved by hand along and about the free axes of a frame."""
        yield from self._arm.start_compliance(lambda: self._access.force.free(freeAxes, feature))

    @costs(100)
    def end_freedrive_mode(self) -> None:
        """End freedrive and hold the position."""
        self._arm.end_compliance(by_hand=True)

    get_freedrive_status = reads(
        "Return 0, or 1 near a singular posture, which hinders moving by hand, or 2 where it prevents it.",
        lambda on: on.access.force.hindrance,
    )

    @costs(120)
    def teach_mode(self) -> Turns:
        """Let the arm be moved by hand in all directions."""
        yield from self.freedrive_mode(np.ones(6))

    end_teach_mode = end_freedrive_mode

    def ft_rtde_input_enable(
        self,
        enable: args.Flag,
        sensor_mass: Mass = 0,
        sensor_measuring_offset: Place = NOWHERE,
        sensor_cog: Place = NOWHERE,
    ) -> Turns:
        """Use a force sensor whose values clients write by RTDE; include its mass in the declared payload."""
        if self._access.guidance.compliant is not None:
            raise Fault(
                "the force sensor stays the same in force mode and freedrive: call end_force_mode before"
            )
        self._access.force.external.use(sensor_measuring_offset if enable else None)
        yield  # from the next tick on, the program reads this sensor

    enable_external_ft_sensor = ft_rtde_input_enable

    @costs(250)
    def tool_contact(self, direction: args.Vector6 | None = None) -> int:
        """Return the number of steps since just before a contact in a direction; 0 without contact."""
        return self._access.force.touched((0.0,) * 3 if direction is None else direction[:3])
