"""Content of a cell file: wires, tools, a gripper and parts."""

from collections.abc import Sequence
from typing import Annotated, Literal, get_args

from msgspec import Meta, Struct

from tvist_plant.description import is_real_body
from tvist_protocol.values import Inertia6, Mass, Payload, Pose, Vec3

Terminal = Literal[
    "standard 0", "standard 1", "standard 2", "standard 3",
    "standard 4", "standard 5", "standard 6", "standard 7",
    "configurable 0", "configurable 1", "configurable 2", "configurable 3",
    "configurable 4", "configurable 5", "configurable 6", "configurable 7",
    "tool 0", "tool 1",
]  # fmt: skip
"""Name of a digital terminal, in bit order of inputs and outputs."""
MAX_THINGS = 100  # largest number each of wires, tools and parts
STROKES = {"2F-85": 0.085, "2F-140": 0.14}  # opening of each gripper model [m]

Name = Annotated[str, Meta(min_length=1, max_length=64)]
HeavyMass = Annotated[float, Meta(gt=0, le=100)]
Edge = Annotated[float, Meta(gt=0, le=10)]


class _Table(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """A table of the file."""


class CellWire(_Table, frozen=True, kw_only=True):
    """A wire from a digital output to a digital input, or a valve, relay or sensor that acts like one."""

    output: Terminal  # output: `standard 0` to `7`, `configurable 0` to `7`, `tool 0` or `1`
    input: Terminal  # input, named likewise; an input has only one wire
    after: Annotated[float, Meta(ge=0, le=3600)] = 0.0
    """Delay of the input, rounded to ticks of 2 ms, at least one tick [s]."""
    inverted: bool = False  # whether the input is on while the output is off


class Tool(_Table, frozen=True, kw_only=True):
    """A tool. The first is mounted on the flange, and its TCP and payload are declared at the start."""

    name: Name  # name for messages
    mass: Mass  # mass [kg]
    cog: Vec3  # centre of gravity in the flange frame [m]
    tcp: Pose  # tool centre point in the flange frame: x y z [m] and rotation vector [rad]
    inertia: Inertia6 = (0.0,) * 6
    """Moments of inertia xx xy xz yy yz zz about the centre of gravity, flange axes [kg m²]."""
    while_on: Terminal | None = None
    """Digital output of a tool changer (see `CellWire.output`): while on, this tool replaces the first one."""


def as_declared(tool: Tool) -> Payload:
    """Return a tool as the payload that a client would declare."""
    return Payload(mass=tool.mass, com=tool.cog, inertia=tool.inertia)


class GripperModel(_Table, frozen=True, kw_only=True):
    """A two-finger gripper on one of the tools; it answers like a Robotiq 2F."""

    model: Literal["2F-85", "2F-140"]  # model; it opens by 85 mm or 140 mm
    tool: str | None = None  # name of its tool [the first]
    activated: bool = False
    """Whether it is activated at the start; otherwise a program activates it, as after power-on."""
    tolerance: Annotated[float, Meta(gt=0, le=0.1)] = 0.005
    """Largest distance between part and tool centre point at which the fingers grip [m]."""
    angle_tolerance: Annotated[float, Meta(gt=0, le=3.15)] = 0.2
    """Largest angle between the two; a half turn about z only swaps the fingers [rad]."""

    @property
    def stroke(self) -> float:
        """Distance between the open fingers [m]."""
        return STROKES[self.model]


class Workpiece(_Table, frozen=True, kw_only=True):
    """A box that can be gripped."""

    name: Name  # name for messages
    mass: HeavyMass  # mass [kg]
    size: tuple[Edge, Edge, Edge]  # edge lengths along x y z of its own frame; fingers close along y [m]
    pose: Pose  # pose in the base frame: that of a tool centre point that grips it in the middle
    cog: Vec3 = (0.0, 0.0, 0.0)  # centre of gravity in its own frame [m]

    @property
    def inertia(self) -> Inertia6:
        """Moments of inertia of a homogeneous box about its centre, own axes [kg m²]."""
        x, y, z = (edge * edge * self.mass / 12.0 for edge in self.size)
        return y + z, 0.0, 0.0, x + z, 0.0, x + y


class Cell(_Table, frozen=True, kw_only=True):
    """The cell around one robot."""

    wires: Annotated[tuple[CellWire, ...], Meta(max_length=MAX_THINGS)] = ()  # wires between terminals
    tools: Annotated[tuple[Tool, ...], Meta(max_length=MAX_THINGS)] = ()
    """Tools; the first is mounted on the flange."""
    gripper: GripperModel | None = None  # gripper; None for none
    parts: Annotated[tuple[Workpiece, ...], Meta(max_length=MAX_THINGS)] = ()
    """Parts that the gripper can grip."""
    world: Annotated[str, Meta(min_length=1, max_length=4096)] | None = None
    """Scene around the arm, as `tvist serve --world`; its bodies are gripped, and `parts` stays empty."""

    @property
    def gripping_tool(self) -> Tool | None:
        """Tool of the gripper; None without a gripper."""
        if self.gripper is None or self.gripper.tool is None:
            return self.tools[0] if self.gripper is not None else None
        return next(tool for tool in self.tools if tool.name == self.gripper.tool)

    def check(self) -> None:
        """Check what the types of the fields cannot express."""
        for number, first in _repeated([wire.input for wire in self.wires]):
            wired = self.wires[number].input
            raise ValueError(f"wires[{number}].input is {wired!r}: must differ from that of wires[{first}]")
        self._check_tools()
        _check_names("tools", [tool.name for tool in self.tools])
        _check_names("parts", [part.name for part in self.parts])
        if self.world is not None and self.parts:
            raise ValueError(f"world is {self.world!r}, in which bodies are gripped: leave parts out")
        if self.gripper is None:
            if self.parts:
                raise ValueError("parts need a gripper: add the table [gripper]")
            return
        known = [tool.name for tool in self.tools]
        if not known:
            raise ValueError(
                "gripper needs a tool that it is part of, whose tcp says where it grips: add [[tools]]"
            )
        if self.gripper.tool is not None and self.gripper.tool not in known:
            raise ValueError(f"gripper.tool is {self.gripper.tool!r}: must be one of {', '.join(known)}")
        for number, part in enumerate(self.parts):
            if part.size[1] >= self.gripper.stroke:
                raise ValueError(
                    f"parts[{number}].size[1] is {part.size[1]:g}: must be less than {self.gripper.stroke:g} m, "
                    f"the opening of a {self.gripper.model}"
                )

    def _check_tools(self) -> None:
        for number, tool in enumerate(self.tools):
            if not is_real_body(tool.inertia):
                raise ValueError(
                    f"tools[{number}].inertia is {list(tool.inertia)}: no body has these moments of inertia"
                )
            if (tool.while_on is None) != (number == 0):
                raise ValueError(
                    "tools[0].while_on must be left out: that tool is on the flange while no other is"
                    if number == 0
                    else f"tools[{number}].while_on is missing: only the first tool is on the flange without an output"
                )


def bit_of(terminal: Terminal) -> int:
    """Return the bit of a digital terminal among inputs or outputs."""
    return 1 << get_args(Terminal).index(terminal)


def _repeated(names: Sequence[str]) -> list[tuple[int, int]]:
    """Return two indices for each repeated name: those of the repetition and of the first occurrence."""
    return [(number, names.index(name)) for number, name in enumerate(names) if name in names[:number]]


def _check_names(key: str, names: Sequence[str]) -> None:
    for number, first in _repeated(names):
        raise ValueError(
            f"{key}[{number}].name is {names[first]!r}: must differ from the name of {key}[{first}]"
        )
    for number, name in enumerate(names):
        if not name.isprintable():
            raise ValueError(f"{key}[{number}].name is {name!r}: must be printable characters")
