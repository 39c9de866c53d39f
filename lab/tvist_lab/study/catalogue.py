"""All methods of the studies, one row each, and the menus that show it.

A shaper of the shaping library needs no row: without one, it stands in all menus of shapers.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Literal

from tvist_controller.api.line import OwnShaper
from tvist_lab.study.foreign import FromFile
from tvist_lab.study.method import Constant, Held, Longer, Method, Named, PeriodOfJerk, Waiting
from tvist_lab.study.recipes import Recipe, longest_mean_delay, robust
from tvist_plant.description import RobotDescription
from tvist_protocol.calibration import Calibration
from tvist_shaping.named import BUILT_IN

Menu = Literal["bench", "baselines", "paths", "bound", "lesson"]
"""Where a method is made unless others are named: ShaperBench and robustness; `evaluate`, beside the shaper; `paths`;
the bound; and where the notebooks offer it.
"""
Kind = Literal[
    "filter", "for target", "for payload", "for workspace", "held", "longer", "as long as", "jerk of a period"
]
UNSHAPED = "none"
"""Name of waiting on the bench, where it goes through the same line as the others."""
MOST_DECLARED = 1.1
"""Largest declared mass of the bench, relative to the rating [-]."""


@dataclass(frozen=True)
class Row:
    """A method."""

    name: str
    """Name in JSON and on the command line."""
    label: str
    """Name for people."""
    menus: tuple[Menu, ...] = ()
    """Menus that show it."""
    kind: Kind = "filter"
    of: str = ""
    """The shaper that it is made of, or the method that it is as long as; empty if it is of its name."""
    modes: int = 1
    """Number of modes; more than one needs a modal calibration."""


SHOWN: tuple[Menu, ...] = ("bench", "paths", "lesson")
"""Menus of a shaper without a row."""
ROWS = (
    Row("equal_duration_double_s", "longer double S", ("baselines",), "longer"),
    Row("double_s_of_one_period", "double S whose jerk lasts a period", ("baselines",), "jerk of a period"),
    Row("double_s_as_zv", "double S as long as zv", ("bench",), "as long as", "zv"),
    Row("double_s_as_auto", "double S as long as auto", ("bench",), "as long as", "auto"),
    Row("zv_frozen_at_end", "ZV for the end pose", ("baselines", "bench"), "for target", "zv"),
    Row(
        "zv_3_modes_frozen_at_end", "ZV of three modes for the end pose", ("baselines", "bench"), "for target", "zv",
        3,
    ),
    Row("mzv_for_payload", "fixed MZV for the declared payload", ("baselines", "bench"), "for payload", "mzv"),
    Row("ei_for_payload", "fixed EI for the declared payload", ("baselines", "bench"), "for payload", "ei"),
    Row("ei3_for_payload", "fixed EI3 for the declared payload", ("baselines", "bench"), "for payload", "ei3"),
    Row("fixed_mzv", "fixed MZV", ("baselines", "bench"), "for workspace", "mzv"),
    Row("fixed_ei2", "fixed EI2", ("baselines", "bench"), "for workspace", "ei2"),
    Row("fixed_ei3", "fixed EI3", ("baselines", "bench"), "for workspace", "ei3"),
    Row("zv", "TVIST-ZV, lowest mode", ("bench", "paths", "bound", "lesson")),
    Row("zv_3_modes", "TVIST-ZV, three modes", ("bench",), of="zv", modes=3),
    Row("mzv", "TVIST-MZV, lowest mode", ("paths", "lesson")),
    Row("zvd", "TVIST-ZVD, lowest mode", ("bench", "paths", "lesson")),
    Row("ei", "TVIST-EI, lowest mode", ("bench", "paths", "lesson")),
    Row("ei2", "TVIST-EI2, lowest mode", ("lesson",)),
    Row("ei3", "TVIST-EI3, lowest mode", ("lesson",)),
    Row("auto", "constant mean delay, auto", ("bench", "paths", "bound")),
    Row("auto-target", "constant mean delay, given the end of each move", ("bench", "paths", "bound")),
    Row("short", "constant mean delay, short", ("bench", "paths")),
    Row("planned", "planned to leave no vibration", ("bound",)),
    Row("elastic", "smoothing, elastic feed-forward", ("bench",)),
    Row("elastic-position", "smoothing, elastic feed-forward without torques", ("bench",)),
    Row("elastic-auto", "auto, smoothing, elastic feed-forward", ("bench",)),
    Row("product", "constant mean delay, product of three ZV", ("bench",), "held", modes=3),
    Row(UNSHAPED, "waiting, unshaped"),
    # These are variants of the shapers above, which no menu needs beside them.
    *(Row(name, f"TVIST-{name.upper()}, lowest mode")
      for name in ("um_zv", "um_zvd", "ei_exact", "si", "zvdd", "ei2_exact", "zvddd", "ei3_exact")),
)  # fmt: skip
"""All methods, in the order in which tables have them."""


def rows(menu: Menu | None = None) -> list[Row]:
    """Return the rows of a menu, or all; those of shapers that have none come last."""
    known = {row.name for row in ROWS}
    more = [
        Row(name, f"TVIST-{name.upper()}, lowest mode", SHOWN)
        for name in BUILT_IN.names()
        if name not in known
    ]
    return [row for row in (*ROWS, *more) if menu is None or menu in row.menus]


def names(menu: Menu) -> tuple[str, ...]:
    """Return the names of a menu."""
    return tuple(row.name for row in rows(menu))


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
    """
    recipe, known = Recipe("zv", calibration), {row.name: row for row in rows()}
    for name in wanted:
        if name not in known:
            like = "".join(f", did you mean {near!r}?" for near in get_close_matches(name, known, 1))
            raise KeyError(f"there is no method {name!r}{like} There are {', '.join(known)}")
    return tuple(made(known[name], recipe, description) for name in wanted)


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
