"""Create the methods of studies for an arm."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

from tvist_controller.api.line import OwnShaper
from tvist_lab.study.foreign import FromFile
from tvist_lab.study.method import (
    ConstantMeanDelay,
    ConstantModes,
    Method,
    Named,
    PeriodOfJerk,
    StretchedDoubleS,
)
from tvist_lab.study.method_list import METHODS, Kind, ListedMethod, listed_method, methods_in
from tvist_lab.study.recipes import Recipe, longest_mean_delay, robust
from tvist_lab.study.study import StudyError
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_shaping.errors import UnknownShaperError

MOST_DECLARED = 1.1  # largest declared mass of the bench, relative to the rating [-]


def build_method(
    row: ListedMethod,
    recipe: Recipe,
    description: RobotDescription,
    masses: tuple[float, float] | None = None,
) -> Method:
    """Create a method of the catalogue."""
    return _MAKERS[row.kind](row, recipe, description, masses or (0.0, description.limits.payload))


def _for_workspace(
    row: ListedMethod, recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> Method:
    f_d, zeta = robust(row.of, recipe, description, masses)
    return ConstantModes(recipe, row.name, row.label, row.of, f_d=f_d, zeta=zeta)


def _held(row: ListedMethod, recipe: Recipe, description: RobotDescription, _: tuple[float, float]) -> Method:
    # Use the longest mean delay over the workspace, for all declared masses.
    most = MOST_DECLARED * description.limits.payload
    delay = longest_mean_delay(recipe, description, (0.0, most), row.modes)
    return ConstantMeanDelay(recipe, delay, row.modes, row.name, row.label)


def _as_long_as(
    row: ListedMethod, recipe: Recipe, description: RobotDescription, masses: tuple[float, float]
) -> Method:
    like = next(one for one in METHODS if one.name == row.of)
    return StretchedDoubleS(row.name, row.label, build_method(like, recipe, description, masses))


_MAKERS: dict[Kind, Callable[[ListedMethod, Recipe, RobotDescription, tuple[float, float]], Method]] = {
    "filter": lambda row, recipe, *_: Named(
        replace(recipe, shaper=row.of or row.name, modes=max(row.modes, recipe.modes)), row.name, row.label
    ),
    "shaped alone": lambda row, recipe, *_: Named(
        replace(recipe, shaper=row.of), row.name, row.label, alone=True
    ),
    "for target": lambda row, recipe, *_: ConstantModes(recipe, row.name, row.label, row.of, row.modes),
    "for payload": lambda row, recipe, *_: ConstantModes(
        recipe, row.name, row.label, row.of, for_payload=True
    ),
    "for workspace": _for_workspace,
    "held": _held,
    "longer": lambda row, *_: StretchedDoubleS(row.name, row.label),
    "as long as": _as_long_as,
    "jerk of a period": lambda row, recipe, *_: PeriodOfJerk(recipe, row.name, row.label),
}


def some(
    wanted: Sequence[str | OwnShaper],
    description: RobotDescription,
    calibration: Calibration | None,
    masses: tuple[float, float] | None = None,
    modes: int = 1,
    frequency_error: float = 0.0,
) -> tuple[Method, ...]:
    """Return methods by name, or from files: paths with a class that has `step`, or loaded shapers.

    `calibration` provides the estimates; `masses` are the smallest and largest payload [kg], by default 0 and
    the rating; `modes` is the number of modes that shapers of the library suppress; `frequency_error` is the
    share by which every frequency is too high [-]. Raises StudyError for unknown names, DesignError for
    unknown parameters.
    """
    recipe = Recipe("zv", calibration, frequency_error, modes)
    found: dict[str, Method] = {}
    for one in wanted:
        if isinstance(one, OwnShaper):
            method: Method = Named(replace(recipe, shaper=one.name, own=(one,)), one.name, one.place)
        elif one.endswith(".py"):
            name = Path(one).stem
            known = {each.name for each in methods_in()} | found.keys()
            method = FromFile(one, recipe, f"{name}.py" if name in known else name, one)
        else:
            try:
                method = build_method(listed_method(one), recipe, description, masses)
            except UnknownShaperError as error:
                every = [each.name for each in methods_in()]
                like = "".join(f", did you mean {near!r}" for near in get_close_matches(error.name, every, 1))
                raise StudyError(
                    f"there is no method {error.name!r}{like}: there are {', '.join(every)}"
                ) from error
        found[method.name] = method
    return tuple(found.values())


def baselines(
    calibration: Calibration,
    description: RobotDescription,
    masses: tuple[float, float],
    frequency_error: float = 0.0,
) -> tuple[Method, ...]:
    """Return the baselines for a shaper; fixed ones are designed for the workspace and these payloads [kg]."""
    chosen = [one.name for one in methods_in("baselines") if calibration.modal is not None or one.modes == 1]
    return some(chosen, description, calibration, masses, frequency_error=frequency_error)
