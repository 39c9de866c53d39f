"""Run URScript programs one after the other, and print how they ended."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tvist_cli.failure import Failure, Misuse, check_range, failing_on
from tvist_cli.output import print_json, say
from tvist_cli.program_runs import ProgramConsole, ProgramOutcome, Runner, named, programs_in, read_scripts
from tvist_cli.robot_options import configuration, content_of
from tvist_cli.serving import leave
from tvist_lab.programs.judging import BaselineError, Run, read_baseline
from tvist_lab.programs.limits import RunLimits
from tvist_lab.programs.results import junit as junit_of
from tvist_lab.whole_file import write_whole
from tvist_server.config import ServeConfig
from tvist_server.polyscope.nodes import Choices


def run_programs(
    file: Sequence[Path],
    given: dict[str, Any],
    *,
    choices: Choices,
    lockstep: bool,
    inputs: Sequence[str],
    timeout: float | None,
    limits: RunLimits,
    junit: Path | None,
    baseline: Path | None,
    config: str | None,
    json: bool,
) -> None:
    """Run programs as `tvist run` does without --check."""
    file = programs_in(file)
    _check_files(file, lockstep=lockstep)
    check_range("timeout", timeout, 0.0, unit=" s", above=True)
    _check_written(junit, baseline)
    before = None if baseline is None else _baseline(baseline, file, lockstep=lockstep)
    with failing_on(ValueError, exit_code=2):
        limits.check()
    texts = read_scripts(file, choices)
    checked = _configuration(given, config, lockstep=lockstep)
    if checked.record is not None and len(file) > 1:
        raise Misuse(
            f"record is {checked.record}: it keeps one run, but there are {len(file)} programs: leave it out"
        )
    runner = Runner(checked, inputs, timeout, limits, before, ProgramConsole(quiet=json))
    ran = _run_all(runner, file, texts)
    results = [one.result for one in ran]
    failure = ran[0].failure if len(file) == 1 else _of_several(ran, len(file))
    if json:
        together = {
            "ok": failure is None,
            "failed": sum(not result["ok"] for result in results),
            "seconds": round(sum(result.get("seconds", 0.0) for result in results), 6),
            "programs": results,
        }
        print_json(results[0] if len(file) == 1 else together)
    elif failure is None:
        say(ran[0].account if len(file) == 1 else f"{len(file)} programs ran as they should")
    if junit is not None:
        write_whole(junit, junit_of(results))
        say(f"the results are in {junit}")
    sys.stdout.flush()
    server = ran[0].server
    if server is not None and not server.left:  # the network would keep the process running
        if failure is not None:
            say(f"tvist: {failure}")
        leave(server, 0 if failure is None else failure.code)
    if failure is not None:
        raise failure


def _run_all(runner: Runner, files: Sequence[Path], texts: Sequence[str | Failure]) -> list[ProgramOutcome]:
    """Run programs one after the other; if there are several, print how each ended as soon as it ends."""
    ran: list[ProgramOutcome] = []
    several = len(files) > 1
    for number, (file, text) in enumerate(zip(files, texts, strict=True), 1):
        runner.tell.which = f"{number} of {len(files)}: " if several else ""
        ran.append(runner.run(file, text))
        failure = ran[-1].failure
        if several:
            say(f"{named(file)}: {ran[-1].account}" if failure is None else f"{failure}")
        if failure is not None and failure.code == 130:
            break
    return ran


def _of_several(ran: Sequence[ProgramOutcome], count: int) -> Failure | None:
    """Return the common failure of several programs' runs; None if no run failed."""
    failed = {one.result["file"]: one.failure for one in ran if one.failure is not None}
    if not failed:
        return None
    *_, last = failed.values()
    if last.code == 130:
        return Failure(f"{last}; {len(ran) - 1} of {count} programs had ended", code=130)
    return Failure(f"{len(failed)} of {count} programs failed: {', '.join(failed)}")


def _check_files(files: Sequence[Path], *, lockstep: bool) -> None:
    """Refuse several programs in real time, and programs that messages could not tell apart."""
    if len(files) > 1 and not lockstep:
        raise Misuse(
            f"tvist run runs several programs only in lockstep: give --lockstep, or --check, or leave {files[1]} out"
        )
    names = [named(one) for one in files]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise Misuse(f"{twice} is given twice: give each program once")


def _check_written(junit: Path | None, baseline: Path | None) -> None:
    """Refuse a result file that cannot be written, before anything runs."""
    if junit is None:
        return
    if junit.is_dir() or not junit.parent.is_dir():
        why = "that is a folder" if junit.is_dir() else f"there is no folder {junit.parent}"
        raise Misuse(f"junit is {junit}, but {why}: give a file in a folder that exists")
    if baseline is not None and junit.absolute() == baseline.absolute():
        raise Misuse("junit and baseline are the same file: give each its own")


def _baseline(path: Path, files: Sequence[Path], *, lockstep: bool) -> Mapping[str, Run]:
    if not lockstep:
        raise Misuse("--baseline needs --lockstep, in which equal programs run alike to the last bit")
    with failing_on(BaselineError, OSError, exit_code=2):
        return read_baseline(path, list(map(named, files)))


def _configuration(given: dict[str, Any], file: str | None, *, lockstep: bool) -> ServeConfig:
    """Return the robot's configuration: as for `tvist serve` with one robot and the profile `ursim`."""
    for name in ("listen", "ur", "ur_allow"):
        if lockstep and name in given:
            option = name.replace("_", "-")
            raise Misuse(f"--lockstep and --{option} exclude each other: in lockstep there is no network")
    content = content_of(file)
    for key, instead in (("robots", "tvist run has one robot"), ("clock", "tvist run has --lockstep")):
        if key in content:
            raise Misuse(f"configuration {file}: leave {key} out, since {instead}")
    return configuration({**given, "clock": "free" if lockstep else "realtime"}, file, profile="ursim")
