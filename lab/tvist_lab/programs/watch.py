"""Observation of one program, tick by tick, in the controller's thread."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tvist_controller.api.robot import Controller, Sink, truth_of
from tvist_plant.plant import GRAVITY, PERIOD, Truthful
from tvist_protocol.stream import Event, State

AFTER_STOP = 5
"""Ticks after a stop (10 ms) at which the search for the peak begins, when the last ramp has passed."""
SEEN = 50
"""Ticks of rest (0.1 s) without which nothing can be said of the vibration after a stop."""
WINDOW = 150
"""Ticks after a stop (0.3 s) in which the peak is searched, as for the paper's residual vibration."""
LINGER = 2500
"""Most ticks (5 s) for which an arm that has not come to rest is watched after the end of its program."""

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
"""How a run ended."""


@dataclass
class Said:
    """Something that the program, or the robot, has said to people."""

    tick: int
    kind: Literal["text", "popup", "warning"]
    text: str
    title: str | None = None
    """Title of a popup."""
    level: Literal["message", "warning", "error"] | None = None
    """How serious a popup is."""


@dataclass
class Move:
    """A motion of the program, from its start until its shaped reference is at rest."""

    id: int
    started: int
    ended: int | None = None
    """Tick of its end; None if it had not ended when the run did."""
    stopped: str | None = None
    """Why it was stopped before its target; None if it was not."""
    peak: float | None = None
    """Largest acceleration of the tool from 10 ms until 0.3 s after the stop, without gravity [m/s²]; None if the arm
    did not rest long enough to tell, or cannot tell."""
    peak_so_far: float = 0.0


@dataclass(frozen=True)
class Place:
    """A place in the program's text, and what is wrong there."""

    line: int
    column: int
    text: str


class ProgramWatch(Sink):
    """Observes a program from its start until it has ended and the arm is at rest.

    The tool's acceleration is the simulation's true one, free of the sensor's noise; other arms have none.

    Args:
        controller: The robot; the program is the first one that it starts.
        close_popup: Has the popup closed for which the program waits, before the next tick.
        on_over: Called once, when the run is over.
        timeout: Robot time after which the run ends although the program goes on [s]; None: never.
        alone: Whether there is nobody who could resume a paused program, so that the run ends with a pause.
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
        """Present tick."""
        self.name = ""
        """Name of the program."""
        self.reason: Reason | None = None
        """How the run ended; None while it goes on."""
        self.why: str | None = None
        """Why it did not end by itself, as a sentence."""
        self.error: Place | None = None
        """Where an error has ended the program."""
        self.said: list[Said] = []
        """Everything that was said."""
        self.news: deque[Said] = deque()
        """What was said, for another thread to take."""
        self.moves: list[Move] = []
        """Motions of the program."""
        self.over = False
        """Whether there is nothing more to observe."""
        self._ended = 0
        self._rest = 0
        """Ticks for which the shaped reference has rested after the last move."""
        plant = controller.cycle.line.plant
        self._truthful = isinstance(plant, Truthful) and plant.truth() is not None

    @property
    def seconds(self) -> float:
        """Robot time from the start of the program, which is the first tick, until its end or until now [s]."""
        return ((self._ended or self.tick + 1) - 1) * PERIOD

    @property
    def line(self) -> int:
        """Line that the program carries out; 0 if it has ended."""
        return self._controller.programs.line

    def end(self, reason: Reason, why: str | None) -> None:
        """Note how the run has ended; what is noted first counts.

        Args:
            reason: How it has ended.
            why: Why, for people; None if the program has ended by itself.
        """
        if self.reason is None:
            self.reason, self.why, self._ended = reason, why, self.tick + 1

    # ------------------------------------------------------------------ messages of the controller

    def event(self, event: Event) -> None:
        """Take an event."""
        match event.kind:
            case "program_started" if not self.name:
                self.name = event.program or ""
            case "text" | "popup" | "warning" if event.line is None:
                self._say(Said(event.tick, event.kind, event.why or "", event.title, event.level))
                if event.blocking:
                    self._close_popup()
            case "warning" if event.program == self.name:
                self.error = Place(event.line or 0, event.column or 0, event.why or "")
                self.end("runtime_error", self.error.text)
            case "protective_stop":
                self.end("protective_stop", f"protective stop: {event.why}")
            case "safety_stop" if event.category != 2:
                self.end("safety_stop", f"safety stop: {event.why}")
            case "program_stopped" if event.program == self.name:
                self.end("finished" if event.why is None else "stopped", event.why)
            case "motion_started":
                self.moves.append(Move(event.id or 0, event.tick))
                self._rest = 0
            case "motion_done" | "motion_stopped":
                self._note_end(event)

    def state(self, state: State) -> None:
        """Take a tick's state, which its events precede."""
        self.tick = state.tick
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

    def _watch_rest(self, move: Move, *, at_rest: bool) -> None:
        """Measure how the tool vibrates while the reference rests."""
        if not at_rest or move.ended is None:
            self._rest = 0
        elif self._rest <= WINDOW:
            self._rest += 1
            if self._rest > AFTER_STOP and self._truthful:
                move.peak_so_far = max(move.peak_so_far, self._acceleration())
            if self._rest >= SEEN and self._truthful:
                move.peak = move.peak_so_far

    def _note_end(self, event: Event) -> None:
        for move in self.moves[-2:]:  # the next one may begin in the tick in which this one ends
            if move.id == event.id and move.ended is None:
                move.ended = event.tick
                if event.kind == "motion_stopped":
                    move.stopped = event.why or "it was stopped"

    def _acceleration(self) -> float:
        """Magnitude of the tool's acceleration, without gravity [m/s²]."""
        truth = truth_of(self._controller.cycle.line.plant)
        up = truth.flange_rotation[2]  # the world's z axis, in the frame of the flange
        return float(np.linalg.norm(truth.specific_force - GRAVITY * up))

    def _say(self, said: Said) -> None:
        self.said.append(said)
        self.news.append(said)


def largest_peak(watch: ProgramWatch) -> float | None:
    """Largest acceleration of the tool after a stop [m/s²]; None if it was never at rest for long enough."""
    return max((move.peak for move in watch.moves if move.peak is not None), default=None)


def summary(watch: ProgramWatch) -> str:
    """Say in a sentence how long a program ran, how often it moved, and how much the tool shook."""
    said = f"{watch.name} ran for {watch.seconds:.3f} s of robot time"
    if watch.moves:
        said += f" and made {len(watch.moves)} {'move' if len(watch.moves) == 1 else 'moves'}"
    peak = largest_peak(watch)
    return said if peak is None else f"{said}; after a stop the tool shook with at most {peak:.3g} m/s²"


def as_dict(watch: ProgramWatch) -> dict[str, Any]:
    """Return everything that is known of a run, as plain values."""
    error = watch.error
    return {
        "program": watch.name,
        "ok": watch.reason == "finished",
        "exit_reason": watch.reason,
        "why": watch.why,
        "error": None if error is None else {"line": error.line, "column": error.column, "text": error.text},
        "seconds": round(watch.seconds, 6),
        "messages": [_message(said) for said in watch.said if said.kind != "warning"],
        "warnings": [
            {"timestamp": _time(said.tick), "text": said.text}
            for said in watch.said
            if said.kind == "warning"
        ],
        "moves": [_move(move) for move in watch.moves],
        "largest_peak_after_stop_m_s2": largest_peak(watch),
    }


def _message(said: Said) -> dict[str, Any]:
    message: dict[str, Any] = {"timestamp": _time(said.tick), "kind": said.kind, "text": said.text}
    return message | ({"title": said.title, "level": said.level} if said.kind == "popup" else {})


def _move(move: Move) -> dict[str, Any]:
    return {
        "id": move.id,
        "timestamp": _time(move.started),
        "seconds": None if move.ended is None else _seconds(move.ended - move.started),
        "stopped": move.stopped,
        "peak_after_stop_m_s2": move.peak,
    }


def _time(tick: int) -> float:
    """Time of a tick, as `timestamp` in `state` gives it [s]."""
    return _seconds(tick)


def _seconds(ticks: int) -> float:
    return round(ticks * PERIOD, 6)  # 0.002 is no binary number
