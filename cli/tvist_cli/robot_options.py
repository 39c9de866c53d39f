"""The options of a robot: one for each field of `ServeOptions`, with the field's docstring as its help."""

import inspect
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from cyclopts import Group, Parameter
from msgspec import inspect as types
from msgspec.structs import FieldInfo, fields

from tvist_cli.failure import Misuse
from tvist_cli.misuse import lower
from tvist_cli.offered import PLANTS, PROFILES, ROBOTS, SHAPERS, WORLDS
from tvist_protocol.schema import field_docs
from tvist_server.option_values import read_start_file
from tvist_server.options import ServeOptions

if TYPE_CHECKING:
    from tvist_server.config import ServeConfig

Command = TypeVar("Command", bound=Callable[..., object])
_BOXES = {
    "Robot": "name robot robots workers profile start state programs",
    "Arm and shaper": (
        "plant world hidden cell payload overload adapt calibration shaper shape_servo quiet floor "
        "compensate_sag seed truth"
    ),
    "Real arm": "enable_motion speed_cap tcp servo_lag",
    "Clock": "clock speed realtime_priority",
    "Recording": "record keep dump",
    "Network": "listen connect namespace metrics security insecure",
    "ROS 2": "ros2",
    "UR's interfaces": "ur ur_address ur_ports ur_allow reserve_inputs",
}
"""Boxes of the help, each with its fields."""
_BOX_OF = {
    field: box
    for name, inside in _BOXES.items()
    for box in [Group.create_ordered(name)]
    for field in inside.split()
}
_OFFERED = {"robot": ROBOTS, "robots": ROBOTS, "shaper": SHAPERS, "plant": PLANTS, "world": WORLDS,
            "profile": PROFILES}  # fmt: skip
"""Values for shell completion, by option."""
_READ_AS: dict[type, Any] = {
    types.BoolType: bool, types.IntType: int, types.FloatType: float, types.VarTupleType: list[str],
    types.StructType: list[str],
}  # fmt: skip
"""Type as which an option is parsed, by the type of its field; all others are parsed as text."""
_IN_ANY_CASE = ("profile", "shaper", "clock")


def with_robot_options(only: Collection[str] = ()) -> Callable[[Command], Command]:
    """Add options for `ServeOptions` fields (or `only` some) to a command with last parameter `**given`."""

    def decorate(command: Command) -> Command:
        signature = inspect.signature(command)
        *own, _ = signature.parameters.values()
        options = [_option(field) for field in fields(ServeOptions) if not only or field.name in only]
        # The parser reads a function's options from its signature.
        command.__signature__ = signature.replace(parameters=own + options)  # type: ignore[attr-defined]
        return command

    return decorate


def configuration(given: Mapping[str, Any], file: str | None, **defaults: object) -> "ServeConfig":
    """Merge options: command line overrides file, file overrides `defaults`. StartError if one is invalid."""
    from tvist_server.config import from_mapping

    source = "configuration" if file is None else f"configuration {file}"
    return from_mapping(defaults | content_of(file) | dict(_plain(given)), source)


def content_of(file: str | None) -> dict[str, object]:
    """Return the unchecked content of a configuration file; empty if there is none."""
    return {} if file is None else read_start_file(file, "configuration", dict[str, object])


def _option(field: FieldInfo) -> inspect.Parameter:
    may_be = types.type_info(field.type)
    kind = may_be.types[0] if isinstance(may_be, types.UnionType) else may_be
    read: Any = _READ_AS.get(type(kind), str)
    name = "ur-port" if field.name == "ur_ports" else field.name.replace("_", "-")
    # Options that a profile may switch on need a form that switches them off.
    negative = f"--no-{name}" if read is bool and kind is not may_be else ()
    about = Parameter(name=f"--{name}", negative=negative, help=_help(field), group=_BOX_OF[field.name])
    annotation = Annotated[read | None, _OFFERED.get(field.name, Parameter()), about]
    return inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation)


def _help(field: FieldInfo) -> str:
    """Return a field's docstring; if the default is a number or a word, append it."""
    text, default = field_docs(ServeOptions)[field.name], field.default
    if isinstance(default, bool) or not isinstance(default, str | int | float):
        return text
    word = f"{default:g}" if isinstance(default, float) else default
    return f"{text.removesuffix('.')} [{word}]."


def _plain(given: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    """Convert options to the entries of a configuration file."""
    if not {"ur_address", "ur_ports", "reserve_inputs"}.isdisjoint(given):
        yield "ur", True
    for name, value in given.items():
        if name == "ur_ports":
            yield name, dict(map(_ur_port, value))
        else:
            yield name, lower(value) if name in _IN_ANY_CASE else value


def _ur_port(text: str) -> tuple[str, int]:
    """Split INTERFACE=PORT; the configuration checks the name of the interface."""
    interface, equals, port = text.partition("=")
    if not equals or not (port == "off" or (port.isascii() and port.isdigit() and len(port) < 9)):
        raise Misuse(f"ur-port is {text!r}: must be INTERFACE=PORT such as rtde=31004, or INTERFACE=off")
    return interface, 0 if port == "off" else int(port)
