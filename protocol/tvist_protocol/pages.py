"""Text of the generated pages of the protocol's reference, with the tables of `tables.py`."""

from tvist_protocol.tables import tables

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


def pages() -> dict[str, str]:
    """Return the Markdown of every generated page, by the name of its file."""
    parts = tables()
    return {"messages.md": MESSAGES.format(**parts), "protocol.md": PROTOCOL.format(**parts)}
