"""What a sweep's file names: robots, calibrations and shapers, loaded and tried out."""

from pathlib import Path
from typing import TYPE_CHECKING

from tvist_cli.failure import Failure, told
from tvist_cli.shapers_of import calibration_for, loaded
from tvist_cli.simulated_arm import disturbed

if TYPE_CHECKING:
    from tvist_lab.study.axes import Axes, SweptRobot
    from tvist_lab.study.recipes import Recipe
    from tvist_lab.study.spec import NamedRobot, Spec
    from tvist_plant.description import RobotDescription


def axes_of(path: Path) -> "Axes":
    """Read a sweep's file, and load all that it names; paths in it are relative to its folder.

    Raises:
        Failure: The file, or what it names, is invalid; the message names the key.
    """
    from tvist_lab.study.axes import Axes
    from tvist_lab.study.moves import MovesError
    from tvist_lab.study.spec import read_spec

    with told(OSError):
        spec = read_spec(path)
    robots = [_robot(path, spec, place, named) for place, named in enumerate(spec.robots)]
    try:
        return Axes(spec, robots)
    except MovesError as error:
        raise Failure(f"sweep {path}: {error}") from error


def _robot(path: Path, spec: "Spec", place: int, named: "str | NamedRobot") -> "SweptRobot":
    from tvist_lab.study.axes import SweptRobot
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
    from tvist_controller.own_files import is_file
    from tvist_controller.refusal import RefusalError
    from tvist_lab.study.recipes import Recipe, RecipeError
    from tvist_shaping.errors import ShapingError

    # The workers of a cluster have other working folders.
    name, own = loaded(str((path.parent / shaper).resolve()) if is_file(shaper) else shaper)
    known = calibration_for(calibration, name, own, spec.modes, arm)
    recipe = Recipe(name, known, modes=spec.modes, own=own)
    with told(RecipeError, RefusalError, ShapingError):
        recipe.elastic(arm, recipe.make(arm, arm.limits.payload))
    return recipe
