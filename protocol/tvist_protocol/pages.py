"""The generated pages of the protocol's reference: their text, and tables made from the message types."""

from collections.abc import Iterable, Mapping
from enum import IntEnum
from typing import Any

import msgspec

from tvist_protocol.channels import CHANNELS, COMMANDS, REPLIES, Channel, tag
from tvist_protocol.commands import Setpoint
from tvist_protocol.faults import FAULTS, Fault
from tvist_protocol.info import CalibrationInfo, Info, Limits, Stopping, StopReason
from tvist_protocol.io import Io, Registers
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment, TrajectoryPoint
from tvist_protocol.replies import CODE_MEANINGS
from tvist_protocol.schema import components, field_docs
from tvist_protocol.simulation import StepSetpoint
from tvist_protocol.stream import EVENT_MEANINGS, Event, State, Telemetry, Truth
from tvist_protocol.transitions import OTHER_TRIGGERS, Activity, Control, Stepping, diagram
from tvist_protocol.values import PATTERN_MEANINGS, Payload

Schema = Mapping[str, Any]
Struct = type[msgspec.Struct]
_PARTS: tuple[Struct, ...] = (
    Payload, Registers, StepSetpoint, TrajectoryPoint, JointSegment, LineSegment, ProcessSegment, ArcSegment,
)  # fmt: skip

MESSAGES = """\
# What a client sends

[The protocol](../../../protocol/README.md) has the rules for all messages, [the protocol's tables](protocol.md) the
replies and codes.
This page is made by `python -m tvist_protocol.generate`.

## Commands

The reply to a command is `done` unless its description names another one, or `refused`; a refused command has changed
nothing. Each command with the token of the lease renews the lease.

{commands}

## Set-points

Set-points that arrive early are put in order by `sequence`. A set-point that is malformed, has a wrong token or is
older than the last one played is dropped and counted in `telemetry`.

{setpoint}

## Parts of messages

These parts have no `type`.

{parts}
"""

PROTOCOL = """\
# Protocol tables

The keys, what a robot sends, its codes, modes and faults, and how its activities change.
[The protocol](../../../protocol/README.md) has the rules; [messages](messages.md) has what a client sends.
This page is made by `python -m tvist_protocol.generate`.

## Keys

{keys}

## Replies

{replies}

## Codes

{codes}

## Streams

{streams}

## Kinds of event

{events}

## Modes

{modes}

## Activities

Arrows are labelled with commands and with triggers. Commands that do not change the activity, such as `power_on` at
REST, are not shown.

{transitions}

{happenings}

The activities appear in `state` as follows:

{activities}

## Rights

Control, the right to command the robot:

{control}

The clock, the right to step time in lockstep and in process:

{stepping}

## Faults

`simulation.inject` can cause these faults.

{faults}

## Info

{info}
"""

_LISTS = {
    frozenset(CODE_MEANINGS): "a [code](#codes)",
    frozenset(EVENT_MEANINGS): "a [kind](#kinds-of-event)",
}
"""Choices that have their own table."""


def pages() -> dict[str, str]:
    """Return the Markdown of every generated page, by the name of its file."""
    parts = _tables()
    return {"messages.md": MESSAGES.format(**parts), "protocol.md": PROTOCOL.format(**parts)}


def _tables() -> dict[str, str]:
    """Return the Markdown of every table of the generated pages, by its name."""
    return {
        "keys": markdown_table(("key", "kind", "by", "carries", "what"), map(_channel_row, CHANNELS)),
        "commands": _messages(COMMANDS),
        "setpoint": _messages((Setpoint,)),
        "parts": _messages(_PARTS),
        "replies": _messages(REPLIES),
        "codes": markdown_table(
            ("code", "meaning"), ((f"`{code}`", text) for code, text in CODE_MEANINGS.items())
        ),
        "streams": _messages((State, Event, Truth, Telemetry, Io)),
        "events": markdown_table(
            ("kind", "meaning"), ((f"`{kind}`", text) for kind, text in EVENT_MEANINGS.items())
        ),
        "info": _messages((Info, Limits, Stopping, StopReason, CalibrationInfo)),
        "modes": markdown_table(("field", "numbers"), map(_mode_row, (RobotMode, SafetyMode, RuntimeState))),
        "activities": markdown_table(
            ("state", "`robot_mode`", "`safety_mode`", "meaning"), map(_activity_row, Activity)
        ),
        "transitions": diagram(Activity),
        "control": diagram(Control),
        "stepping": diagram(Stepping),
        "happenings": markdown_table(
            ("trigger", "meaning"), ((f"`{name}`", text) for name, text in OTHER_TRIGGERS.items())
        ),
        "faults": markdown_table(
            ("fault", "meaning", "needs"),
            ((f"`{name}`", fault.meaning, _needs(fault)) for name, fault in FAULTS.items()),
        ),
    }


def _channel_row(channel: Channel) -> tuple[str, ...]:
    many = len(channel.messages) > 4
    carries = "a command" if many else ", ".join(f"`{tag(kind)}`" for kind in channel.messages)
    answers = ", ".join(f"`{tag(kind)}`" for kind in channel.answers)
    both = " → ".join(part for part in (carries, answers) if part) or "–"
    key = channel.key.replace("{", "<").replace("}", ">")
    return f"`{key}`", channel.kind, channel.by, both, channel.meaning


def _mode_row(enum: type[IntEnum]) -> tuple[str, str]:
    name = "".join(f"_{c.lower()}" if c.isupper() else c for c in enum.__name__).removeprefix("_")
    return f"`{name}`", ", ".join(f"{mode.value} {mode.name}" for mode in enum)


def _activity_row(activity: Activity) -> tuple[str, ...]:
    safety = activity.safety_mode(reduced=False)
    shown = safety.name if safety is SafetyMode.PROTECTIVE_STOP else "NORMAL or REDUCED"
    return f"`{activity}`", activity.robot_mode.name, shown, field_docs(Activity)[activity.name]


def _needs(fault: Fault) -> str:
    fields = [*(f"`{field}`" for field in fault.needs), *(f"`{field}` or not" for field in fault.may)]
    return ", ".join(fields) or "–"


def _messages(kinds: tuple[Struct, ...]) -> str:
    _, schemas = components(kinds, "{name}")
    return "\n\n".join(_message(kind, schemas[kind.__name__]) for kind in kinds)


def _message(kind: Struct, schema: Schema) -> str:
    name = kind.__struct_config__.tag or kind.__name__
    fields = {field: part for field, part in schema["properties"].items() if field != "type"}
    text = " ".join((kind.__doc__ or "").split())
    if list(fields) == ["token"]:
        return f"### `{name}`\n\n{text} Carries `token` alone."
    rows = (
        (f"`{field}`", _values(part), _default(field, part, schema), part["description"])
        for field, part in fields.items()
    )
    return f"### `{name}`\n\n{text}\n\n{markdown_table(('field', 'values', 'default', 'meaning'), rows)}"


def _default(field: str, part: Schema, schema: Schema) -> str:
    if field in schema["required"]:
        return "required"
    return "null" if part["default"] is None else f"{part['default']}"


def _values(part: Schema) -> str:
    match part:
        case {"anyOf": choices}:
            words = " or ".join(map(_values, choices))
        case {"$ref": name}:
            words = f"`{name}`"
        case {"enum": names}:
            words = _LISTS.get(frozenset(names)) or ", ".join(f"`{name}`" for name in names)
        case {"prefixItems": items}:
            words = f"list of {len(items)} {_plural(items[0])}"
        case {"type": "array", "items": item}:
            words = f"list of {_count(part, 'minItems', 'maxItems')}{_plural(item)}"
        case {"type": "string", "pattern": pattern}:
            words = PATTERN_MEANINGS[pattern]
        case {"type": "string", "maxLength": _}:
            words = f"string of {_count(part, 'minLength', 'maxLength')}characters"
        case _:
            words = f"{part['type'].replace('object', 'map')}{_bounds(part)}"
    return words


def _plural(part: Schema) -> str:
    kind, space, rest = _values(part).partition(" ")
    return kind if kind.startswith("`") else f"{kind}s{space}{rest}"


def _count(part: Schema, least: str, most: str) -> str:
    return f"{part.get(least, 0)}–{part[most]} " if most in part else ""


def _bounds(part: Schema) -> str:
    signs = (("minimum", "≥"), ("exclusiveMinimum", ">"), ("maximum", "≤"), ("exclusiveMaximum", "<"))
    bounds = [f"{sign} {_number(part[name])}" for name, sign in signs if name in part]
    return f" {', '.join(bounds)}" if bounds else ""


def _number(bound: float) -> str:
    powers = {2**63 - 1: "2⁶³-1", 2**64 - 1: "2⁶⁴-1"}
    return powers.get(int(bound)) or f"{bound:g}".replace("e+0", "e")


def markdown_table(head: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table of a generated page."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ("---",) * len(head), *rows))
