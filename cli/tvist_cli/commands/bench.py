"""`tvist bench`: measure how fast tvist runs on this machine."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from tvist_cli.failure import Failure, interrupted, told
from tvist_cli.output import err, print_json
from tvist_lab.benchmark.names import PartName

Study = Callable[[], None]


def bench(
    *,
    seconds: float = 10.0,
    only: Annotated[list[PartName] | None, Parameter(consume_multiple=True)] = None,
    shapers: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    against: Path | None = None,
    soak: float | None = None,
    hostile: int | None = None,
    lateness: float | None = None,
    json: bool = False,
) -> None:
    """Measure how fast tvist runs, every figure beside a reference that is measured in turn in the same run.

    The references are the same arm in MuJoCo, Python's compiler, a bare send() and the line of one robot. Figures of
    served robots that have none are printed below.

    Args:
        seconds: Seconds of each measurement of a robot in real time; 0 skips what serves robots.
        only: Parts to measure [all].
        shapers: Further shapers with which the line is measured, besides zv and auto.
        against: File with what tvist bench --json printed before, to compare with: prints for each figure the change of
            its ratio to its reference, and whether it is beyond chance.
        soak: Serve a robot under load for this many minutes instead, and report whether memory and timing stay stable.
        hostile: Instead, compare how late a served robot's ticks are with and without 100 messages a second of every
            type and size, valid and invalid, in this many pairs of runs of --seconds each.
        lateness: Instead, compare the ticks that a served robot misses with those that a bare thread misses which
            sleeps to the same deadlines, in turn: for this many minutes alone, as many with ten clients, and as many
            with ten clients, real-time priority and locked memory.
        json: Print one JSON object.
    """
    from tvist_cli import bench_studies as run

    _check(
        seconds,
        {"soak": soak, "lateness": lateness},
        {"hostile": hostile},
    )
    studies: dict[str, tuple[float | None, Study]] = {
        "hostile": (hostile, lambda: run.hostile(hostile or 0, seconds, json)),
        "lateness": (lateness, lambda: run.lateness(lateness or 0.0, json)),
        "soak": (soak, lambda: run.soak(soak or 0.0, json)),
    }
    asked = [name for name, (value, _) in studies.items() if value is not None]
    _check_together(asked, {"only": only, "shapers": shapers, "against": against})
    try:
        if asked:
            studies[asked[0]][1]()
        else:
            _all(seconds, only, shapers or (), against, json)
    except KeyboardInterrupt:
        raise interrupted("the measurements so far are lost; the served robots have stopped") from None


def _check(seconds: float, durations: dict[str, float | None], runs: dict[str, int | None]) -> None:
    if seconds < 0.0:
        raise Failure(f"seconds is {seconds:g}: must be at least 0", code=2)
    for name, duration in durations.items():
        if duration is not None and not duration > 0.0:
            raise Failure(f"{name} is {duration:g}: must be more than 0", code=2)
    for name, pairs in runs.items():
        if pairs is not None and not (pairs >= 2 and seconds > 0.0):
            raise Failure(
                f"{name} is {pairs}: must be at least 2 pairs of runs, of more than 0 seconds", code=2
            )


def _check_together(asked: Sequence[str], given: dict[str, object]) -> None:
    """Refuse options that would do nothing."""
    if len(asked) > 1:
        raise Failure(
            f"--{asked[0]} and --{asked[1]} each run instead of the other: give one of them", code=2
        )
    for name, value in given.items():
        if asked and value is not None:
            raise Failure(f"--{name} does nothing with --{asked[0]}: leave it out", code=2)


def _all(
    seconds: float, only: Sequence[PartName] | None, shapers: Sequence[str], against: Path | None, json: bool
) -> None:
    from tvist_cli.bench_tables import print_changes, print_run
    from tvist_lab.bench import PARTS
    from tvist_lab.bench import bench as run
    from tvist_lab.benchmark.saved_run import as_json, changes, changes_as_json, load_run
    from tvist_server.config import ConfigError

    if only is not None and seconds == 0.0 and (served := [name for name in only if PARTS[name].serves]):
        raise Failure(f"only names {served[0]}, which needs seconds of more than 0", code=2)
    if only is not None and shapers and "line" not in only:
        raise Failure("--shapers is about the part line: add it to --only, or leave --shapers out", code=2)
    saved = None
    if against is not None:
        with told(OSError):
            saved = load_run(against)
    with told(ConfigError, code=2):
        result = run(seconds, lambda what: err.print(f"measuring {what} ..."), only, shapers)
    found = [] if saved is None else changes(saved, result)
    if json:
        print_json(as_json(result) | ({} if saved is None else {"against": changes_as_json(found)}))
        return
    print_run(result)
    if saved is not None:
        print_changes(saved, result, found)
