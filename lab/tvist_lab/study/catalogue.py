"""The methods of the studies, made for an arm."""

from collections.abc import Callable, Sequence
from difflib import get_close_matches
from pathlib import Path

from tvist_controller.api.line import OwnShaper
from tvist_lab.study.foreign import FromFile
from tvist_lab.study.menus import ROWS, UNSHAPED, Kind, Row, names, row, rows
from tvist_lab.study.method import Constant, Held, Longer, Method, Named, PeriodOfJerk, Waiting
from tvist_lab.study.recipes import Recipe, longest_mean_delay, robust
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_shaping.errors import UnknownShaperError

MOST_DECLARED = 1.1
"""Largest declared mass of the bench, relative to the rating [-]."""


def made(
    row: Row, recipe: Recipe, description: RobotDescription, masses: tuple[float, float] | None = None
) -> Method:
    """Return a method of the catalogue.

    Args:
        row: Its row.
        recipe: Source of the estimates; its shaper is of no account.
        description: The robot.
        masses: Smallest and largest payload of the study [kg]; None for all that the arm is rated for.
    """
    return _MAKERS[row.kind](row, recipe, description, masses or (0.0, description.limits.payload))


def _for_workspace(
    row: Row, recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> Method:
    f_d, zeta = robust(row.of, recipe, description, masses)
    return Constant(recipe, row.name, row.label, row.of, f_d=f_d, zeta=zeta)


def _held(row: Row, recipe: Recipe, description: RobotDescription, _: tuple[float, float]) -> Method:
    # The longest mean delay over the workspace, for all masses that are declared.
    most = MOST_DECLARED * description.limits.payload
    delay = longest_mean_delay(recipe, description, (0.0, most), row.modes)
    return Held(recipe, delay, row.modes, row.name, row.label)


def _as_long_as(
    row: Row, recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> Method:
    like = next(one for one in ROWS if one.name == row.of)
    return Longer(row.name, row.label, made(like, recipe, description, masses))


_MAKERS: dict[Kind, Callable[[Row, Recipe, RobotDescription, tuple[float, float]], Method]] = {
    "filter": lambda row, recipe, *_: Named(
        Recipe(row.of or row.name, recipe.calibration, modes=row.modes), row.name, row.label
    ),
    "shaped alone": lambda row, recipe, *_: Named(
        Recipe(row.of, recipe.calibration), row.name, row.label, alone=True
    ),
    "for target": lambda row, recipe, *_: Constant(recipe, row.name, row.label, row.of, row.modes),
    "for payload": lambda row, recipe, *_: Constant(recipe, row.name, row.label, row.of, for_payload=True),
    "for workspace": _for_workspace,
    "held": _held,
    "longer": lambda row, *_: Longer(row.name, row.label),
    "as long as": _as_long_as,
    "jerk of a period": lambda row, recipe, *_: PeriodOfJerk(recipe, row.name, row.label),
}


def some(
    wanted: Sequence[str], description: RobotDescription, calibration: Calibration
) -> tuple[Method, ...]:
    """Return methods of the catalogue by their names.

    Args:
        wanted: Names.
        description: The robot.
        calibration: Source of the estimates.

    Raises:
        KeyError: There is no method of a name; the message lists all and the most similar one.
        DesignError: A name has a parameter that no filter has.
    """
    recipe = Recipe("zv", calibration)
    try:
        chosen = [row(name) for name in wanted]
    except UnknownShaperError as error:
        known = [one.name for one in rows()]
        like = "".join(f", did you mean {near!r}" for near in get_close_matches(error.name, known, 1))
        raise KeyError(f"there is no method {error.name!r}{like}: there are {', '.join(known)}") from error
    return tuple(made(one, recipe, description) for one in chosen)


def baselines(recipe: Recipe, description: RobotDescription, masses: tuple[float, float]) -> list[Method]:
    """Return what `evaluate` compares a shaper with; fixed ones are designed for the workspace and these payloads.

    Args:
        recipe: Source of the estimates.
        description: The robot.
        masses: Smallest and largest payload [kg].
    """
    known = recipe.calibration
    several = known is not None and known.modal is not None
    return [made(row, recipe, description, masses) for row in rows("baselines") if several or row.modes == 1]


def bench(
    description: RobotDescription,
    calibration: Calibration,
    mine: str | OwnShaper | None = None,
    against: Sequence[str] | None = None,
) -> list[Method]:
    """Return the methods of ShaperBench; the first is waiting, which all others are compared with.

    Args:
        description: The robot.
        calibration: Calibration with a modal model, the source of all estimates.
        mine: The user's own shaper: path of a file with a class that has `step`, or a loaded shaper.
        against: Names of the methods to run; None for all of the menu.

    Raises:
        KeyError: There is no method of that name.
    """
    recipe, waiting = Recipe("zv", calibration), Named(Recipe(UNSHAPED, calibration), UNSHAPED, Waiting.label)
    chosen = [name for name in (names("bench") if against is None else against) if name != UNSHAPED]
    every: list[Method] = [waiting, *some(chosen, description, calibration)]
    if isinstance(mine, OwnShaper):
        every.append(Named(Recipe(mine.name, calibration, own=(mine,)), mine.name, mine.place))
    elif mine is not None:
        every.append(FromFile(mine, recipe, _called(Path(mine), [one.name for one in every]), mine))
    return every


def _called(file: Path, taken: list[str]) -> str:
    """Name of the user's shaper in tables and figures: its file's, unless another one has that."""
    return f"{file.stem}.py" if file.stem in taken else file.stem
