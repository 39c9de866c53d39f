"""`tvist study sweep`: compare shapers over payloads, errors, moves and robots, on all cores or a cluster."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from tvist_cli import kept
from tvist_cli.failure import Failure, told
from tvist_cli.figure_files import AS_USUAL, FigureOptions
from tvist_cli.shapers_of import calibration_for, designing, loaded
from tvist_cli.simulated_arm import disturbed

if TYPE_CHECKING:
    from tvist_lab.studies.sweep.spec import NamedRobot, Spec
    from tvist_lab.studies.sweep.sweep import Axes, SweptRobot
    from tvist_lab.study.recipes import Recipe
    from tvist_plant.description import RobotDescription

NAMED = 5
"""Largest number of failed rows that are told one by one."""
TERMS = (
    "less: reduction of the peak compared with the unshaped move, median and 5th percentile; still: last time |α| "
    "exceeds 0.1 m/s², from the stop of the unshaped reference"
)
"""What the columns mean."""
DRAWN = 100
"""Largest number of settings in a figure."""


def sweep(
    spec: Path,
    *,
    output: Path | None = None,
    processes: int | None = None,
    scheduler: str | None = None,
    look: FigureOptions = AS_USUAL,
    json: bool = False,
) -> None:
    """Make random moves of robots with every shaper, payload and error that a file lists, and keep a row for each.

    Rows are kept in a folder as they come, so that the same command continues where it was interrupted; it repeats
    what had failed. At the end sweep.parquet in that folder holds all rows, and sweep.png summarizes them. Rows do not
    depend on the number of processes, the order, or interruptions.

    Args:
        spec: TOML file with shapers, moves and payloads, and optionally errors, robots, seed, modes, limits, stroke,
            wrists, streams and disturbances.
        output: Folder for the rows [that of the file, with its name but without .toml].
        processes: Number of processes on this machine [one for each core].
        scheduler: Address of a Dask scheduler whose workers to use instead, such as tcp://HOST:8786.
        look: How to write the figure.
        json: Print one JSON object.
    """
    from tvist_lab.studies.sweep.sweep import SHOWN, setting_name, summary
    from tvist_lab.study.work import FAILED

    folder = kept.folder_of(spec, output, processes, scheduler, look)
    rows, about = kept.run(_axes(spec).plan(), folder, processes, scheduler)
    result = {"spec": str(spec), **about, "summary": summary(rows)}
    entries = [{"setting": setting_name(entry), **entry} for entry in result["summary"]]
    result["figure"] = _drawn(entries, look, folder, result["rows_file"])
    bad = rows.filter(rows["status"] == FAILED).head(NAMED).iter_rows(named=True)
    kept.tell(
        result,
        entries,
        SHOWN,
        json=json,
        terms=TERMS,
        whys=(
            f"move {row['move']} ({setting_name(row)}) with {row['shaper']} failed: {row['error']}"
            for row in bad
        ),
    )


def _drawn(entries: list[dict[str, Any]], look: FigureOptions, folder: Path, rows: str) -> str | None:
    """The path of the figure; None if there are too many settings for one."""
    from tvist_lab.figures import sweep_figure

    settings = [entry["setting"] for entry in entries]
    if len(set(settings)) > DRAWN:
        return None
    try:
        with look.into(folder) as save:
            return str(save(sweep_figure(entries, settings), "sweep"))
    except OSError as error:
        raise Failure(
            f"the figure in {folder} cannot be written: {error.strerror}; all rows are in {rows}"
        ) from error


def _axes(path: Path) -> "Axes":
    """Read a sweep's file, and load all that it names; paths in it are relative to its folder.

    Raises:
        Failure: The file, or what it names, is invalid; the message names the key.
    """
    from tvist_lab.studies.sweep.spec import read_spec
    from tvist_lab.studies.sweep.sweep import Axes
    from tvist_lab.study.moves import MovesError

    with told(OSError):
        spec = read_spec(path)
    robots = [_robot(path, spec, place, named) for place, named in enumerate(spec.robots)]
    try:
        return Axes(spec, robots)
    except MovesError as error:
        raise Failure(f"sweep {path}: {error}") from error


def _robot(path: Path, spec: "Spec", place: int, named: "str | NamedRobot") -> "SweptRobot":
    from tvist_lab.studies.sweep.sweep import SweptRobot
    from tvist_plant.description import DescriptionError, load, robots

    robot, calibration = (named, None) if isinstance(named, str) else (named.robot, named.calibration)
    try:
        with told(DescriptionError):
            description = load(robot if robot in robots() else path.parent / robot)
    except Failure as failure:
        raise Failure(f"sweep {path}: robots[{place}]: {failure}") from failure
    arm, _ = disturbed(description, ",".join(spec.disturbances) or "none", clean=False)
    if calibration is not None and (path.parent / calibration).exists():
        calibration = str(path.parent / calibration)
    recipes = []
    for number, shaper in enumerate(spec.shapers):
        try:
            recipes.append(_recipe(path, spec, shaper, calibration, arm))
        except Failure as failure:
            raise Failure(f"sweep {path}: shapers[{number}] with robots[{place}]: {failure}") from failure
    label = robot if isinstance(named, str) else f"{robot} with {named.calibration}"
    return SweptRobot(label, arm, tuple(recipes))


def _recipe(
    path: Path, spec: "Spec", shaper: str, calibration: str | None, arm: "RobotDescription"
) -> "Recipe":
    from tvist_controller.sources.own_files import is_file
    from tvist_lab.study.recipes import Recipe

    # The workers of a cluster have other working folders.
    name, own = loaded(str((path.parent / shaper).resolve()) if is_file(shaper) else shaper)
    known = calibration_for(calibration, name, own, spec.modes, arm)
    recipe = Recipe(name, known, modes=spec.modes, own=own)
    with designing(code=1):
        recipe.elastic(arm, recipe.make(arm, arm.limits.payload))
    return recipe
