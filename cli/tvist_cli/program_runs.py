"""Read, check and run URScript programs, and report how each ended."""

import asyncio
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tvist_cli.compiling import compile_if_new
from tvist_cli.failure import Failure, Misuse, failing_on, interrupted
from tvist_cli.output import err, print_json, say
from tvist_cli.serving import introduction, say_recorded, say_who_can_reach
from tvist_controller.programs.compiling import ProgramFinding, check_program
from tvist_lab.phrases import counted
from tvist_lab.programs.judging import Run, broken, changes, missed
from tvist_lab.programs.limits import RunLimits
from tvist_lab.programs.results import Shortcoming, as_dict, summary
from tvist_lab.programs.running import InputError, ProgramServer, run_in_lockstep
from tvist_lab.programs.watch import ProgramMessage, ProgramWatch
from tvist_plant.user_file import LARGEST, UserFileError
from tvist_protocol.errors import harmless
from tvist_server.config import ServeConfig
from tvist_server.polyscope.files import read_program, text_of
from tvist_server.polyscope.nodes import NONE, Choices
from tvist_server.program_folder import SCRIPT, URP
from tvist_server.server import Server
from tvist_server.shutdown import Shutdown

SHOWN_EVERY = 0.1  # shortest time between two changes of the progress line [s]
_CLEAR = "\r\x1b[K"  # moves to the start of the terminal's line and clears it


def named(file: Path) -> str:
    """Return a file's name for messages."""
    return "<stdin>" if _is_stdin(file) else str(file)


def _is_stdin(file: Path) -> bool:
    return str(file).strip() == "-"  # `readable` may have put a blank before it


def read_script(file: Path, choices: Choices = NONE) -> str:
    """Read a program; `-` reads the standard input."""
    with failing_on(OSError, exit_code=2):
        try:
            if not _is_stdin(file):
                return read_program(file, choices)
            content = sys.stdin.buffer.read(LARGEST + 1)
            if len(content) > LARGEST:
                raise Misuse(f"the standard input has more than {LARGEST >> 20} MiB: give a smaller program")
            return text_of(Path(named(file)), content, choices)
        except UserFileError as error:
            raise Misuse(str(error)) from error


def answers_of(given: Sequence[str]) -> dict[str, str]:
    """Return the values of --answer by their names."""
    answers: dict[str, str] = {}
    for one in given:
        name, equals, value = one.partition("=")
        if not equals or name in answers:
            raise Misuse(f"answer is {one!r}: give NAME=VALUE, and each NAME once")
        answers[name] = value
    return answers


def programs_in(files: Sequence[Path]) -> list[Path]:
    """Replace folders by their programs, without scripts that PolyScope exported beside programs it saved."""
    found: list[Path] = []
    for file in files:
        inside = sorted(file.rglob("*")) if file.is_dir() else [file]
        programs = [one for one in inside if one.suffix in {SCRIPT, URP}] if file.is_dir() else inside
        if not programs:
            raise Misuse(f"folder {file} has no programs: files that end with {SCRIPT} or {URP}")
        found += [one for one in programs if one.suffix != SCRIPT or one.with_suffix(URP) not in programs]
    return found


def read_scripts(files: Sequence[Path], choices: Choices) -> list[str | Failure]:
    """Read programs. If there are several, return the Failure of each unreadable one, so others can run."""
    found: list[str | Failure] = []
    for file in files:
        try:
            found.append(read_script(file, choices))
        except Failure as error:
            if len(files) == 1:
                raise
            found.append(error)
    unused = ", ".join(sorted(choices.answers.keys() - choices.used))
    if unused and not any(isinstance(one, Failure) for one in found):
        raise Misuse(f"no question needs --answer {unused}: leave it out")
    return found


def print_scripts(files: Sequence[Path], choices: Choices) -> None:
    """Print programs as URScript."""
    for text in read_scripts(programs_in(files), choices):
        if isinstance(text, Failure):
            raise text
        print(text, end="")


def placed(file: Path, finding: ProgramFinding) -> str:
    """Format a finding as FILE:LINE:COLUMN: text, which editors understand."""
    kind = "" if finding.level == "error" else f"{finding.level}: "
    return f"{named(file)}:{finding.line}:{finding.column}: {kind}{finding.text}"


def check_scripts(files: Sequence[Path], choices: Choices, *, json: bool) -> None:
    """Print the errors and warnings of programs; raise Failure if there are errors."""
    files = programs_in(files)
    texts = zip(files, read_scripts(files, choices), strict=True)
    found = [(one, finding) for one, text in texts for finding in _findings(text)]
    errors = sum(finding.level == "error" for _, finding in found)
    if json:
        findings = [{"file": named(one)} | asdict(finding) for one, finding in found]
        print_json({"ok": errors == 0, "files": len(files), "errors": errors, "findings": findings})
    else:
        for one, finding in found:
            print(harmless(placed(one, finding)))
    if errors:
        raise Failure(f"{counted(errors, 'error')} in {counted(len(files), 'program')}")


def _findings(text: str | Failure) -> list[ProgramFinding]:
    """Check a program. A program that could not be read gets an error in its first line."""
    return check_program(text) if isinstance(text, str) else [ProgramFinding(1, 1, "error", str(text))]


@dataclass(frozen=True)
class ProgramOutcome:
    """How a program's run ended."""

    result: dict[str, Any]  # the program's part of what --json prints
    account: str = ""  # summary of the run
    failure: Failure | None = None  # why the run failed; None if it passed
    server: Server | None = None  # the robot's server; None in lockstep


class ProgramConsole:
    """Prints messages of programs as they come (unless `quiet`), and on a terminal a progress line."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet = quiet
        self.which = ""  # which of several programs is running, for the progress line
        self._shown, self._visible = 0.0, False

    def __call__(self, watch: ProgramWatch) -> None:
        """Print the new messages."""
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


def _print(said: ProgramMessage) -> None:
    """Print a message on stdout, a warning on stderr."""
    match said.kind:
        case "text":
            print(harmless(said.text), flush=True)
        case "popup":
            level = "" if said.level in {None, "message"} else f" ({said.level})"
            print(harmless(f"popup{level}: {said.title}: {said.text}"), flush=True)
        case "warning":
            say(f"warning: {said.text}")


@dataclass(frozen=True)
class Runner:
    """Runs programs, each on a new robot, and judges them."""

    config: ServeConfig
    inputs: Sequence[str]
    timeout: float | None
    limits: RunLimits
    baseline: Mapping[str, Run] | None  # earlier runs by program name; None if there is no baseline
    tell: ProgramConsole

    def run(self, file: Path, text: str | Failure) -> ProgramOutcome:
        """Run a program if it was read and compiles."""
        if isinstance(text, Failure):
            why = asdict(Shortcoming("refused", str(text)))
            result = {"file": named(file), "ok": False, "exit_reason": "refused", "failures": [why]}
            return ProgramOutcome(result, failure=text)
        if (refused := _refused(file, text)) is not None:
            return refused
        lockstep, errors, server = self.config.clock == "free", list[str](), None
        with failing_on(InputError, exit_code=2), failing_on():
            if lockstep:
                watch = self._in_lockstep(text, errors)
            else:
                watch, server = self._in_real_time(file, text, errors)
        self.tell(watch)
        self.tell.clear()
        result = {
            "file": named(file), "lockstep": lockstep, "recording": self.config.record, **as_dict(watch)
        }  # fmt: skip
        differing = [] if self.baseline is None else [*changes(self.baseline[named(file)], result)]
        exceeded, misplaced = [*broken(self.limits, watch)], missed(self.limits, watch.plant)
        judged = [*exceeded, *misplaced, *differing]
        failures = [*_ended(watch, errors), *judged]
        result |= {"ok": not failures, "failures": [asdict(one) for one in failures]}
        failure = _failure(file, watch, errors)
        for one in judged:
            say(f"{named(file)}:{'' if one.line is None else f'{one.line}:'} {one.text}")
        if failure is None and failures:
            parts = [f"broke {counted(len(exceeded), 'limit')}"] if exceeded else []
            parts += [f"missed {counted(len(misplaced), 'expectation')}"] if misplaced else []
            parts += [f"differs from the baseline in {counted(len(differing), 'point')}"] if differing else []
            failure = Failure(f"{named(file)} {' and '.join(parts)}")
        return ProgramOutcome(result, summary(watch), failure, server)

    def _in_lockstep(self, text: str, errors: list[str]) -> ProgramWatch:
        """Run a program in this process; errors of the recording are appended to `errors`."""
        record = self.config.record
        with failing_on(exit_code=2):
            setup = self.config.setup()
        compile_if_new()
        watch = run_in_lockstep(
            setup, text, self.inputs, record=None if record is None else Path(record), timeout=self.timeout,
            attend=self.tell, on_record_error=errors.append,
        )  # fmt: skip
        if record is not None and not errors:
            say(f"recorded into {record}")
        return watch

    def _in_real_time(self, file: Path, text: str, errors: list[str]) -> tuple[ProgramWatch, Server]:
        """Serve a robot that runs a program; errors of the recording are appended to `errors`."""
        config, ending = self.config, Shutdown()
        with ending.at_once():
            served = ProgramServer(config, text, self.inputs, ending, self.timeout, compile_if_new)
        server = served.server

        def ready() -> None:
            listens = introduction([robot.setup for robot in server.robots], config.profile_in_force)
            say(f"{listens} {config.place} while {named(file)} runs")

        say_who_can_reach(server, config, 1)
        asyncio.run(served.run(ready, self.tell))
        ending.close()
        self.tell.clear()
        errors += say_recorded(server.recordings)
        return served.watch, server


def _refused(file: Path, text: str) -> ProgramOutcome | None:
    """Print a program's errors and warnings before anything starts; return the outcome if it cannot run."""
    findings = check_program(text)
    for finding in findings:
        say(placed(file, finding))
    errors = [finding for finding in findings if finding.level == "error"]
    if not errors:
        return None
    first = {"line": errors[0].line, "column": errors[0].column, "text": errors[0].text}
    failures = [{"kind": "compile_error", "line": one.line, "text": one.text} for one in errors]
    result = {"file": named(file), "ok": False, "exit_reason": "compile_error", "error": first}
    why = f"{named(file)} cannot run: it has {counted(len(errors), 'error')}"
    return ProgramOutcome({**result, "failures": failures}, failure=Failure(why))


def _ended(watch: ProgramWatch, errors: list[str]) -> list[Shortcoming]:
    """Return the failures of the program and its recording; limits and baseline are judged elsewhere."""
    found = [Shortcoming("recording", error) for error in errors]
    if watch.reason != "finished":
        line = None if watch.error is None else watch.error.line
        found.insert(0, Shortcoming(watch.reason or "", watch.why or "", line))
    return found


def _failure(file: Path, watch: ProgramWatch, errors: list[str]) -> Failure | None:
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
