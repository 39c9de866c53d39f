"""The dashboard's commands and their answers, which clients compare word by word."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from tvist_protocol.modes import RobotMode, SafetyMode
from tvist_protocol.replies import Refused
from tvist_server.gateways.ur import messages, power, version
from tvist_server.gateways.ur.base import ControllerAccess
from tvist_server.gateways.ur.robot import NO_MODE, UrRobot
from tvist_server.ur_model import series

UNNAMED: Final = "<unnamed>"
"""Name of the program while none is loaded."""
INSTALLATION: Final = "default.installation"
"""Name of the only installation."""
MODES: Final = ("MANUAL", "AUTOMATIC")
TOO_SOON: Final = (
    "Cannot unlock protective stop until 5s after occurrence. "
    "Always inspect cause of protective stop before unlocking"
)
"""UR's answer. Here it means that the arm is still stopping; there are no 5 s to wait."""

Answer = Callable[[str], None]
"""Takes the answer, once, now or later."""
AtRest = Callable[[Callable[[bool], None]], None]
"""Takes a function to call at rest, with whether rest was reached in time."""


@dataclass(frozen=True)
class Request:
    """One command as a client sent it."""

    robot: UrRobot
    control: ControllerAccess
    """Access to the robot's controller."""
    keyword: str
    argument: str
    answer: Answer
    at_rest: AtRest

    def failed(self) -> None:
        """Answer that the command failed."""
        self.answer(f"Failed to execute: {self.keyword}")

    def unless_refused(self, done: str) -> Callable[[Refused | None], None]:
        """Return a function that answers with `done`, or that the command failed."""
        return lambda refused: self.answer(done) if refused is None else self.failed()

    def if_done(self, done: str) -> Callable[[bool], None]:
        """Return a function that answers with `done`, or that the command failed."""
        return lambda well: self.answer(done) if well else self.failed()


@dataclass(frozen=True)
class Command:
    """One row of the table of commands."""

    keyword: str
    """Keyword in the manual's spelling; clients may use any case."""
    carry_out: Callable[[Request], None]
    argument: bool = False
    """Whether an argument may follow."""


# ---------------------------------------------------------------------- power and safety


def _power_on(request: Request) -> None:
    power.power_on(request.robot, request.control, request.unless_refused("Powering on"))


def _brake_release(request: Request) -> None:
    power.release_brakes(request.robot, request.control, request.unless_refused("Brake releasing"))


def _power_off(request: Request) -> None:
    power.power_off(request.control, request.unless_refused("Powering off"))


def _restart_safety(request: Request) -> None:
    power.restart_safety(request.robot, request.control, request.unless_refused("Restarting safety"))


def _shutdown(request: Request) -> None:
    power.power_off(request.control, request.unless_refused("Shutting down"))


def _unlock(request: Request) -> None:
    def outcome(refused: Refused | None) -> None:
        if refused is not None and refused.code == "wrong_mode":
            request.answer(TOO_SOON)
        else:
            request.unless_refused("Protective stop releasing")(refused)

    power.unlock(request.robot, request.control, outcome)


def _robot_mode(request: Request) -> None:
    latest = request.robot.latest
    mode = RobotMode.NO_CONTROLLER if latest is None else RobotMode(latest.robot_mode)
    request.answer(f"Robotmode: {mode.name}")


def _safety_mode(request: Request) -> None:
    latest = request.robot.latest
    request.answer(f"Safetymode: {_safety(None if latest is None else latest.safety_mode)}")


def _safety_status(request: Request) -> None:
    latest = request.robot.latest
    request.answer(f"Safetystatus: {_safety(None if latest is None else latest.safety_status)}")


def _safety(number: int | None) -> str:
    return SafetyMode.UNDEFINED.name if number is None else SafetyMode(number).name


# ---------------------------------------------------------------------- programs


def _load(request: Request) -> None:
    path = request.argument
    failed = f"Error while loading program: {path}"

    def outcome(refused: Refused | None) -> None:
        if refused is None:
            loaded = f"Loading program: {path}"
            request.at_rest(lambda well: request.answer(loaded if well else failed))
            return
        place = refused.where.replace("text:", "line ").replace(":", ", column ")
        why = f"{place}: {refused.why}" if refused.code == "script_error" else refused.why
        request.robot.report_refusal(f'the program "{path}" of {request.control.peer} was not loaded: {why}')
        request.answer(f"File not found: {path}" if refused.code == "out_of_range" else failed)

    if request.control.held_by_other:
        request.answer(failed)
    else:
        request.robot.programs.load(path, request.control, outcome)


def _load_installation(request: Request) -> None:
    name = request.argument
    if request.control.held_by_other:
        request.answer(f"Failed to load installation: {name}")
    elif name.rpartition("/")[2] == INSTALLATION:
        request.answer(f"Loading installation: {name}")
    else:
        request.answer(f"File not found: {name}")


def _play(request: Request) -> None:
    request.robot.programs.play(request.control, request.if_done("Starting program"))


def _pause(request: Request) -> None:
    request.robot.programs.pause(request.control, request.if_done("Pausing program"))


def _stop(request: Request) -> None:
    stopped = request.if_done("Stopped")

    def heard(well: bool) -> None:
        if well:
            request.at_rest(stopped)
        else:
            request.failed()

    request.robot.programs.stop(request.control, heard)


def _running(request: Request) -> None:
    request.answer(f"Program running: {_bool(request.robot.programs.playing)}")


def _program_state(request: Request) -> None:
    programs = request.robot.programs
    request.answer(f"{programs.state} {programs.name or UNNAMED}")


def _loaded_program(request: Request) -> None:
    path = request.robot.programs.path
    request.answer("No program loaded" if path is None else f"Loaded program: {path}")


def _is_program_saved(request: Request) -> None:
    programs = request.robot.programs
    request.answer(f"{_bool(programs.saved)} {programs.name or UNNAMED}")


# ---------------------------------------------------------------------- the person at the robot


def _popup(request: Request) -> None:
    stamp = messages.stamp(request.robot.latest)
    request.robot.tell(messages.popup(stamp, "Message", request.argument))
    request.answer("showing popup")


def _close_popup(request: Request) -> None:
    request.robot.programs.close_popup(request.control, request.if_done("closing popup"))


def _add_to_log(request: Request) -> None:
    if not request.argument:
        request.answer("No log message to add")
        return
    stamp = messages.stamp(request.robot.latest)
    request.robot.tell(messages.text(stamp, request.argument))
    request.answer("Added log message")


def _set_operational_mode(request: Request) -> None:
    mode = request.argument.upper()
    if mode not in MODES or request.control.held_by_other:
        request.answer(f"Failed setting operational mode: {request.argument}")
        return
    request.robot.operational_mode = mode
    request.answer(f"Operational mode {mode} is set")


def _get_operational_mode(request: Request) -> None:
    request.answer(request.robot.operational_mode)


def _clear_operational_mode(request: Request) -> None:
    if request.control.held_by_other:
        request.failed()
        return
    request.robot.operational_mode = NO_MODE
    request.answer(f"No longer controlling the operational mode. Current operational mode: {NO_MODE}")


def _remote(request: Request) -> None:
    request.answer(_bool(not request.control.held_by_other))


# ---------------------------------------------------------------------- information


def _number() -> str:
    return f"{version.MAJOR}.{version.MINOR}.{version.BUGFIX}.{version.BUILD}"


def _model(request: Request) -> None:
    model = request.robot.description.robot.model
    request.answer(series(model) or model)


def _support_file(request: Request) -> None:
    request.answer(f"Completed successfully: support_{request.robot.serial}.zip")


def _say(text: str) -> Callable[[Request], None]:
    return lambda request: request.answer(text)


def _bool(value: bool) -> str:
    return "true" if value else "false"


QUIT: Final = "quit"
COMMANDS: Final = (
    Command("power on", _power_on),
    Command("power off", _power_off),
    Command("brake release", _brake_release),
    Command("unlock protective stop", _unlock),
    Command("restart safety", _restart_safety),
    Command("close safety popup", _say("closing safety popup")),
    Command("robotmode", _robot_mode),
    Command("safetymode", _safety_mode),
    Command("safetystatus", _safety_status),
    Command("load installation", _load_installation, argument=True),
    Command("load", _load, argument=True),
    Command("play", _play),
    Command("pause", _pause),
    Command("stop", _stop),
    Command("running", _running),
    Command("programState", _program_state),
    Command("get loaded program", _loaded_program),
    Command("isProgramSaved", _is_program_saved),
    Command("popup", _popup, argument=True),
    Command("close popup", _close_popup),
    Command("addToLog", _add_to_log, argument=True),
    Command("saveLog", _say("Log saved to disk")),
    Command("set operational mode", _set_operational_mode, argument=True),
    Command("get operational mode", _get_operational_mode),
    Command("clear operational mode", _clear_operational_mode),
    Command("is in remote control", _remote),
    Command("PolyscopeVersion", lambda request: request.answer(f"URSoftware {_number()} ({version.DATE})")),
    Command("version", lambda request: request.answer(_number())),
    Command("get robot model", _model),
    Command("get serial number", lambda request: request.answer(request.robot.serial)),
    Command("generate flight report", _say("Flight Report generated with id: 1"), argument=True),
    Command("generate support file", _support_file, argument=True),
    Command("shutdown", _shutdown),
    Command(QUIT, _say("Disconnected")),
)
"""All commands; a longer keyword comes before one that it begins with."""


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
