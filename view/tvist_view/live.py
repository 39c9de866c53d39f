"""The page of a robot on the network: a client that takes the latest state and never holds up the robot."""

import asyncio
import contextlib
import logging
import os
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from viser import ClientHandle, ViserServer

from tvist_client.errors import AnswerTimeoutError, ClientError
from tvist_client.robot import Robot
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.stream import Event, State, Truth
from tvist_view.appearance import Appearance
from tvist_view.chain import Chain, GeometryError
from tvist_view.cockpit import Cockpit
from tvist_view.moments import Moments
from tvist_view.pictures import PLOT_EVERY, pictures
from tvist_view.pilot import Pilot
from tvist_view.plain import plain
from tvist_view.plots import Plots
from tvist_view.scene import DrawnRobot
from tvist_view.signals import History
from tvist_view.stage import is_watched, look_at

log = logging.getLogger("tvist.view")

INFO_S = 1.0
"""Time between two looks at who has control [s]."""
RETRY_S = 2.0
"""Time between two attempts to find the robot [s]."""
NO_TRUTH = (
    "This robot does not publish its deflections, so the arm is drawn stiff. "
    "Serve it with `tvist serve --truth` to see it bend."
)


async def show_robot(
    server: ViserServer,
    endpoint: str,
    name: str,
    security: Path | None,
    namespace: str = "",
    *,
    factor: float = 1.0,
) -> None:
    """Show a robot until cancelled; while there is none the page says so, and waits for it.

    Args:
        server: Server of the page.
        endpoint: Zenoh endpoint of the robot.
        name: Name of the robot.
        security: Folder with a certificate for the robot's server.
        namespace: Namespace of the robot.
        factor: Magnification to begin with.
    """
    notice = _Notice(server, f"Looking for robot {name} at {endpoint} …")
    shown: list[LivePage] = []
    look_at(server, (0.0, 0.0, 0.45), 1.9)

    @server.on_client_connect
    async def _(client: ClientHandle) -> None:  # viser calls both in one loop, in order
        for page in shown:
            page.came(client)

    @server.on_client_disconnect
    async def _(client: ClientHandle) -> None:
        for page in shown:
            page.went(client)

    absent = "No robot"
    while True:
        lead = absent
        try:
            async with await Robot.connect(endpoint, name, security=security, namespace=namespace) as robot:
                lead = "The robot cannot be drawn"
                page = LivePage(server, robot, await robot.info(), factor=factor)
                lead = absent = "The robot has gone"
                notice.end()
                shown.append(page)
                try:
                    await page.run()
                finally:
                    shown.clear()
        except (ClientError, RefusedError, GeometryError) as error:
            notice.say(lead, str(error))
        await asyncio.sleep(RETRY_S)


class _Notice:
    """A sentence at the head of the page and in the terminal, while there is no robot to show."""

    def __init__(self, server: ViserServer, sentence: str) -> None:
        self._said = sentence
        self._words = server.gui.add_markdown(plain(sentence), order=0.0)

    def say(self, lead: str, why: str) -> None:
        """Say why there is no robot, once."""
        if (sentence := f"**{lead}.** {plain(why)}. The page waits for it.") != self._said:
            self._said = self._words.content = sentence
            self._words.visible = True
            log.warning("%s; waiting for the robot", why)

    def end(self) -> None:
        """There is a robot."""
        self._said, self._words.visible = "", False


class LivePage:
    """One robot for as long as it is there.

    Args:
        server: Server of the page.
        robot: The robot.
        info: What it says of itself.
        factor: Magnification to begin with.

    Raises:
        GeometryError: The robot does not tell its geometry, or in a version that is not known.
    """

    def __init__(self, server: ViserServer, robot: Robot, info: Info, *, factor: float = 1.0) -> None:
        if info.geometry is None:
            raise GeometryError(
                f"a {info.model} on a server of version {info.version} does not tell its geometry: arms from a URDF "
                "cannot be drawn, and servers before 0.1.0 must be updated"
            )
        Chain(info.geometry)  # raises before anything is on the page
        self._server, self._robot, self._info = server, robot, info
        self._loop = asyncio.get_running_loop()
        self._pilot = Pilot(robot, f"view-{os.getpid()}", self._say)
        self._history = History(info.geometry.alpha, 2000)
        self._state: State | None = None
        self._io: Io | None = None
        self._moments = Moments()
        self._has_truth = False
        self._cockpits: dict[int, Cockpit] = {}
        self._over = False
        self._posted: set[asyncio.Task[Any]] = set()
        gui = server.gui
        self._folder = gui.add_folder(None, order=10.0)
        with self._folder:
            self._status = gui.add_markdown(f"**{info.name}**: no state yet")
            stop = gui.add_button("STOP", color="red", hint="Stop the arm now; this needs no control.")
            stop.on_click(lambda _: self._post(self._pilot.stop()))
            self._plots = Plots(gui)
            with gui.add_folder("View", order=40.0):
                self._appearance = Appearance(gui, truth=False, why_not=NO_TRUTH, factor=factor)
        self._factor = factor
        self._drawn = DrawnRobot(server.scene, "/robot", info.geometry, info.payload)

    async def run(self) -> None:
        """Show the robot until it has gone.

        Raises:
            ClientError: It has.
        """
        robot, server = self._robot, self._server
        ends = [
            robot.on_state(self._on_state),
            robot.on_truth(self._on_truth),
            robot.on_event(self._on_event),
            robot.on_io(self._on_io),
        ]
        for client in server.get_clients().values():
            self.came(client)
        tasks = [self._loop.create_task(doing) for doing in (self._frames(), self._ask())]
        try:
            await asyncio.gather(*tasks)
        finally:
            for task in tasks:  # one that fails does not end the other
                task.cancel()
            for end in ends:
                end()
            if self._pilot.holder is not None:
                await self._pilot.give_back(self._pilot.holder)
            self._over = True
            self._cockpits.clear()
            self._folder.remove()
            for client in server.get_clients().values():
                client.gui.reset()
            server.scene.remove_by_name("/robot")

    async def _frames(self) -> None:
        async for count in pictures():
            moment = self._moments.newest()
            if moment is not None and is_watched(self._server):  # nothing is drawn for nobody
                with self._server.atomic():
                    self._drawn.show(moment, self._appearance)
                if count % PLOT_EVERY == 0:
                    self._plots.show((self._history.signals(),), moment.state.timestamp)
                    self._tell(moment.state)

    async def _ask(self) -> None:
        """Ask once a second who has control, and which shaper is in use."""
        while True:
            with contextlib.suppress(AnswerTimeoutError):  # slow is not gone
                holder = self._pilot.holder
                self._info = await self._robot.info()
                if (
                    holder == self._pilot.holder
                ):  # control that was taken since the question is not in the answer
                    await self._pilot.heard(self._info.control)
                self._refresh()
            await asyncio.sleep(INFO_S)

    def _refresh(self) -> None:
        for cockpit in self._cockpits.values():
            cockpit.refresh(self._info.control)

    def _tell(self, state: State) -> None:
        robot, safety = _word(RobotMode, state.robot_mode), _word(SafetyMode, state.safety_mode)
        stop = self._info.stop
        why = f" — {plain(stop.why)}" if stop is not None and safety != "NORMAL" else ""
        words = (
            f"**{self._info.name}** {robot}, {safety}{why} · shaper **{plain(self._info.shaper)}** · "
            f"{state.timestamp:.1f} s{_program(self._io)}"
        )
        if self._status.content != words:
            self._status.content = words

    def _on_state(self, state: State) -> None:
        self._state = state
        self._moments.add(state)
        self._history.add(state)

    def _on_io(self, io: Io) -> None:
        self._io = io

    def _on_truth(self, truth: Truth) -> None:
        if not self._has_truth:
            self._has_truth = True
            self._appearance.truth_has_come(self._factor)
        self._moments.add(truth)
        self._history.add_truth(truth)

    def _on_event(self, event: Event) -> None:
        if event.kind in {"protective_stop", "safety_stop", "warning", "lease_lost"} and event.why:
            self._say(event.why)

    def _say(self, sentence: str) -> None:
        for client in self._server.get_clients().values():
            client.add_notification("tvist", sentence, auto_close_seconds=8.0)

    def came(self, client: ClientHandle) -> None:
        """A tab was opened; called in any thread."""
        tab = client.client_id
        self._loop.call_soon_threadsafe(self._open, tab, client)

    def _open(self, tab: int, client: ClientHandle) -> None:
        if not self._over and tab not in self._cockpits:
            angles = None if self._state is None else self._state.target_q
            self._cockpits[tab] = Cockpit(client.gui, tab, self._pilot, self._info, angles, self._post)
            self._cockpits[tab].refresh(self._info.control)

    def went(self, client: ClientHandle) -> None:
        """A tab was closed; called in any thread."""
        self._loop.call_soon_threadsafe(self._cockpits.pop, client.client_id, None)
        self._post(self._pilot.gone(client.client_id))

    def _post(self, doing: Coroutine[Any, Any, Any]) -> None:
        """Run something in the pilot's loop; from any thread."""
        self._loop.call_soon_threadsafe(self._start, doing)

    def _start(self, doing: Coroutine[Any, Any, Any]) -> None:
        task = self._loop.create_task(doing)
        self._posted.add(task)
        task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[Any]) -> None:
        self._posted.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("the page: %s", error, exc_info=error)
        self._refresh()


def _program(io: Io | None) -> str:
    """The program that runs or is paused, and where it is; empty if there is none."""
    if io is None or io.program is None or io.program_state == "STOPPED":
        return ""
    label = "" if io.program_label is None else f" “{plain(io.program_label.name)}”"
    return f" · {plain(io.program)} {io.program_state}, line {io.program_line}{label}"


def _word(kind: type[RobotMode] | type[SafetyMode], number: int) -> str:
    try:
        return kind(number).name
    except ValueError:
        return str(number)
