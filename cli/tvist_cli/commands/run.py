"""`tvist run`: run a program in URScript on a robot of its own."""

import asyncio
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import err, print_json, say
from tvist_cli.robot_options import configuration, content_of, with_robot_options
from tvist_cli.scripts import check_scripts, named, placed, read_script
from tvist_cli.serving import compile_if_new, introduction, leave, say_recorded, say_who_can_reach
from tvist_protocol.errors import harmless
from tvist_server.config import ConfigError, ServeConfig

if TYPE_CHECKING:
    from tvist_lab.programs.watch import ProgramWatch, Said
    from tvist_server.server import Server

OPTIONS = {
    "robot", "profile", "payload", "overload", "shaper", "shape_servo", "plant", "start", "seed", "record", "truth",
    "listen", "ur", "ur_allow", "cell",
}  # fmt: skip
"""Options of `tvist serve` that one robot which ends with its program can do with."""

SHOWN_EVERY = 0.1
"""Time between two changes of the progress line [s]."""
_CLEAR = "\r\x1b[K"
"""Returns to the beginning of the terminal's line and clears it."""


@with_robot_options(OPTIONS)
def run(
    *file: Annotated[Path, Parameter(required=True)],
    check: bool = False,
    lockstep: bool = False,
    inputs: Annotated[list[str] | None, Parameter(name="--input")] = None,
    timeout: float | None = None,
    config: str | None = None,
    json: bool = False,
    **given: Any,
) -> None:
    """Run a program in URScript on a robot of its own, print its messages as they come, and end with an exit code.

    Exit code 0: the program ended by itself. Exit code 1: it does not compile, or an error, a protective stop, a safety
    stop, a client or --timeout ended it; errors in the program are printed as FILE:LINE:COLUMN: text. Exit code 2: the
    command line is wrong, or the file cannot be read.

    The program runs in real time, on a robot that other programs can reach as if tvist serve ran it. Popups do not
    hold it up: they are printed and closed.

    With --check, nothing runs. Errors are what keeps a program from starting: wrong syntax, unknown names, and calls
    that do not fit their functions. A function of UR's robots that tvist does not simulate is a warning: the program
    starts, and ends with an error when it calls that function.

    Args:
        file: Program to run, or programs to check; - reads the standard input.
        check: Look for errors without running anything: each is a line FILE:LINE:COLUMN: text. Exit code 0: there is
            none. Exit code 1: there is at least one. Exit code 2: a file cannot be read.
        lockstep: Run as fast as this machine computes, without network; the arm moves exactly as in real time. A
            program that waits for a client then waits for ever: see --input and --timeout. It can open sockets only to
            the gripper of a cell.
        inputs: Input to set before the start as NAME=VALUE, repeatable. NAME is digital_input_N, input_bit_register_N,
            input_int_register_N or input_double_register_N.
        timeout: End the run after this time in s as the robot counts it, with exit code 1 [the program may run for
            ever].
        config: TOML file with any options of tvist serve for one robot; options on the command line take precedence.
        json: Print one JSON object at the end instead of messages.
        given: Fields of `ServeConfig`.
    """
    if check:
        if given or lockstep or inputs or config or timeout is not None:
            raise Failure(
                "--check runs nothing, so that only --json goes with it: leave the others out", code=2
            )
        check_scripts(file, json=json)
        return
    program, *others = file
    if others:
        raise Failure(f"tvist run runs one program: leave {others[0]} out, or give --check", code=2)
    if timeout is not None and timeout <= 0.0:
        raise Failure(f"timeout is {timeout:g}: must be more than 0", code=2)
    text = read_script(program)
    _check(program, text, json=json)
    checked = _configuration(given, config, lockstep=lockstep)
    job = _Job(program, text, inputs or (), timeout, _Tell(quiet=json))
    watch, errors, server = job.in_lockstep(checked) if lockstep else job.in_real_time(checked)
    job.tell(watch)
    job.tell.clear()
    if json:
        from tvist_lab.programs.watch import as_dict

        print_json(
            {"file": named(program), "lockstep": lockstep, "recording": checked.record, **as_dict(watch)}
        )
    failure = _failure(program, watch, errors)
    if failure is None and not json:
        from tvist_lab.programs.watch import summary

        say(summary(watch))
    sys.stdout.flush()
    if server is not None and not server.left:
        if failure is not None:
            say(f"tvist: {failure}")
        leave(server, 0 if failure is None else failure.code)
    if failure is not None:
        raise failure


def _check(file: Path, text: str, *, json: bool) -> None:
    """Say what is wrong with a program before anything is started for it."""
    from tvist_controller.programs.checking import check_program

    findings = check_program(text)
    for finding in findings:
        say(placed(file, finding))
    errors = [finding for finding in findings if finding.level == "error"]
    if not errors:
        return
    if json:
        first = {"line": errors[0].line, "column": errors[0].column, "text": errors[0].text}
        print_json({"file": named(file), "ok": False, "exit_reason": "compile_error", "error": first})
    raise Failure(
        f"{named(file)} cannot run: it has {len(errors)} {'error' if len(errors) == 1 else 'errors'}"
    )


def _configuration(given: dict[str, Any], file: str | None, *, lockstep: bool) -> ServeConfig:
    """The robot's configuration: that of `tvist serve` for one robot, with the profile `ursim`."""
    for name in ("listen", "ur", "ur_allow"):
        if lockstep and name in given:
            option = name.replace("_", "-")
            raise Failure(
                f"--lockstep and --{option} exclude each other: in lockstep there is no network", code=2
            )
    with told(ConfigError, code=2):
        content = content_of(file)
    for key, instead in (("robots", "tvist run has one robot"), ("clock", "tvist run has --lockstep")):
        if key in content:
            raise Failure(f"configuration {file}: leave {key} out, since {instead}", code=2)
    return configuration({**given, "clock": "free" if lockstep else "realtime"}, file, profile="ursim")


class _Job:
    """A program to run, and whom to tell."""

    def __init__(
        self, file: Path, text: str, inputs: Sequence[str], timeout: float | None, tell: "_Tell"
    ) -> None:
        self.file, self.text, self.inputs, self.timeout, self.tell = file, text, inputs, timeout, tell

    def in_lockstep(self, config: ServeConfig) -> "tuple[ProgramWatch, list[str], None]":
        """Run it in this process; return what was observed, and errors of the recording."""
        from tvist_lab.programs.in_lockstep import run_in_lockstep
        from tvist_lab.programs.start import InputError
        from tvist_server.recording import RecorderError

        errors: list[str] = []
        with told(ConfigError, InputError, code=2):
            setup = config.setup()
            compile_if_new()
            with told(RecorderError):
                watch = run_in_lockstep(
                    setup,
                    self.text,
                    self.inputs,
                    record=None if config.record is None else Path(config.record),
                    timeout=self.timeout,
                    attend=self.tell,
                    on_record_error=errors.append,
                )
        if config.record is not None and not errors:
            say(f"recorded into {config.record}")
        return watch, errors, None

    def in_real_time(self, config: ServeConfig) -> "tuple[ProgramWatch, list[str], Server]":
        """Serve a robot that runs it; return what was observed, errors of the recording, and the server."""
        from tvist_lab.programs.in_real_time import ProgramServer
        from tvist_lab.programs.start import InputError
        from tvist_server.ending import Ending
        from tvist_server.gateways.base import GatewayError
        from tvist_server.recording import RecorderError

        ending = Ending()
        with told(ConfigError, InputError, code=2), told(GatewayError, RecorderError), ending.at_once():
            served = ProgramServer(config, self.text, self.inputs, ending, self.timeout, compile_if_new)
        server = served.server

        def ready() -> None:
            setups = [robot.setup for robot in server.robots]
            told_of = introduction(setups, config.profile_in_force)
            say(f"{told_of} {config.place} while {named(self.file)} runs")

        say_who_can_reach(server, config, 1)
        asyncio.run(served.run(ready, self.tell))
        ending.close()
        self.tell.clear()
        return served.watch, say_recorded(server.recordings), server


def _failure(file: Path, watch: "ProgramWatch", errors: list[str]) -> Failure | None:
    """Why the run has failed; None if it has not."""
    after = f"after {watch.seconds:.3f} s of robot time"
    match watch.reason:
        case "finished":
            return Failure("; ".join(errors)) if errors else None
        case "runtime_error" if watch.error is not None:
            say(f"{named(file)}:{watch.error.line}:{watch.error.column}: {watch.error.text}")
            return Failure(f"{named(file)} ended with an error {after}")
        case "signal" if watch.why is not None and watch.why.startswith("SIGINT"):
            return interrupted(f"{named(file)} had run for {watch.seconds:.1f} s of robot time")
    return Failure(f"{named(file)} failed {after}: {watch.why}")


class _Tell:
    """Prints what a program says as it comes, and on a terminal a line with its progress.

    Args:
        quiet: Whether to print no messages, since they are part of the one JSON object.
    """

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self._shown, self._visible = 0.0, False

    def __call__(self, watch: "ProgramWatch") -> None:
        """Print what is new."""
        while watch.news:
            said = watch.news.popleft()
            if not self._quiet:
                self.clear()
                _print(said)
        now = time.monotonic()
        if err.is_terminal and now - self._shown >= SHOWN_EVERY:
            self._shown, self._visible = now, True
            place = f", line {watch.line}" if watch.line else ""
            move = f", move {len(watch.moves)}" if watch.moves else ""
            progress = f"{watch.name}: {watch.seconds:.1f} s{place}{move}"
            sys.stderr.write(_CLEAR + harmless(progress)[: max(err.width - 1, 1)])
            sys.stderr.flush()

    def clear(self) -> None:
        """Remove the progress line."""
        if self._visible:
            sys.stderr.write(_CLEAR)
            sys.stderr.flush()
            self._visible = False


def _print(said: "Said") -> None:
    """Print a message on stdout, a warning on stderr."""
    match said.kind:
        case "text":
            print(harmless(said.text), flush=True)
        case "popup":
            level = "" if said.level in {None, "message"} else f" ({said.level})"
            print(harmless(f"popup{level}: {said.title}: {said.text}"), flush=True)
        case "warning":
            say(f"warning: {said.text}")
