"""Runs of programs in URScript: one after the other, what each says as it comes, and how it ended."""

import asyncio
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import err, say
from tvist_cli.scripts import named, placed
from tvist_cli.serving import compile_if_new, introduction, say_recorded, say_who_can_reach
from tvist_protocol.errors import harmless
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError

if TYPE_CHECKING:
    from tvist_lab.programs.baseline import Run
    from tvist_lab.programs.expectations import Expectation
    from tvist_lab.programs.limits import Limits, Shortcoming
    from tvist_lab.programs.watch import ProgramWatch, Said
    from tvist_server.server import Server

SHOWN_EVERY = 0.1
"""Time between two changes of the progress line [s]."""
_CLEAR = "\r\x1b[K"
"""Returns to the beginning of the terminal's line and clears it."""


@dataclass(frozen=True)
class Ran:
    """What came of a program."""

    result: dict[str, Any]
    """What --json prints of it."""
    account: str = ""
    """What it did, in a sentence."""
    failure: Failure | None = None
    """Why it has failed; None if it has not."""
    server: "Server | None" = None
    """Server of its robot; None in lockstep."""


@dataclass(frozen=True)
class Judged:
    """What each run is measured by."""

    limits: "Limits"
    baseline: "Mapping[str, Run] | None" = None
    """Earlier runs by the names of their programs; None if there is no baseline."""
    expected: "Sequence[Expectation]" = ()
    """What each is to leave behind."""


def run_program(
    file: Path,
    text: str,
    config: ServeConfig,
    inputs: Sequence[str],
    timeout: float | None,
    judged: Judged,
    tell: "Tell",
) -> Ran:
    """Run a program on a robot of its own, unless it does not compile, and judge what it did."""
    if (refused := _checked(file, text)) is not None:
        return refused
    from tvist_lab.programs.account import as_dict, summary
    from tvist_lab.programs.baseline import changes
    from tvist_lab.programs.expectations import missed

    job, lockstep = Job(file, text, inputs, timeout, tell), config.clock == "free"
    watch, errors, server = job.in_lockstep(config) if lockstep else job.in_real_time(config)
    tell(watch)
    tell.clear()
    result = {"file": named(file), "lockstep": lockstep, "recording": config.record, **as_dict(watch)}
    found = [*judged.limits.broken(watch)]
    elsewhere = missed(judged.expected, watch.plant)
    changed = [] if judged.baseline is None else [*changes(judged.baseline[named(file)], result)]
    failures = [*_ended(watch, errors), *found, *elsewhere, *changed]
    result |= {"ok": not failures, "failures": [one.as_dict() for one in failures]}
    failure = _failure(file, watch, errors)
    for one in (*found, *elsewhere, *changed):
        say(f"{named(file)}:{'' if one.line is None else f'{one.line}:'} {one.text}")
    if failure is None and failures:
        parts = [f"broke {_counted(found, 'limit')}"] if found else []
        parts += [f"missed {_counted(elsewhere, 'expectation')}"] if elsewhere else []
        parts += [f"differs from the baseline in {_counted(changed, 'point')}"] if changed else []
        failure = Failure(f"{named(file)} {' and '.join(parts)}")
    return Ran(result, summary(watch), failure, server)


def _counted(found: Sequence[object], what: str) -> str:
    from tvist_lab.words import counted

    return counted(len(found), what)


def _checked(file: Path, text: str) -> Ran | None:
    """Say what is wrong with a program before anything is started for it; None if it can run."""
    from tvist_controller.programs.checking import check_program

    findings = check_program(text)
    for finding in findings:
        say(placed(file, finding))
    errors = [finding for finding in findings if finding.level == "error"]
    if not errors:
        return None
    first = {"line": errors[0].line, "column": errors[0].column, "text": errors[0].text}
    failures = [{"kind": "compile_error", "line": one.line, "text": one.text} for one in errors]
    result = {"file": named(file), "ok": False, "exit_reason": "compile_error", "error": first}
    why = f"{named(file)} cannot run: it has {_counted(errors, 'error')}"
    return Ran({**result, "failures": failures}, failure=Failure(why))


def _ended(watch: "ProgramWatch", errors: list[str]) -> "list[Shortcoming]":
    """What failed apart from limits and baseline: the program itself, or its recording."""
    from tvist_lab.programs.limits import Shortcoming

    found = [Shortcoming("recording", error) for error in errors]
    if watch.reason != "finished":
        line = None if watch.error is None else watch.error.line
        found.insert(0, Shortcoming(watch.reason or "", watch.why or "", line))
    return found


def _failure(file: Path, watch: "ProgramWatch", errors: list[str]) -> Failure | None:
    """Why the run itself has failed; None if it has not."""
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


class Job:
    """A program to run, and whom to tell."""

    def __init__(
        self, file: Path, text: str, inputs: Sequence[str], timeout: float | None, tell: "Tell"
    ) -> None:
        self.file, self.text, self.inputs, self.timeout, self.tell = file, text, inputs, timeout, tell

    def in_lockstep(self, config: ServeConfig) -> "tuple[ProgramWatch, list[str], None]":
        """Run it in this process; return what was observed, and errors of the recording."""
        from tvist_lab.programs.in_lockstep import run_in_lockstep
        from tvist_lab.programs.start import InputError
        from tvist_server.recording import RecorderError

        errors: list[str] = []
        with told(StartError, InputError, code=2):
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
        with told(StartError, InputError, code=2), told(GatewayError, RecorderError), ending.at_once():
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


class Tell:
    """Prints what a program says as it comes, and on a terminal a line with its progress.

    Args:
        quiet: Whether to print no messages, since they are part of the one JSON object.
    """

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self.which = ""
        """Which of several programs it is, for the line with the progress."""
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
            progress = f"{self.which}{watch.name}: {watch.seconds:.1f} s{place}{move}"
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
