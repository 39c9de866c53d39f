"""A robot on the network that tabs show: find it, describe it, subscribe while it is shown, and move it."""

import asyncio
import contextlib
import itertools
import logging
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tvist_client.errors import AnswerTimeoutError, ClientError
from tvist_client.robot import Robot
from tvist_client.transports.zenoh import robots_at
from tvist_protocol.errors import RefusedError
from tvist_protocol.info import Info
from tvist_protocol.io import Io
from tvist_protocol.modes import RobotMode
from tvist_protocol.stream import Event
from tvist_view import tab_messages
from tvist_view.described import ObservedArm, described, state_in_words
from tvist_view.look import GeometryError, Look, Meshes
from tvist_view.pilot import Pilot
from tvist_view.request_handler import Judge, RequestHandler
from tvist_view.signals import LatestSignals, after_stop
from tvist_view.stage import Tab

log = logging.getLogger("tvist.view")

FRAME_S = 1.0 / 30.0  # time between two frames [s]
NOTES_EVERY = 6  # frames between two updates of the note on the last stop
INFO_S = 1.0  # time between two queries of which client has control [s]
RETRY_S = 2.0  # time between two attempts to find the robot [s]
MOST_ASKED = 16  # most requests of a tab that are carried out at once; further ones wait
SHOWN_EVENTS = {"protective_stop", "safety_stop", "warning", "lease_lost"}
"""Kinds of events whose reason the page shows."""


@dataclass(frozen=True)
class RobotPlace:
    """Where robots are found."""

    endpoint: str  # zenoh endpoint
    security: Path | None = None  # folder with a certificate for the robot's server
    namespace: str = ""  # namespace of the robots


@dataclass(eq=False)
class Watcher:
    """A tab, and what has been sent to it."""

    tab: Tab
    robot: "ShownRobot | None" = None
    waiting: list[tuple[str, dict[str, Any]]] = field(default_factory=list)
    tasks: set[asyncio.Task[Any]] = field(default_factory=set)  # its requests that are being carried out
    status: dict[str, Any] = field(default_factory=dict)
    count: int = 0
    free: bool = True
    """Whether the tab has drawn its last frame; frames queued in a slow browser would delay everything after them."""

    def put(self, kind: str, content: dict[str, Any]) -> None:
        """Queue a message for the next frame."""
        self.waiting.append((kind, content))

    def say(self, sentence: str) -> None:
        """Show a notice."""
        self.put("notice", {"text": sentence})

    async def tell(self) -> None:
        """Send the tab new messages and states, frame by frame; a slow tab gets fewer frames."""
        loop, note = asyncio.get_running_loop(), ""
        due = loop.time()
        for number in itertools.count():
            due = max(due, loop.time())  # after a late frame, do not hurry to make up for the delay
            await asyncio.sleep(due - loop.time())
            due += FRAME_S
            waiting, self.waiting = self.waiting, []
            for kind, content in waiting:
                await self.tab.send(kind, content)
            robot = self.robot
            if robot is None or (running := robot.running) is None:
                continue
            if (status := robot.status(self.tab.number)) is not None and status != self.status:
                self.status = status
                await self.tab.send("status", status)
            running.update()
            if (row := running.row()) is None or running.state is None or not self.free:
                continue
            self.free = False
            if number % NOTES_EVERY == 0:
                note = after_stop(running.signals())
            state = running.state
            frame = {
                "t": state.timestamp,
                "row": [round(value, 6) for value in row],
                "samples": running.since(self.count),
                "f_d": state.estimated_f_d[0] if state.estimated_f_d else None,
                "zeta": state.estimated_zeta[0] if state.estimated_zeta else None,
                "delay": state.shaper_delay,
                "note": note,
            }
            self.count = running.count
            await self.tab.send("frame", frame)


class ShownRobot:
    """A robot that tabs show; it is searched until its task is cancelled."""

    def __init__(self, place: RobotPlace, name: str, judge: Judge, meshes: Meshes) -> None:
        self._place, self.name, self._judge, self._meshes = place, name, judge, meshes
        self.running: LatestSignals | None = None
        self._way = ObservedArm()
        self.watchers: set[Watcher] = set()
        self._ends: list[Callable[[], None]] = []
        self._handler: RequestHandler | None = None
        self._info: Info | None = None
        self._io: Io | None = None
        self._described: dict[str, Any] = {}
        self._absent = f"Looking for robot {name} at {place.endpoint} …"
        self.robots: list[str] = []  # names of all robots at the endpoint when this one was last found
        self.task = asyncio.create_task(self._run())

    def come(self, watcher: Watcher) -> None:
        """Attach a tab to this robot."""
        self.watchers.add(watcher)
        watcher.robot = self
        self._introduce(watcher)
        self._listen()

    async def go(self, watcher: Watcher) -> None:
        """Detach a tab: stop its motion and give its control back."""
        self.watchers.discard(watcher)
        watcher.robot = None
        if self._handler is not None:
            await self._handler.pilot.give_back(watcher.tab.number)
        if watcher.tasks:
            await asyncio.wait(watcher.tasks)
            if self._handler is not None:  # a task may have taken control meanwhile
                await self._handler.pilot.give_back(watcher.tab.number)
        self._listen()

    def _introduce(self, watcher: Watcher) -> None:
        watcher.status, watcher.count = {}, 0 if self.running is None else max(self.running.count - 1, 0)
        if self._described:
            watcher.put("robot", self._described)
        else:
            watcher.put("gone", {"text": self._absent})

    async def _run(self) -> None:
        place, lead = self._place, "No robot"
        while True:
            self._described = {}
            try:
                async with await Robot.connect(
                    place.endpoint, self.name, security=place.security, namespace=place.namespace
                ) as robot:
                    await self._shows(robot, await robot.info())
            except (ClientError, RefusedError, GeometryError) as error:
                if self._described:
                    lead = "The robot has gone"
                said = "The robot cannot be drawn" if isinstance(error, GeometryError) else lead
                self._away(f"{said}. {error}. The page waits for it.", str(error))
            await asyncio.sleep(RETRY_S)

    def _away(self, sentence: str, why: str) -> None:
        """Show why there is no robot, once."""
        self._described = {}
        if sentence != self._absent:
            self._absent = sentence
            log.warning("%s; waiting for the robot", why)
            for watcher in self.watchers:
                self._introduce(watcher)

    async def _shows(self, robot: Robot, info: Info) -> None:
        if info.geometry is None:
            raise GeometryError(
                f"a {info.model} on a server of version {info.version} does not send its geometry: update the server"
            )
        look = Look(info.geometry, info.payload)
        place = self._place
        self.robots = await robots_at(place.endpoint, place.security, place.namespace)
        self._info, self._absent = info, ""
        self.running, self._way = LatestSignals(look), ObservedArm()
        pilot = Pilot(robot, f"view-{os.getpid()}", self._say)
        self._handler = RequestHandler(robot, look, pilot, self._judge, self._say, self._result)
        self._described = described(info, look, self.robots, self._meshes)
        for watcher in self.watchers:
            self._introduce(watcher)
        self._listen()
        try:
            await self._ask(robot, pilot)
        finally:
            self._deaf()
            self._handler = self.running = None
            if pilot.holder is not None:
                await pilot.give_back(pilot.holder)

    def _listen(self) -> None:
        """Subscribe to the robot while a tab shows it: servers compute the truth only for subscribers."""
        if not self.watchers:
            self._deaf()
        elif self._handler is not None and self.running is not None and not self._ends:
            robot, running = self._handler.robot, self.running
            self._ends = [
                robot.on_state(running.add),
                robot.on_truth(running.add),
                robot.on_event(self._on_event),
                robot.on_io(self._on_io),
            ]

    def _deaf(self) -> None:
        ends, self._ends = self._ends, []
        for end in ends:
            end()

    async def _ask(self, robot: Robot, pilot: Pilot) -> None:
        """Query every second which client has control and which shaper is in use."""
        while True:
            with contextlib.suppress(AnswerTimeoutError):  # a slow robot is still there
                holder = pilot.holder
                self._info = await robot.info()
                # The answer does not contain control that was taken since the query.
                if holder == pilot.holder:
                    await pilot.heard(self._info.control)
            await asyncio.sleep(INFO_S)

    def status(self, tab: int) -> dict[str, Any] | None:
        """Return the content of a tab's status bar; None before the first state."""
        info, handler, running = self._info, self._handler, self.running
        if info is None or handler is None or running is None or running.state is None:
            return None
        pilot, only = handler.pilot, info.watched
        watched = f"{only} is only watched: this page cannot move or stop it."
        return {
            **state_in_words(running.state, info, self._io),
            "control": _control(pilot, tab, info.control) if only is None else watched,
            "mine": pilot.holder == tab,
            "free": only is None and pilot.holder is None and info.control in (None, pilot.client),
            "truth": running.has_truth,
            "comparing": handler.comparing,
            "only": "" if only is None else watched,
            "held": info.moved is None or info.robot_mode == RobotMode.RUNNING,
            "steps": self._way.steps(info, running.state, self._io),
        }

    def _on_event(self, event: Event) -> None:
        self._way.seen.add(event.kind)
        if event.kind in SHOWN_EVENTS and event.why:
            self._say(event.why)

    def _on_io(self, io: Io) -> None:
        self._io = io

    def _result(self, result: dict[str, Any]) -> None:
        self._way.seen.add("compared")
        for watcher in self.watchers:
            watcher.put("result", result)

    def _say(self, sentence: str) -> None:
        for watcher in self.watchers:
            watcher.say(sentence)

    async def do(self, watcher: Watcher, message: tab_messages.Message) -> None:
        """Carry out a tab's request."""
        handler, info = self._handler, self._info
        if handler is None or info is None:
            watcher.say("there is no robot now")
        elif isinstance(message, tab_messages.Jog) and message.joint < len(info.joints):
            handler.pilot.jog(watcher.tab.number, message.joint, message.direction)
        else:
            if len(watcher.tasks) >= MOST_ASKED:
                await asyncio.wait(watcher.tasks, return_when=asyncio.FIRST_COMPLETED)
            task = asyncio.create_task(handler.do(info, watcher.tab.number, message))
            watcher.tasks.add(task)
            task.add_done_callback(watcher.tasks.discard)
            task.add_done_callback(self._finished)

    def _finished(self, task: asyncio.Task[Any]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("the page: %s", error, exc_info=error)
            self._say(f"the page has failed: {error}")


def _control(pilot: Pilot, tab: int, control: str | None) -> str:
    if pilot.holder == tab:
        return "This tab has control."
    if pilot.holder is not None:
        return "Another tab has control; this one watches."
    if control not in (None, pilot.client):
        return f"Client {control} has control; this tab watches."
    return "Nobody has control."
