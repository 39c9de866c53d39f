"""Replay a recording's inputs without a clock, and compare the output bit by bit."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from msgspec.structs import fields

from tvist_controller.api.line import OwnShaper, RecordedShaper, Setup
from tvist_controller.api.robot import (
    WORLD,
    Controller,
    OwnPlant,
    Presence,
    RecordedPlant,
    SocketEvent,
    Unreadable,
    load_plant,
)
from tvist_lab.recordings.mcap_file import RecordingFile
from tvist_plant.foreign import check_unpaced
from tvist_plant.variants import VARIANTS
from tvist_protocol.commands import HandOver, Setpoint, TakeControl
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError, TvistError
from tvist_protocol.journal import Entry, lesson_of, message_of
from tvist_protocol.recorded import THIS_BEHAVIOUR
from tvist_protocol.stream import Event, State, Truth
from tvist_server.recording.recorder import Recorder

ALWAYS, PER_STATE = 30_000, 100
"""A recording may have as many ticks as one minute plus this number for each of its states: ticks without
states also take time in a replay."""


class ReplayError(TvistError):
    """A recording cannot be replayed; the message tells why."""


@dataclass
class Replay:
    """States, events and truths of the replay."""

    states: list[State] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    truths: list[Truth] = field(default_factory=list)
    first_difference: str | None = None  # first difference from the original; None if there is none
    notes: list[str] = field(default_factory=list)


def replay(setup: Setup, journal: Sequence[Entry], states: Sequence[State]) -> Replay:
    """Give a new controller the same inputs at the same ticks, and compare its states with the recorded ones.

    `states` start at the recorded controller's first tick. Raises ValueError if the setup is invalid, or if
    its plant, such as a real arm, determines when ticks happen.
    """
    controller, presence, done, names = Controller(setup), Presence(), Replay(), known_fields(states)
    check_unpaced(controller.cycle.plant)
    entries = iter(journal)
    entry = next(entries, None)
    for recorded in states:
        while entry is not None and entry.tick <= recorded.tick:
            while controller.tick_number + 1 < entry.tick:
                _tick(controller, setup, done)
            _give(controller, entry, presence)
            entry = next(entries, None)
        while controller.tick_number < recorded.tick:
            _tick(controller, setup, done)
        if done.first_difference is None:
            done.first_difference = _difference(recorded, done.states[-1], names)
    return done


def replay_file(
    content: RecordingFile,
    output: Path | None = None,
    own_shapers: Sequence[OwnShaper] = (),
    plant: OwnPlant | None = None,
) -> Replay:
    """Replay a recording with its own setup, and optionally record the replay to `output`.

    `own_shapers` and `plant` come from files and are loaded again; a note reports each file that has changed.
    Raises ReplayError if the recording has no setup or starts too late, or if a shaper or plant is missing or
    not needed; ValueError if the setup is invalid, or its plant determines when ticks happen.
    """
    if not content.start:  # empty in recordings made by another program
        raise ReplayError(
            "the recording has no initial setup of its robot: record it with tvist serve --record"
        )
    if content.from_tick is not None:
        raise ReplayError(
            f"the recording starts at tick {content.from_tick}, and only one from tick 0 can be replayed: "
            "publish its messages with --publish"
        )
    if (content.dropped or {}).get("journal"):
        raise ReplayError(
            "the recorder dropped messages of the journal, so the run cannot be repeated: record it again"
        )
    last, there = int(content.recording["tick"][-1]), len(content.recording)
    if last > (most := ALWAYS + PER_STATE * there):
        raise ReplayError(f"the recording ends at tick {last}: must be at most {most} with {there} states")
    used, notes = _used(content.start, own_shapers)
    plant, said = _same_plant(content.start, plant)
    notes += said
    setup = Setup.from_builtins(content.start, used, plant)
    if content.behaviour != THIS_BEHAVIOUR:
        notes.append(
            f"the recording is of behaviour {content.behaviour}, and this is {THIS_BEHAVIOUR}: the last bits of states "
            "differ for that reason"
        )
    done = replay(setup, content.journal, content.states)
    done.notes = notes
    if output is not None:
        _write(setup, content, done, output)
    return done


def _used(start: dict[str, Any], given: Sequence[OwnShaper]) -> tuple[list[OwnShaper], list[str]]:
    """Return the shapers from files in the order of the recording, and a note for each changed file."""
    try:
        recorded = checked(start.get("own_shapers", []), list[RecordedShaper])
    except ProtocolError as error:
        raise ReplayError(f"own_shapers of the recording's start: {error.why}") from error
    by_name = {own.name: own for own in given}
    used, notes = [], []
    for one in recorded:
        place = f"{one.file}:{one.attribute}"
        own = by_name.pop(one.name, None)
        if own is None:
            raise ReplayError(
                f"the robot was served with the shaper {one.name} of {place}, which the recording does not contain: "
                f"give --shaper {place}, or where the file is now"
            )
        used.append(own)
        if own.sha256 != one.sha256:
            notes.append(
                f"{own.file} has changed since the recording was made: states may differ for that reason"
            )
    if by_name:
        name, own = next(iter(by_name.items()))
        raise ReplayError(f"the robot was served without the shaper {name} of {own.place}: leave it out")
    return used, notes


def _same_plant(start: dict[str, Any], given: OwnPlant | None) -> tuple[OwnPlant | None, list[str]]:
    """Return the recorded plant, and a note if its file has changed."""
    try:
        recorded = checked(start["plant"], RecordedPlant) if "plant" in start else None
    except ProtocolError as error:
        raise ReplayError(f"plant of the recording's start: {error.why}") from error
    if recorded is None:
        if given is not None:
            raise ReplayError(f"the robot was served without the plant {given.place}: leave it out")
        return None, []
    if given is None and recorded.place.startswith(WORLD):  # a scene is data: nothing of it is run
        try:
            given = load_plant(recorded.place)
        except ValueError as error:
            raise ReplayError(f"{error}: give --plant {WORLD}FILE, with its place now") from error
    if given is None and recorded.place in VARIANTS:
        return load_plant(recorded.place), []
    if recorded.place.lower().startswith("ur://"):
        raise ReplayError(
            f"the robot was the one at {recorded.place}: a real arm's motion does not follow from the controller's "
            "inputs, so it cannot be replayed: view the recording with tvist log replay --publish"
        )
    if given is None:
        raise ReplayError(
            f"the robot was served with the plant {recorded.place}, which the recording does not contain: give "
            f"--plant {recorded.place}, or where it is now"
        )
    changed = given.sha256 != recorded.sha256
    notes = [f"{given.place} is not what it was when the recording was made: states may differ"]
    return given, notes if changed else []


def _write(setup: Setup, content: RecordingFile, done: Replay, output: Path) -> None:
    if content.info is None:
        raise ReplayError("the recording has no info of its robot")
    truths = {truth.tick: truth for truth in done.truths}
    events = iter(done.events)
    event = next(events, None)
    with Recorder(output, content.info, setup.to_builtins()) as recorder:
        for entry in content.journal:
            recorder.journal(entry)
        for state in done.states:
            while event is not None and event.tick <= state.tick:
                recorder.event(event)
                event = next(events, None)
            recorder.state(state)
            if state.tick in truths:
                recorder.truth(truths[state.tick])


def _tick(controller: Controller, setup: Setup, done: Replay) -> None:
    state, events = controller.tick()
    controller.programs.sockets.orders.clear()  # the journal contains the results of these orders
    done.states.append(state)
    done.events += events
    if setup.truth and (truth := controller.truth()) is not None:
        done.truths.append(truth)


def _give(controller: Controller, entry: Entry, presence: Presence) -> None:
    match entry.kind:
        case "client_seen":  # in recordings from before sessions were distinguished
            presence.seen(entry.client or "", entry.session or "")
        case "client_gone":
            presence.gone(entry.client or "", entry.session or "")
            controller.client_gone(entry.client or "", entry.session or "")
        case "missed":
            controller.counters.missed_ticks += entry.count or 0
        case "socket":
            controller.programs.sockets.hear(SocketEvent.of(entry))
        case "gripper":
            if controller.cell is None:
                raise ReplayError(
                    "the journal has requests for a gripper, but the recorded robot has no cell"
                )
            controller.cell.answer(entry.data or b"")
        case "lesson":
            controller.assumed.learn(lesson_of(entry))
        case "setpoint_refused":
            lease = controller.session.lease
            controller.receive_setpoint(Unreadable(None if lease is None else lease.token, entry.why or ""))
        case _:
            _give_message(controller, entry, presence)


def _give_message(controller: Controller, entry: Entry, presence: Presence) -> None:
    message, session = message_of(entry), entry.session
    if isinstance(message, Setpoint):
        controller.receive_setpoint(message)
        return
    if session is None and isinstance(message, TakeControl | HandOver):
        session = presence.session_of(message.client)
    controller.receive(message, session=session)


def known_fields(states: Sequence[State]) -> list[str]:
    """Return the fields that a recording has; a field that is always None may come from an older version."""
    optional = [field.name for field in fields(State) if field.default is None]
    absent = {name for name in optional if all(getattr(state, name) is None for state in states)}
    return [name for name in State.__struct_fields__ if name not in absent]


def _difference(recorded: State, replayed: State, names: Sequence[str]) -> str | None:
    for name in names:
        before, after = getattr(recorded, name), getattr(replayed, name)
        if before != after:
            return f"tick {recorded.tick}: {name} was {before}, is {after}"
    return None
