"""UR's dashboard, port 29999: one command a line, and answers that clients compare word by word."""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Final, NamedTuple

from tvist_controller.instruments.snapshot import Snapshot
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_server.gateways.ur import messages, power
from tvist_server.gateways.ur.base import InTurnSession, LineSplitter
from tvist_server.gateways.ur.deferred import Deferred
from tvist_server.gateways.ur.lease import ConnectionControl
from tvist_server.gateways.ur.power import Change
from tvist_server.gateways.ur.programs import Programs
from tvist_server.gateways.ur.robot import NO_MODE, UrRobot
from tvist_server.gateways.ur.version import DATE, VERSION
from tvist_server.ur_model import series

GREETING: Final = "Connected: Universal Robots Dashboard Server"
LONGEST: Final = 4096  # longest line [bytes]; the rest of a longer one is ignored
PATIENCE: Final = 2500  # ticks within which a stopped arm must come to rest
ECHO: Final = 200  # characters of an unknown line that the answer repeats
UNNAMED: Final = "<unnamed>"  # reported name of the program while none is loaded
INSTALLATION: Final = "default.installation"
MODES: Final = ("MANUAL", "AUTOMATIC")
TOO_SOON: Final = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)
"""UR's answer. Here it means that the arm is still stopping; there is no wait of 5 s."""


class Request(NamedTuple):
    """A command as a client sent it."""

    robot: UrRobot
    control: ConnectionControl
    argument: str
    at_rest: Callable[[], Awaitable[bool]]  # waits until the arm rests; returns whether it does in time


Handler = Callable[[Request], str | Awaitable[str | None] | None]
"""Carries out a command; returns the answer, possibly awaited, or None if the command failed."""


class Command(NamedTuple):
    """A row of the table of commands."""

    keyword: str  # in the manual's spelling; clients may use any case
    carry_out: Handler
    argument: bool = False  # whether the command takes an argument


def _changing(change: Change, done: str, too_soon: str | None = None) -> Handler:
    """Return a handler that makes a change and answers `done`, or `too_soon` if the mode forbids a change."""

    async def carry_out(request: Request) -> str | None:
        refused = await change(request.robot, request.control)
        return done if refused is None else too_soon if refused.code == "wrong_mode" else None

    return carry_out


def _playing(change: Callable[[Programs, ConnectionControl], Awaitable[bool]], done: str) -> Handler:
    """Return a handler that changes the program and answers `done`."""

    async def carry_out(request: Request) -> str | None:
        return done if await change(request.robot.programs, request.control) else None

    return carry_out


def _mode(title: str, field: str, unknown: RobotMode | SafetyMode) -> Handler:
    """Return a handler that answers with a mode of the last tick, or with `unknown` before the first."""

    def carry_out(request: Request) -> str:
        latest = request.robot.latest
        mode = unknown if latest is None else type(unknown)(getattr(latest, field))
        return f"{title}: {mode.name}"

    return carry_out


async def _load(request: Request) -> str:
    path, robot, control = request.argument, request.robot, request.control
    failed = f"Error while loading program: {path}"
    if control.held_by_other:
        return failed
    refused = await robot.programs.load(path, control)
    if refused is None:
        return f"Loading program: {path}" if await request.at_rest() else failed
    place = refused.where.replace("text:", "line ").replace(":", ", column ")
    why = f"{place}: {refused.why}" if refused.code == "script_error" else refused.why
    robot.report_refusal(f'the program "{path}" of {control.peer} was not loaded: {why}')
    return f"File not found: {path}" if refused.code == "out_of_range" else failed


def _load_installation(request: Request) -> str:
    name = request.argument
    if request.control.held_by_other:
        return f"Failed to load installation: {name}"
    known = name.rpartition("/")[2] == INSTALLATION
    return f"Loading installation: {name}" if known else f"File not found: {name}"


async def _stop(request: Request) -> str | None:
    stopped = await request.robot.programs.stop(request.control) and await request.at_rest()
    return "Stopped" if stopped else None


def _popup(request: Request) -> str:
    request.robot.tell(messages.popup(request.robot.latest, "Message", request.argument))
    return "showing popup"


def _add_to_log(request: Request) -> str:
    if not request.argument:
        return "No log message to add"
    request.robot.tell(messages.text(request.robot.latest, request.argument))
    return "Added log message"


def _set_operational_mode(request: Request) -> str:
    mode = request.argument.upper()
    if mode not in MODES or request.control.held_by_other:
        return f"Failed setting operational mode: {request.argument}"
    request.robot.operational_mode = mode
    return f"Operational mode {mode} is set"


def _clear_operational_mode(request: Request) -> str | None:
    if request.control.held_by_other:
        return None
    request.robot.operational_mode = NO_MODE
    return f"No longer controlling the operational mode. Current operational mode: {NO_MODE}"


def _loaded(request: Request) -> str:
    path = request.robot.programs.path
    return "No program loaded" if path is None else f"Loaded program: {path}"


def _name(request: Request) -> str:
    return request.robot.programs.name or UNNAMED


def _model(request: Request) -> str:
    model = request.robot.description.robot.model
    return series(model) or model


def _say(text: str) -> Handler:
    return lambda _: text


def _bool(value: bool) -> str:
    return "true" if value else "false"


QUIT: Final = "quit"
NUMBER: Final = ".".join(map(str, VERSION))
COMMANDS: Final = (
    Command("power on", _changing(power.power_on, "Powering on")),
    Command("power off", _changing(power.power_off, "Powering off")),
    Command("brake release", _changing(power.release_brakes, "Brake releasing")),
    Command("unlock protective stop", _changing(power.unlock, "Protective stop releasing", TOO_SOON)),
    Command("restart safety", _changing(power.restart_safety, "Restarting safety")),
    Command("close safety popup", _say("closing safety popup")),
    Command("robotmode", _mode("Robotmode", "robot_mode", RobotMode.NO_CONTROLLER)),
    Command("safetymode", _mode("Safetymode", "safety_mode", SafetyMode.UNDEFINED)),
    Command("safetystatus", _mode("Safetystatus", "safety_status", SafetyMode.UNDEFINED)),
    Command("load installation", _load_installation, argument=True),
    Command("load", _load, argument=True),
    Command("play", _playing(Programs.play, "Starting program")),
    Command("pause", _playing(Programs.pause, "Pausing program")),
    Command("stop", _stop),
    Command("running", lambda request: f"Program running: {_bool(request.robot.programs.playing)}"),
    Command("programState", lambda request: f"{request.robot.programs.state} {_name(request)}"),
    Command("get loaded program", _loaded),
    Command("isProgramSaved", lambda request: f"{_bool(request.robot.programs.saved)} {_name(request)}"),
    Command("popup", _popup, argument=True),
    Command("close popup", _playing(Programs.close_popup, "closing popup")),
    Command("addToLog", _add_to_log, argument=True),
    Command("saveLog", _say("Log saved to disk")),
    Command("set operational mode", _set_operational_mode, argument=True),
    Command("get operational mode", lambda request: request.robot.operational_mode),
    Command("clear operational mode", _clear_operational_mode),
    Command("is in remote control", lambda request: _bool(not request.control.held_by_other)),
    Command("PolyscopeVersion", _say(f"URSoftware {NUMBER} ({DATE})")),
    Command("version", _say(NUMBER)),
    Command("get robot model", _model),
    Command("get serial number", lambda request: request.robot.serial),
    Command("generate flight report", _say("Flight Report generated with id: 1"), argument=True),
    Command(
        "generate support file",
        lambda request: f"Completed successfully: support_{request.robot.serial}.zip",
        argument=True,
    ),
    Command("shutdown", _changing(power.power_off, "Shutting down")),
    Command(QUIT, _say("Disconnected")),
)
"""All commands; if one keyword starts with another one, the longer keyword comes first."""


def find(line: str) -> tuple[Command, str] | None:
    """Return the command on a line and its argument; None if there is no such command."""
    lower = line.lower()
    for command in COMMANDS:
        keyword = command.keyword.lower()
        if lower == keyword:
            return command, ""
        if command.argument and lower.startswith(keyword) and line[len(keyword)].isspace():
            return command, line[len(keyword) :].strip()
    return None


@dataclass(eq=False)
class DashboardSession(InTurnSession[str]):
    """One client of the dashboard. Answers keep their order, but a `stop` takes effect when it is read."""

    only_answers = True
    most_waiting = 256  # lines: a `stop` after fewer lines is read at once; at most 1 MB a client
    _lines: LineSplitter = field(default_factory=partial(LineSplitter, LONGEST), init=False)
    _rests: Deferred[bool] | None = field(default=None, init=False)  # waits for the arm to rest
    _last: int = field(default=0, init=False)  # last tick of the wait for the arm

    def opened(self) -> None:
        self._say(GREETING)

    def receive(self, data: bytes) -> None:
        for line in self._lines.feed(data):
            if not self.over:
                text = line.decode(errors="replace").strip()
                self._add(text, stop=text.lower() == "stop")

    async def _do(self, line: str) -> None:
        found = find(line)
        if found is None:
            self._say(f"could not understand: '{line[:ECHO]}'")
            return
        command, argument = found
        answer = command.carry_out(Request(self._robot, self._control, argument, self._at_rest))
        if isinstance(answer, Awaitable):
            answer = await answer
        self._say(f"Failed to execute: {command.keyword}" if answer is None else answer)
        if command.keyword == QUIT:
            self._end()

    def sample(self, snapshot: Snapshot) -> bytes:
        """Resume a command that waits for the arm to rest."""
        rests = self._rests
        if rests is not None:
            still = snapshot.runtime_state == RuntimeState.STOPPED
            if still or snapshot.state.tick >= self._last:
                self._rests = None
                rests.set(still)
        return b""

    def closed(self) -> None:
        self._end()
        super().closed()
        if self._rests is not None:
            self._rests.set(False)

    def _end(self) -> None:
        self.over = True
        self._items.clear()

    async def _at_rest(self) -> bool:
        """Wait until the arm rests, so that a stopped program can be played once its stop is answered."""
        latest = self._robot.latest
        if self.over or latest is None or latest.runtime_state == RuntimeState.STOPPED:
            return True
        self._rests, self._last = Deferred[bool](), latest.state.tick + PATIENCE
        return await self._rests

    def _say(self, text: str) -> None:
        if not self.over:
            plain = "".join([letter if letter.isprintable() else "?" for letter in text])
            self._send(plain.encode() + b"\n")
