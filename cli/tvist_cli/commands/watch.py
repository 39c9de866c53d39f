"""`tvist watch`: show in the terminal what one or many robots are doing."""

import asyncio
import contextlib
import dataclasses
import time
from collections import deque
from collections.abc import AsyncIterator, Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.live import Live
from rich.table import Table
from rich.text import Text

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Misuse, check_range, failing_on, interrupted, interruptible
from tvist_cli.output import number, out, print_json, waiting
from tvist_client.errors import MisuseError
from tvist_client.fleet import Fleet, FleetRobot, ManyStates, NewestState, RobotPlace
from tvist_client.readiness import Readiness, look, mode_name
from tvist_protocol import Event, RobotMode, SafetyMode, State, Telemetry

REFRESH_S = 0.1  # time between two readings of states [s]
FLEET_EVERY = 1.0  # time between two readings of a fleet [s]
STALE_S = 1.0  # age above which the newest state of a robot is shown in red [s]

Frame = tuple[Sequence[Any], RenderableType]  # for one refresh: objects that --json prints, and screen


def watch(
    at: Connection = LOCAL, *, states: str | None = None, seconds: float | None = None, json: bool = False
) -> None:
    """Show modes, rate, load, joints, accelerometer, estimates and events of a served robot until Control+C.

    If the robot is not ready to move, the second line gives the reason, even if it stopped before the command
    started. If there are several robots and no name is given, the command shows all of them in a table, each
    with its modes, the client in control, its rate and its load; with a namespace, only those in or below it.

    Args:
        at: Where the robot is, or the robots are.
        states: Show the newest states of all robots that a key with wildcards selects, one line each:
            `tvist/*/state`, or `**/tvist/*/state` for all namespaces.
        seconds: Stop after this many seconds.
        json: Print each event, and the state ten times a second, as one JSON object per line; for several
            robots, one object a second.
    """
    check_range("seconds", seconds, 0.0, above=True)
    every, what = REFRESH_S, "the robots keep"
    if states is not None:
        if at.name is not None:
            raise Misuse("--states is about many robots: leave --name out")
        with failing_on(MisuseError, exit_code=2):
            many = ManyStates(states, at.endpoint, security=at.security, namespace=at.namespace)
        frames = _states_frames(many)
    elif (one := at if at.name is not None else _only_robot(at)) is None:
        frames, every = _fleet_frames(at), FLEET_EVERY
    else:
        frames, what = _robot_frames(one, json=json), "the robot keeps"
    began = time.monotonic()
    with contextlib.suppress(TimeoutError):
        try:
            asyncio.run(asyncio.wait_for(_show(frames, every, json=json), seconds))
        except KeyboardInterrupt:
            raise interrupted(f"watched for {time.monotonic() - began:.1f} s; {what} running") from None


def _only_robot(at: Connection) -> Connection | None:
    """Return the connection to the only robot in or below a namespace; None unless there is exactly one."""

    async def find() -> Connection | None:
        async with Fleet(at.endpoint, security=at.security, namespace=at.namespace) as fleet:
            places = list(fleet.places)
        if len(places) != 1:
            return None
        return dataclasses.replace(at, name=places[0].robot, namespace=places[0].namespace)

    with interruptible("no robot was watched"):
        return asyncio.run(find())


async def _show(frames: AsyncIterator[Frame], every: float, *, json: bool) -> None:
    """Print each frame as JSON or show it on the screen; pause for `every` after each [s]."""
    with contextlib.ExitStack() as stack:
        live: Live | None = None
        async for objects, screen in frames:
            for one in objects if json else ():
                print_json(one)
            if not json:
                live = live or stack.enter_context(Live(console=out, auto_refresh=False))
                live.update(screen, refresh=True)
            await asyncio.sleep(every)


async def _robot_frames(at: Connection, *, json: bool) -> AsyncIterator[Frame]:
    with waiting(f"waiting for {at.name} at {at.endpoint}"):
        found = await at.robot()
    async with found as robot:
        events, load, line = list[Event](), deque[Telemetry](maxlen=1), Text()
        modes: tuple[int, int] | None = None

        def on_event(event: Event) -> None:
            nonlocal modes
            events.append(event)
            if event.kind in {"protective_stop", "safety_stop"}:
                modes = None  # ask again why the robot cannot be moved

        robot.on_telemetry(load.append)
        robot.on_event(print_json if json else on_event)
        async for state in robot.states(buffer=1):
            now = (state.robot_mode, state.safety_mode)
            if not json and now != modes:
                modes = now  # set before waiting, since an event may reset this meanwhile
                line = _standing(await look(robot, at.unlock_command(str(at.name))))
            yield [state], _robot_screen(state, events[-5:], line, load)


async def _fleet_frames(at: Connection) -> AsyncIterator[Frame]:
    """Yield all robots that a router or server reaches: their state and what keeps them from moving."""
    async with Fleet(at.endpoint, security=at.security, namespace=at.namespace) as fleet:
        await fleet.listen()
        while True:
            robots = await fleet.look()
            yield [{"robots": robots}], _fleet_screen(robots, at.endpoint)


async def _states_frames(states: ManyStates) -> AsyncIterator[Frame]:
    """Yield the newest states of all robots that a key selects."""
    async with states:
        since = time.monotonic()
        await asyncio.sleep(REFRESH_S)
        while True:
            now, since = time.monotonic() - since, time.monotonic()
            newest = states.look()
            yield (
                [
                    {"namespace": place.namespace, "robot": place.robot, "state": one.state}
                    for place, one in newest.items()
                    if one.received
                ],
                _states_table(newest, now),
            )


def _standing(found: Readiness) -> Text:
    """Return the modes and, if the robot cannot be moved, the reason."""
    line = Text(f"robot_mode {found.robot_mode}   safety_mode {found.safety_mode}")
    return line if found.ready else line.append(f"\n{found.sentence}", style="bold red")


def _load(telemetry: Sequence[Telemetry]) -> Text:
    one = telemetry[0] if telemetry else None
    if one is None or one.due_ticks is None or one.load is None:
        return Text("load unknown: a client steps the time, or no telemetry has come yet", style="dim")
    said = (
        f"{one.ticks_per_second:.1f} ticks/s   missed {one.missed_ticks} of {one.due_ticks}   "
        f"late p99 {one.late_p99_us:.0f} µs   load {100.0 * one.load:.1f} %"
    )
    return Text(f"{said}   overloaded", style="bold red") if one.overloaded else Text(said)


def _robot_screen(state: State, events: list[Event], standing: Text, telemetry: Sequence[Telemetry]) -> Group:
    joints = _columns("joint", "reference rad", "target rad", "actual rad", "target rad/s²", "moment N m")
    for joint in range(len(state.actual_q)):
        joints.add_row(
            str(joint),
            *(f"{values[joint]: .4f}" for values in (state.reference_q, state.target_q, state.actual_q)),
            f"{state.target_qdd[joint]: .3f}",
            f"{state.actual_moment[joint]: .1f}",
        )
    x, y, z = state.actual_tool_accelerometer
    estimates = ", ".join(
        f"{f:.2f} Hz ζ {d:.3f}" for f, d in zip(state.estimated_f_d, state.estimated_zeta, strict=True)
    )
    return Group(
        standing,
        _load(telemetry),
        Text(f"tick {state.tick}   {state.timestamp:.3f} s   estimated {estimates}"),
        joints,
        Text(
            f"tool accelerometer {x: .2f} {y: .2f} {z: .2f} m/s²   shaper delay {1e3 * state.shaper_delay:.1f} ms"
        ),
        *(Text(f"tick {e.tick}: {e.kind} {e.id or ''} {e.why or ''}", style="dim") for e in events),
    )


def _fleet_screen(robots: list[FleetRobot], endpoint: str) -> Group:
    if not robots:
        return Group(Text(f"there are no robots at {endpoint}"))
    drawn = _columns(
        "ticks/s", "silent s", "missed", "late p99 µs", "load %",
        words=("namespace", "robot", "model", "robot mode", "safety mode", "control"),
    )  # fmt: skip
    for robot in robots:
        drawn.add_row(
            robot.namespace or "–",
            robot.name,
            robot.model or "no answer",
            robot.robot_mode or "–",
            robot.safety_mode or "–",
            robot.control or "–",
            number(robot.ticks_per_second, 1),
            number(robot.silent_s, 1),
            "–" if robot.due_ticks is None else f"{robot.missed_ticks} of {robot.due_ticks}",
            number(robot.late_p99_us, 0),
            number(None if robot.load is None else 100.0 * robot.load, 1),
            style="bold red" if robot.overloaded or not robot.ready else "",
        )
    return Group(drawn, *(Text(f"{robot.name}: {robot.said}") for robot in robots if robot.said))


def _states_table(newest: Mapping[RobotPlace, NewestState], seconds: float) -> Table:
    drawn = _columns(
        "tick", "states/s", "age s", "missed", "fastest joint rad/s", "TCP x, y, z m",
        words=("robot", "robot mode", "safety mode"),
    )  # fmt: skip
    now = asyncio.get_running_loop().time()
    for place, (state, received, at) in newest.items():
        drawn.add_row(
            str(place),
            mode_name(RobotMode, state.robot_mode),
            mode_name(SafetyMode, state.safety_mode),
            str(state.tick),
            f"{received / seconds:.0f}",
            f"{now - at:.1f}",
            str(state.missed_ticks),
            f"{max(map(abs, state.actual_qd)):.3f}",
            ", ".join(f"{value:.3f}" for value in state.actual_TCP_pose[:3]),
            style="bold red" if now - at > STALE_S else "",
        )
    return drawn


def _columns(*numbers: str, words: tuple[str, ...] = ()) -> Table:
    """Return an empty table with the columns `words` of texts, then `numbers`; robot names are never cut."""
    drawn = Table(show_edge=False, pad_edge=False)
    for title in words:
        drawn.add_column(title, no_wrap=title == "robot")
    for title in numbers:
        drawn.add_column(title, justify="right", no_wrap=title == "missed")
    return drawn
