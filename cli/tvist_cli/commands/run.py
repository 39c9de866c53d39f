"""`tvist run`: run programs in URScript, each on a robot of its own."""

import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from tvist_cli.failure import Failure, told
from tvist_cli.output import print_json, say
from tvist_cli.program_runs import Ran, Runner, Tell, check_scripts, named, read_script
from tvist_cli.robot_options import configuration, content_of, with_robot_options
from tvist_cli.serving import leave
from tvist_lab.programs.judging import BaselineError, Limits, Run, read_baseline
from tvist_lab.programs.results import junit as junit_of
from tvist_server.config import ServeConfig
from tvist_server.option_values import StartError
from tvist_server.server import Server

OPTIONS = {
    "robot", "profile", "payload", "overload", "adapt", "shaper", "shape_servo", "plant", "hidden", "start",
    "seed", "record", "truth", "listen", "ur", "ur_allow", "cell", "world",
}  # fmt: skip
"""Options of `tvist serve` that one robot which ends with its program can do with."""
NO_LIMITS = Limits()


@with_robot_options(OPTIONS)
def run(
    *file: Annotated[Path, Parameter(required=True)],
    check: bool = False,
    lockstep: bool = False,
    inputs: Annotated[list[str] | None, Parameter(name="--input")] = None,
    timeout: float | None = None,
    limits: Annotated[Limits, Parameter(name="*")] = NO_LIMITS,
    junit: Path | None = None,
    baseline: Path | None = None,
    config: str | None = None,
    json: bool = False,
    **given: Any,
) -> None:
    """Run a program in URScript on a robot of its own, print its messages as they come, and end with an exit code.

    Exit code 0: the program ended by itself, within all limits. Exit code 1: it does not compile; an error, a
    protective stop, a safety stop, a client or --timeout ended it; or it broke a limit, or differs from --baseline.
    Errors in the program are printed as FILE:LINE:COLUMN: text. Exit code 2: the command line is wrong, or the file
    cannot be read.

    The program runs in real time, on a robot that other programs can reach as if tvist serve ran it. Popups do not
    hold it up: they are printed and closed. With --lockstep several programs run, one after the other, each on a
    fresh robot.

    With --check, nothing runs. Errors are what keeps a program from starting: wrong syntax, unknown names, and calls
    that do not fit their functions. A function of UR's robots that tvist does not simulate is a warning: the program
    starts, and ends with an error when it calls that function.

    Args:
        file: Program to run, or programs to run in lockstep or to check; - reads the standard input.
        check: Look for errors without running anything: each is a line FILE:LINE:COLUMN: text. Exit code 0: there is
            none. Exit code 1: there is at least one. Exit code 2: a file cannot be read.
        lockstep: Run as fast as this machine computes, without network; the arm moves exactly as in real time. A
            program that waits for a client then waits for ever: see --input and --timeout. It can open sockets only to
            the gripper of a cell.
        inputs: Input to set before the start as NAME=VALUE, repeatable. NAME is digital_input_N, input_bit_register_N,
            input_int_register_N or input_double_register_N.
        timeout: End the run after this time in s as the robot counts it, with exit code 1 [the program may run for
            ever].
        limits: What the runs must keep.
        junit: File to write the results to as JUnit XML, with a test case for each program.
        baseline: What an earlier --json of the same programs printed in lockstep: fail if times, stops, shake, speeds
            or warnings differ beyond rounding, and say which.
        config: TOML file with any options of tvist serve for one robot; options on the command line take precedence.
        json: Print one JSON object at the end instead of messages; of several programs, it has a list of programs.
        given: Fields of `ServeConfig`.
    """
    if check:
        if any((given, lockstep, inputs, config, timeout is not None, limits != NO_LIMITS, junit, baseline)):
            raise Failure(
                "--check runs nothing, so that only --json goes with it: leave the others out", code=2
            )
        check_scripts(file, json=json)
        return
    _check_files(file, lockstep=lockstep)
    if timeout is not None and not 0.0 < timeout < math.inf:
        raise Failure(f"timeout is {timeout:g} s: must be finite and more than 0", code=2)
    _check_written(junit, baseline)
    before = None if baseline is None else _baseline(baseline, file, lockstep=lockstep)
    with told(ValueError, code=2):
        limits.check()
    texts = [read_script(one) for one in file]
    checked = _configuration(given, config, lockstep=lockstep)
    if checked.record is not None and len(file) > 1:
        raise Failure(f"record is {checked.record}: it keeps one run, and these are {len(file)}", code=2)
    runner = Runner(checked, inputs or (), timeout, limits, before, Tell(quiet=json))
    ran = _run_all(runner, file, texts)
    results = [one.result for one in ran]
    failure = ran[0].failure if len(file) == 1 else _of_several(ran, len(file))
    if json:
        print_json(results[0] if len(file) == 1 else _together(results, failure))
    elif failure is None:
        say(ran[0].account if len(file) == 1 else f"{len(file)} programs ran as they should")
    if junit is not None:
        with told(OSError):
            junit.write_bytes(junit_of(results))
        say(f"the results are in {junit}")
    sys.stdout.flush()
    _leave(ran[0].server, failure)
    if failure is not None:
        raise failure


def _leave(server: Server | None, failure: Failure | None) -> None:
    """End the process here if the network would keep it."""
    if server is not None and not server.left:
        if failure is not None:
            say(f"tvist: {failure}")
        leave(server, 0 if failure is None else failure.code)


def _run_all(runner: Runner, files: Sequence[Path], texts: Sequence[str]) -> list[Ran]:
    """Run programs one after the other; of several, say at once how each ended."""
    ran: list[Ran] = []
    for number, (file, text) in enumerate(zip(files, texts, strict=True), 1):
        if len(files) > 1:
            runner.tell.which = f"{number} of {len(files)}: "
        ran.append(runner.run(file, text))
        failure = ran[-1].failure
        if len(files) > 1:
            say(f"{named(file)}: {ran[-1].account}" if failure is None else f"{failure}")
        if failure is not None and failure.code == 130:
            break
    return ran


def _together(results: list[dict[str, Any]], failure: Failure | None) -> dict[str, Any]:
    """What --json prints of several programs."""
    return {
        "ok": failure is None,
        "failed": sum(not result["ok"] for result in results),
        "seconds": round(sum(result.get("seconds", 0.0) for result in results), 6),
        "programs": results,
    }


def _of_several(ran: Sequence[Ran], count: int) -> Failure | None:
    """Why the runs of several programs have failed; None if they have not."""
    failed = [one for one in ran if one.failure is not None]
    if not failed:
        return None
    last = failed[-1].failure
    assert last is not None
    if last.code == 130:
        return Failure(f"{last}; {len(ran) - 1} of {count} programs had ended", code=130)
    names = ", ".join(one.result["file"] for one in failed)
    return Failure(f"{len(failed)} of {count} programs failed: {names}")


def _check_files(files: Sequence[Path], *, lockstep: bool) -> None:
    """Refuse several programs in real time, and one that cannot be told from another."""
    if len(files) > 1 and not lockstep:
        raise Failure(
            f"tvist run runs several programs only in lockstep: give --lockstep, or --check, or leave {files[1]} out",
            code=2,
        )
    names = [named(one) for one in files]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise Failure(f"{twice} is given twice: give each program once", code=2)


def _check_written(junit: Path | None, baseline: Path | None) -> None:
    """Refuse a file that cannot be written, before anything runs."""
    if junit is None:
        return
    if junit.is_dir() or not junit.parent.is_dir():
        why = "that is a folder" if junit.is_dir() else f"there is no folder {junit.parent}"
        raise Failure(f"junit is {junit}: {why}", code=2)
    if baseline is not None and junit.absolute() == baseline.absolute():
        raise Failure("junit and baseline are the same file: give each its own", code=2)


def _baseline(path: Path, files: Sequence[Path], *, lockstep: bool) -> Mapping[str, Run]:
    """The baseline's runs by the names of their programs."""
    if not lockstep:
        raise Failure(
            "--baseline needs --lockstep, in which equal programs run alike to the last bit", code=2
        )
    with told(BaselineError, OSError, code=2):
        return read_baseline(path, list(map(named, files)))


def _configuration(given: dict[str, Any], file: str | None, *, lockstep: bool) -> ServeConfig:
    """The robot's configuration: that of `tvist serve` for one robot, with the profile `ursim`."""
    for name in ("listen", "ur", "ur_allow"):
        if lockstep and name in given:
            option = name.replace("_", "-")
            raise Failure(
                f"--lockstep and --{option} exclude each other: in lockstep there is no network", code=2
            )
    with told(StartError, code=2):
        content = content_of(file)
    for key, instead in (("robots", "tvist run has one robot"), ("clock", "tvist run has --lockstep")):
        if key in content:
            raise Failure(f"configuration {file}: leave {key} out, since {instead}", code=2)
    return configuration({**given, "clock": "free" if lockstep else "realtime"}, file, profile="ursim")
