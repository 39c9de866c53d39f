"""`tvist watch`: show in the terminal what one or many robots are doing."""

import asyncio
import contextlib
import dataclasses
import time
from collections.abc import Coroutine
from typing import Any

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from tvist_cli.connection import LOCAL, Connection
from tvist_cli.failure import Failure, failing_on, interrupted
from tvist_cli.output import number, out, print_json, waiting
from tvist_client.errors import MisuseError
from tvist_client.fleet import Fleet, FleetRobot
from tvist_client.fleet_session import ManyStates
from tvist_client.readiness import look, mode_name
from tvist_client.robot import Robot
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import Event, State, Telemetry

REFRESH_S = 0.1  # time between two readings of states [s]
FLEET_EVERY = 1.0  # time between two readings of a fleet [s]
STALE_S = 1.0  # age above which a newest state is shown in red [s]


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
    if seconds is not None and seconds <= 0.0:
        raise Failure(f"seconds is {seconds:g}: must be more than 0", code=2)
    if states is not None:
        if at.name is not None:
            raise Failure("--states is about many robots: leave --name out", code=2)
        with failing_on(MisuseError, exit_code=2):
            many = ManyStates(states, at.endpoint, security=at.security, namespace=at.namespace)
        _watch_for(seconds, _watch_states(many, json=json), "the robots keep running")
        return
    one = at if at.name is not None else _only_robot(at)
    if one is None:
        _watch_for(seconds, _watch_fleet(at, json=json), "the robots keep running")
    else:
        _watch_for(seconds, _watch_robot(one, json=json), "the robot keeps running")


def _only_robot(at: Connection) -> Connection | None:
    """Return the only robot in a namespace or below it; None if there are several, or none."""

    async def find() -> Connection | None:
        async with Fleet(at.endpoint, security=at.security, namespace=at.namespace) as fleet:
            places = list(fleet.places)
        if len(places) != 1:
            return None
        return dataclasses.replace(at, name=places[0].robot, namespace=places[0].namespace)

    with failing_on():
        try:
            return asyncio.run(find())
        except KeyboardInterrupt:
            raise interrupted("no robot was watched") from None


async def _watch_robot(at: Connection, *, json: bool) -> None:
    with waiting(f"waiting for {at.name} at {at.endpoint}"):
        found = await at.robot()
    async with found as robot:
        events: list[Event] = []
        load: list[Telemetry] = []
        robot.on_telemetry(lambda telemetry: load.__setitem__(slice(None), [telemetry]))
        robot.on_event(events.append)
        standing = _Standing(robot, at.unlock_command(str(at.name)))
        if json:
            robot.on_event(print_json)
        with contextlib.nullcontext() if json else Live(console=out, refresh_per_second=10) as live:
            async for state in robot.states(buffer=1):
                if live is not None:
                    live.update(_robot_screen(state, events[-5:], await standing.line(state), load))
                else:
                    print_json(state)
                await asyncio.sleep(REFRESH_S)


async def _watch_fleet(at: Connection, *, json: bool) -> None:
    """Show all robots that a router or server reaches until cancelled: their state and what keeps them from moving."""
    async with Fleet(at.endpoint, security=at.security, namespace=at.namespace) as fleet:
        await fleet.listen()
        with contextlib.nullcontext() if json else Live(console=out, auto_refresh=False) as live:
            while True:
                robots = await fleet.look()
                if live is not None:
                    live.update(_fleet_screen(robots, at.endpoint), refresh=True)
                else:
                    print_json({"robots": robots})
                await asyncio.sleep(FLEET_EVERY)


async def _watch_states(states: ManyStates, *, json: bool) -> None:
    """Show the newest states of all robots that a key selects until cancelled."""
    async with states:
        with contextlib.nullcontext() if json else Live(console=out, auto_refresh=False) as live:
            since = time.monotonic()
            while True:
                await asyncio.sleep(REFRESH_S)
                now, since = time.monotonic() - since, time.monotonic()
                if live is not None:
                    live.update(_states_table(states, now), refresh=True)
                    continue
                for place, newest in states.look().items():
                    if newest.received:
                        shown = {"namespace": place.namespace, "robot": place.robot, "state": newest.state}
                        print_json(shown)


class _Standing:
    """Whether the robot can be moved, and why not; asked again whenever its modes change or it stops."""

    def __init__(self, robot: Robot, unlock: str) -> None:
        self._robot, self._unlock = robot, unlock
        self._modes: tuple[int, int] | None = None
        self._line = Text()
        robot.on_event(self._on_event)

    async def line(self, state: State) -> Text:
        """Return the line for the screen."""
        modes = (state.robot_mode, state.safety_mode)
        if modes != self._modes:
            self._modes = modes  # first, since an event may come meanwhile
            found = await look(self._robot, self._unlock)
            self._line = Text(f"robot_mode {found.robot_mode}   safety_mode {found.safety_mode}")
            if not found.ready:
                self._line.append(f"\n{found.sentence}", style="bold red")
        return self._line

    def _on_event(self, event: Event) -> None:
        if event.kind in {"protective_stop", "safety_stop"}:
            self._modes = None


def _load(telemetry: list[Telemetry]) -> Text:
    one = telemetry[0] if telemetry else None
    if one is None or one.due_ticks is None or one.load is None:
        return Text("no load is told: a client steps the time, or no telemetry has come yet", style="dim")
    said = (
        f"{one.ticks_per_second:.1f} ticks/s   missed {one.missed_ticks} of {one.due_ticks}   "
        f"late p99 {one.late_p99_us:.0f} µs   load {100.0 * one.load:.1f} %"
    )
    return Text(f"{said}   overloaded", style="bold red") if one.overloaded else Text(said)


def _robot_screen(state: State, events: list[Event], standing: Text, telemetry: list[Telemetry]) -> Group:
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


def _states_table(states: ManyStates, seconds: float) -> Table:
    drawn = _columns(
        "tick", "states/s", "age s", "missed", "fastest joint rad/s", "TCP x, y, z m",
        words=("robot", "robot mode", "safety mode"),
    )  # fmt: skip
    now = asyncio.get_running_loop().time()
    for place, (state, received, at) in states.look().items():
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
    """Return an empty table with text columns and then number columns; robot names are never cut."""
    drawn = Table(show_edge=False, pad_edge=False)
    for title in words:
        drawn.add_column(title, no_wrap=title == "robot")
    for title in numbers:
        drawn.add_column(title, justify="right", no_wrap=title == "missed")
    return drawn


def _watch_for(seconds: float | None, watching: Coroutine[Any, Any, None], meanwhile: str) -> None:
    """Watch for `seconds`, or with None until Control+C, which raises a Failure that tells what keeps running."""
    began = time.monotonic()
    with failing_on(), contextlib.suppress(TimeoutError):
        try:
            asyncio.run(asyncio.wait_for(watching, seconds))
        except KeyboardInterrupt:
            raise interrupted(f"watched for {time.monotonic() - began:.1f} s; {meanwhile}") from None
