"""`tvist watch`: show live in the terminal what a robot, or many, are doing."""

import asyncio
import contextlib
import time
from collections.abc import Coroutine
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import out, print_json, waiting

if TYPE_CHECKING:
    from tvist_client.across import ManyStates, Place
    from tvist_client.robot import Robot
    from tvist_protocol.stream import Event, State, Telemetry
EVERY = 0.1
"""Time between two looks [s]."""
STALE_S = 1.0
"""Age of a newest state from which on it is shown in red [s]."""


def watch(
    *where: str,
    name: str | None = None,
    security: Path | None = None,
    namespace: str = "",
    seconds: float | None = None,
    json: bool = False,
) -> None:
    """Show modes, rate, load, joints, accelerometer, estimates and events of a served robot until Control+C.

    If the robot is not ready to move, the second line says why, even if it stopped before the command started.

    Without a name, and if there are several robots, show them all in a table, each with its modes, who has control, its
    rate and its load. Given a key with wildcards such as `tvist/*/state`, show the newest states of all robots that it
    selects, one line each.

    Args:
        where: Zenoh endpoint of the robot or router [tcp/127.0.0.1:7447], and a key of states if it is about many
            robots.
        name: Name of the robot [the only one; if there are several, all of them].
        namespace: Namespace of the robot, if it is served in one; without a name, that of all robots to show.
        security: Folder with this client's certificate, made by tvist keys; the endpoint is then tls/HOST:PORT.
        seconds: Stop after this many seconds.
        json: Print each event, and the state ten times a second, as one JSON object per line; of several robots, one
            object a second.
    """
    if seconds is not None and seconds <= 0.0:
        raise Failure(f"seconds is {seconds:g}: must be more than 0", code=2)
    from tvist_client.readiness import unlock_command
    from tvist_client.robot import ENDPOINT, Robot

    selector, endpoint = _places(where, ENDPOINT)
    if selector is not None:
        _watch_many(selector, endpoint, namespace, security, seconds, json=json)
        return
    if name is None:
        place = _only_robot(endpoint, namespace, security)
        if place is None:
            from tvist_cli.fleet_table import watch_fleet

            showing = watch_fleet(endpoint, namespace, security, json=json)
            _watch_for(seconds, showing, "the robots keep running")
            return
        name, namespace = place.robot, place.namespace
    command, within = unlock_command(endpoint, name, security, namespace), namespace

    async def run(name: str = name) -> None:
        with waiting(f"waiting for {name} at {endpoint}"):
            found = await Robot.connect(endpoint, name, security=security, namespace=within)
        async with found as robot:
            events: list[Event] = []
            told: list[Telemetry] = []
            robot.on_telemetry(lambda telemetry: told.__setitem__(slice(None), [telemetry]))
            robot.on_event(events.append)
            standing = _Standing(robot, command)
            if json:
                robot.on_event(print_json)
            with contextlib.nullcontext() if json else Live(console=out, refresh_per_second=10) as live:
                async for state in robot.states(buffer=1):
                    if live is not None:
                        live.update(_screen(state, events[-5:], await standing.line(state), told))
                    else:
                        print_json(state)
                    await asyncio.sleep(0.1)

    _watch_for(seconds, run(), "the robot keeps running")


def _places(where: tuple[str, ...], default: str) -> tuple[str | None, str]:
    """Tell a key of states, if one is given, from an endpoint."""
    selectors = [word for word in where if "*" in word or word.endswith("/state")]
    endpoints = [word for word in where if word not in selectors]
    if len(selectors) > 1 or len(endpoints) > 1:
        raise Failure("watch takes one endpoint and one key of states: leave the others out", code=2)
    return selectors[0] if selectors else None, endpoints[0] if endpoints else default


def _only_robot(endpoint: str, namespace: str, security: Path | None) -> "Place | None":
    """Return the only robot in a namespace or below it; None if there are several, or none."""
    from tvist_client.fleet import Fleet

    async def look() -> "Place | None":
        async with Fleet(endpoint, security=security, namespace=namespace) as fleet:
            places = list(fleet.places)
            return places[0] if len(places) == 1 else None

    with told():
        try:
            return asyncio.run(look())
        except KeyboardInterrupt:
            raise interrupted("no robot was watched") from None


class _Standing:
    """Whether the robot may be moved, and why not; asked again whenever its modes change or it stops."""

    def __init__(self, robot: "Robot", unlock: str) -> None:
        self._robot, self._unlock = robot, unlock
        self._modes: tuple[int, int] | None = None
        self._line = Text()
        robot.on_event(self._on_event)

    async def line(self, state: "State") -> Text:
        """Return the line for the screen.

        Args:
            state: The newest state.
        """
        modes = (state.robot_mode, state.safety_mode)
        if modes != self._modes:
            from tvist_client.readiness import look

            self._modes = modes  # first, since an event may come meanwhile
            found = await look(self._robot, self._unlock)
            self._line = Text(f"robot_mode {found.robot_mode}   safety_mode {found.safety_mode}")
            if not found.ready:
                self._line.append(f"\n{found.sentence}", style="bold red")
        return self._line

    def _on_event(self, event: "Event") -> None:
        if event.kind in {"protective_stop", "safety_stop"}:
            self._modes = None


def _load(told: "list[Telemetry]") -> Text:
    one = told[0] if told else None
    if one is None or one.due_ticks is None or one.load is None:
        return Text("no load is told: a client steps the time, or no telemetry has come yet", style="dim")
    said = (
        f"{one.ticks_per_second:.1f} ticks/s   missed {one.missed_ticks} of {one.due_ticks}   "
        f"late p99 {one.late_p99_us:.0f} µs   load {100.0 * one.load:.1f} %"
    )
    return Text(f"{said}   overloaded", style="bold red") if one.overloaded else Text(said)


def _screen(state: "State", events: "list[Event]", standing: Text, told: "list[Telemetry]") -> Group:
    joints = Table(show_edge=False, pad_edge=False)
    for column in ("joint", "reference rad", "target rad", "actual rad", "target rad/s²", "moment N m"):
        joints.add_column(column, justify="right")
    for number in range(len(state.actual_q)):
        joints.add_row(
            str(number),
            *(f"{values[number]: .4f}" for values in (state.reference_q, state.target_q, state.actual_q)),
            f"{state.target_qdd[number]: .3f}",
            f"{state.actual_moment[number]: .1f}",
        )
    x, y, z = state.actual_tool_accelerometer
    estimates = ", ".join(
        f"{f:.2f} Hz ζ {d:.3f}" for f, d in zip(state.estimated_f_d, state.estimated_zeta, strict=True)
    )
    return Group(
        standing,
        _load(told),
        Text(f"tick {state.tick}   {state.timestamp:.3f} s   estimated {estimates}"),
        joints,
        Text(
            f"tool accelerometer {x: .2f} {y: .2f} {z: .2f} m/s²   shaper delay {1e3 * state.shaper_delay:.1f} ms"
        ),
        *(Text(f"tick {e.tick}: {e.kind} {e.id or ''} {e.why or ''}", style="dim") for e in events),
    )


def _watch_many(
    selector: str,
    endpoint: str,
    namespace: str,
    security: Path | None,
    seconds: float | None,
    *,
    json: bool,
) -> None:
    """Show the newest states of all robots that a key selects, until Control+C.

    Args:
        selector: Key with wildcards that ends in `/state`.
        endpoint: Endpoint of a router, or of one server.
        namespace: Namespace that precedes the key.
        security: Folder with this client's certificate.
        seconds: Stop after this many seconds.
        json: Print one JSON object per line for each new state, ten times a second at most.
    """
    from tvist_client.across import ManyStates
    from tvist_client.errors import MisuseError

    with told(MisuseError, code=2):
        states = ManyStates(selector, endpoint, security=security, namespace=namespace)

    async def run() -> None:
        async with states:
            if json:
                await _print(states)
            with Live(console=out, auto_refresh=False) as live:
                since = time.monotonic()
                while True:
                    await asyncio.sleep(EVERY)
                    now, since = time.monotonic() - since, time.monotonic()
                    live.update(_table(states, now), refresh=True)

    _watch_for(seconds, run(), "the robots keep running")


async def _print(states: "ManyStates") -> None:
    while True:
        await asyncio.sleep(EVERY)
        for place, newest in states.look().items():
            if newest.received:
                print_json({"namespace": place.namespace, "robot": place.robot, "state": newest.state})


def _table(states: "ManyStates", seconds: float) -> Table:
    from tvist_client.readiness import mode_name
    from tvist_protocol.modes import RobotMode, SafetyMode

    drawn = Table(show_edge=False, pad_edge=False)
    for column in ("robot", "robot mode", "safety mode"):
        drawn.add_column(column, no_wrap=True)
    for column in ("tick", "states/s", "age s", "missed", "fastest joint rad/s", "TCP x, y, z m"):
        drawn.add_column(column, justify="right")
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


def _watch_for(seconds: float | None, watching: Coroutine[Any, Any, None], meanwhile: str) -> None:
    """Watch until the time is over or Control+C ends it, which is a failure with exit code 130.

    Args:
        seconds: Longest time [s]; None: until Control+C.
        watching: What watches, and shows what it sees.
        meanwhile: What goes on without it, such as "the robot keeps running".
    """
    began = time.monotonic()
    with told(), contextlib.suppress(TimeoutError):
        try:
            asyncio.run(asyncio.wait_for(watching, seconds))
        except KeyboardInterrupt:
            raise interrupted(f"watched for {time.monotonic() - began:.1f} s; {meanwhile}") from None
