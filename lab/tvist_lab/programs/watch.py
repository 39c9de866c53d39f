"""Observe one program, tick by tick, in the controller's thread."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from tvist_controller.api.robot import Controller, Sink, truth_of
from tvist_plant.model import Floats
from tvist_plant.plant import PERIOD, Plant, Response
from tvist_plant.tool_acceleration import tool_acceleration
from tvist_protocol.stream import Event, State

AFTER_STOP = 5  # ticks after a stop (10 ms) from which the peak is sought, when the deceleration has ended
SEEN = 50  # ticks of rest (0.1 s) in which the vibration is measured; after a shorter rest, it is predicted
WINDOW = 150  # ticks after a stop (0.3 s) in which the peak is sought, as for the paper's residual vibration
KEPT = 5000
"""Most arm states (50 MB) kept for `ProgramMove.peak` in real time; later stops without rest have no peak."""
LINGER = 2500  # most ticks (5 s) for which a moving arm is observed after the end of its program

Reason = Literal[
    "finished",
    "runtime_error",
    "protective_stop",
    "safety_stop",
    "stopped",
    "paused",
    "timeout",
    "server_failure",
    "signal",
]


@dataclass
class ProgramMessage:
    """A message of the program or the robot."""

    tick: int
    kind: Literal["text", "popup", "warning"]
    text: str
    line: int = 0  # line that was being executed; 0 if none
    title: str | None = None
    level: Literal["message", "warning", "error"] | None = None


@dataclass
class ProgramMove:
    """A motion of the program, from its start until its shaped reference is at rest."""

    id: int
    started: int
    line: int = 0  # line of the program that started it; 0 if none
    ended: int | None = None  # tick of its end; None if the run ended first
    stopped: str | None = None  # why it was stopped before its target; None if it was not
    rests: int | None = None  # tick at which the shaped reference came to rest, if before the next
    followed: int | None = None  # tick at which the next motion started; None if none did
    rested: int = 0  # ticks of rest after the motion in which the vibration was measured
    peak_so_far: float | None = None  # largest tool acceleration measured until now [m/s²]; None if none was
    held: Callable[[int], Response] | None = None
    """Predicts the arm's response if it stays at rest; None if the vibration was measured instead."""

    @cached_property
    def peak(self) -> float | None:
        """Largest tool acceleration without gravity from 10 ms until 0.3 s after the stop [m/s²].

        If the next motion started within 0.1 s, the peak is predicted as if the arm had stayed at rest. None
        without rest or measurement. Ask only after the next motion started, since the peak is computed once.
        """
        if self.held is None:
            return self.peak_so_far if self.rested >= SEEN else None
        would = self.held(WINDOW)
        return float(acceleration(would.specific_force, would.flange_rotation)[AFTER_STOP - 1 :].max())

    def settle(self) -> None:
        """Compute `peak` now, so that the state of the arm need not be kept."""
        assert self.peak is not None
        self.held = None


@dataclass(frozen=True)
class Fastest:
    """The largest speed or force of a run, with its time and place."""

    speed: float = 0.0  # measured speed [rad/s, or m/s], or the force [N]
    tick: int = 0
    line: int = 0  # line that was being executed; 0 if none
    joint: str | None = None  # name of the joint; None for the tool


@dataclass(frozen=True)
class ProgramPlace:
    """A position in the program's text, and what is wrong there."""

    line: int
    column: int
    text: str


class ProgramWatch(Sink):
    """Observes a program from its start until it has ended and the arm is at rest.

    The tool's acceleration is the simulation's true one, without sensor noise; arms that are not simulated have none.

    Args:
        controller: The robot; the first program that it starts is observed.
        close_popup: Has the popup closed, before the next tick, for which the program waits.
        on_over: Called once, when the run is over.
        timeout: Robot time after which the run ends in any case [s].
        alone: Whether nobody could resume a paused program, so that the run ends with a pause.
    """

    def __init__(
        self,
        controller: Controller,
        close_popup: Callable[[], None],
        on_over: Callable[[], None],
        *,
        timeout: float | None = None,
        alone: bool = False,
    ) -> None:
        self._controller, self._close_popup, self._on_over = controller, close_popup, on_over
        self._alone, self._timeout = alone, timeout
        self.tick = 0
        self.name = ""
        self.reason: Reason | None = None  # how the run ended; None while it goes on
        self.why: str | None = None  # why the program did not end by itself, as a sentence
        self.error: ProgramPlace | None = None  # position of the error that ended the program
        self.said: list[ProgramMessage] = []
        self.news: deque[ProgramMessage] = deque()  # new messages, for another thread to take
        self.moves: list[ProgramMove] = []
        self.fastest_joint, self.fastest_tool = Fastest(), Fastest()
        """Largest speeds of a joint and of the tool centre point, as measured."""
        self.hardest = Fastest()  # largest force with which the world touched the arm; 0 without a world
        self.over = False  # whether there is nothing more to observe
        self._names = controller.cycle.description.robot.joints
        self._ended = 0
        self._kept = 0  # number of arm states that are kept
        self._placeless: list[ProgramMove | ProgramMessage] = []
        """Messages and moves of this tick, whose line is not known yet."""
        self._rest = 0  # ticks for which the shaped reference has rested after the last move
        self.plant = plant = controller.cycle.plant
        self._in_world = plant.things() is not None
        self._truthful = plant.truth() is not None
        self._foreseeing = plant.can(Plant.held)

    @property
    def seconds(self) -> float:
        """Robot time from the start of the program, the first tick, until its end or until now [s]."""
        return ((self._ended or self.tick + 1) - 1) * PERIOD

    @property
    def line(self) -> int:
        """Line that is being executed; 0 if the program has ended."""
        return self._controller.programs.present_line

    def end(self, reason: Reason, why: str | None) -> None:
        """Note how the run ended; only the first call counts."""
        if self.reason is None:
            self.reason, self.why, self._ended = reason, why, self.tick + 1

    # ------------------------------------------------------------------ messages of the controller

    def event(self, event: Event) -> None:
        """Process an event."""
        match event.kind:
            case "program_started" if not self.name:
                self.name = event.program or ""
            case "text" | "popup" | "warning" if event.line is None:
                self._say(
                    ProgramMessage(event.tick, event.kind, event.why or "", 0, event.title, event.level)
                )
                if event.blocking:
                    self._close_popup()
            case "warning" if event.program == self.name:
                self.error = ProgramPlace(event.line or 0, event.column or 0, event.why or "")
                self.end("runtime_error", self.error.text)
            case "protective_stop":
                self.end("protective_stop", f"protective stop: {event.why}")
            case "safety_stop" if event.category != 2:
                self.end("safety_stop", f"safety stop: {event.why}")
            case "program_stopped" if event.program == self.name:
                self.end("finished" if event.why is None else "stopped", event.why)
            case "motion_started":
                self._note_start(event)
            case "motion_done" | "motion_stopped":
                self._note_end(event)

    def state(self, state: State) -> None:
        """Process a tick's state; the tick's events come before it."""
        self.tick = state.tick
        while self._placeless:  # the line is known when the program has computed its tick
            self._placeless.pop().line = self.line
        self._note_speeds(state)
        at_rest = self._controller.cycle.mode.at_rest
        if self.moves:
            self._watch_rest(self.moves[-1], at_rest=at_rest)
        if self.reason is None:
            if self._timeout is not None and self.seconds >= self._timeout:
                self.end("timeout", f"the program was still running after {self._timeout:g} s of robot time")
            elif self._alone and self._controller.programs.state == "PAUSED":
                self.end("paused", "the program was paused, and nobody can resume it")
        if self.reason is None or self.over:
            return
        still = at_rest and (not self.moves or self._rest > WINDOW)
        if still or self.reason == "timeout" or state.tick > self._ended + LINGER:
            self.over = True
            self._on_over()

    def _watch_rest(self, move: ProgramMove, *, at_rest: bool) -> None:
        """Measure the tool's vibration while the reference rests."""
        if not at_rest or move.ended is None:
            self._rest = 0
        elif self._rest <= WINDOW:
            if self._rest == 0:  # before the next motion may have begun
                move.rests = self.tick
                move.held = self.plant.held() if self._foreseeing else None
            self._rest = move.rested = self._rest + 1
            if self._rest == SEEN:
                move.held = None
            if self._rest > AFTER_STOP and self._truthful:
                truth = truth_of(self._controller.cycle.plant)
                seen = float(acceleration(truth.specific_force, truth.flange_rotation))
                move.peak_so_far = max(move.peak_so_far or 0.0, seen)

    def _note_speeds(self, state: State) -> None:
        speeds = [abs(speed) for speed in state.actual_qd]
        if (most := max(speeds)) > self.fastest_joint.speed:
            self.fastest_joint = Fastest(most, state.tick, self.line, self._names[speeds.index(most)])
        if (tool := math.hypot(*state.actual_TCP_speed[:3])) > self.fastest_tool.speed:
            self.fastest_tool = Fastest(tool, state.tick, self.line)
        if self._in_world:
            force = math.hypot(*self.plant.contact())
            if force > self.hardest.speed:
                self.hardest = Fastest(force, state.tick, self.line)

    def _note_start(self, event: Event) -> None:
        if self.moves:
            self._note_next(self.moves[-1], event.tick)
        self.moves.append(ProgramMove(event.id or 0, event.tick))
        self._placeless.append(self.moves[-1])
        self._rest = 0

    def _note_next(self, move: ProgramMove, tick: int) -> None:
        """Note that the next move starts; predict the peak of this move, in real time later."""
        move.followed = tick
        if move.held is None:
            return
        if self._alone:
            move.settle()
        elif self._kept < KEPT:
            self._kept += 1
        else:
            move.held = None

    def _note_end(self, event: Event) -> None:
        for move in self.moves[-2:]:  # the next move may begin in the tick in which this move ends
            if move.id == event.id and move.ended is None:
                move.ended = event.tick
                if event.kind == "motion_stopped":
                    move.stopped = event.why or "it was stopped"

    def _say(self, said: ProgramMessage) -> None:
        self.said.append(said)
        self._placeless.append(said)
        self.news.append(said)


def acceleration(specific_force: Floats, rotation: Floats) -> Floats:
    """Return magnitudes of the tool's acceleration without gravity, shape (...) [m/s²].

    `specific_force` in the flange frame has shape (..., 3) [m/s²], `rotation` of the flange (..., 3, 3).
    """
    up = rotation[..., 2, :]  # the world's z axis, in the frame of the flange
    return np.asarray(np.linalg.norm(tool_acceleration(specific_force, up), axis=-1))
