"""All methods of studies and the menus that show them; a library shaper without a row is in all shaper menus."""

from dataclasses import dataclass
from typing import Literal

from tvist_shaping.named import BUILT_IN

Menu = Literal["bench", "robustness", "baselines", "lesson"]
"""Where a method is a default: bench, robustness, baselines of moves, or the lessons in notebooks."""
Kind = Literal[
    "filter", "for target", "for payload", "for workspace", "held", "longer", "as long as", "jerk of a period",
    "shaped alone",
]  # fmt: skip
UNSHAPED = "none"  # name of waiting on the bench, where it passes through the same line as the others


@dataclass(frozen=True)
class MenuMethod:
    """A method."""

    name: str  # name in JSON and on the command line
    label: str  # name for display
    menus: tuple[Menu, ...] = ()
    kind: Kind = "filter"
    of: str = ""  # shaper from which it is made, or method whose duration it has; empty for its own name
    modes: int = 1  # number of modes; more than one needs a modal calibration


SHOWN: tuple[Menu, ...] = ("bench", "lesson")  # menus of a shaper without a row
ROWS = (
    MenuMethod("equal_duration_double_s", "longer double S", ("baselines",), "longer"),
    MenuMethod("double_s_of_one_period", "double S whose jerk lasts a period", ("baselines",), "jerk of a period"),
    MenuMethod("double_s_as_zv", "double S as long as zv", ("bench",), "as long as", "zv"),
    MenuMethod("double_s_as_auto", "double S as long as auto", ("bench",), "as long as", "auto"),
    MenuMethod("zv_frozen_at_end", "ZV for the end pose", ("baselines", "bench"), "for target", "zv"),
    MenuMethod(
        "zv_3_modes_frozen_at_end", "ZV of three modes for the end pose", ("baselines", "bench", "robustness"),
        "for target", "zv", 3,
    ),
    MenuMethod("mzv_for_payload", "fixed MZV for the declared payload", ("baselines", "bench"), "for payload", "mzv"),
    MenuMethod("ei_for_payload", "fixed EI for the declared payload", ("baselines", "bench"), "for payload", "ei"),
    MenuMethod(
        "ei3_for_payload", "fixed EI3 for the declared payload", ("baselines", "bench", "robustness"), "for payload",
        "ei3",
    ),
    MenuMethod("fixed_mzv", "fixed MZV", ("baselines", "bench"), "for workspace", "mzv"),
    MenuMethod("fixed_ei2", "fixed EI2", ("baselines", "bench"), "for workspace", "ei2"),
    MenuMethod("fixed_ei3", "fixed EI3", ("baselines", "bench"), "for workspace", "ei3"),
    MenuMethod("zv", "TVIST-ZV, lowest mode", ("bench", "robustness", "lesson")),
    MenuMethod("zv_3_modes", "TVIST-ZV, three modes", ("bench",), of="zv", modes=3),
    MenuMethod("mzv", "TVIST-MZV, lowest mode", ("lesson",)),
    MenuMethod("zvd", "TVIST-ZVD, lowest mode", ("bench", "lesson")),
    MenuMethod("ei", "TVIST-EI, lowest mode", ("bench", "lesson")),
    MenuMethod("ei2", "TVIST-EI2, lowest mode", ("lesson",)),
    MenuMethod("ei3", "TVIST-EI3, lowest mode", ("lesson",)),
    MenuMethod("auto", "constant mean delay, auto", ("bench", "robustness")),
    MenuMethod("auto-target", "ZV of three modes for the end of each move", ("bench", "robustness")),
    MenuMethod("short", "constant mean delay, short", ("bench",)),
    MenuMethod("smoothing", "smoothing of elastic alone", ("bench", "robustness"), "shaped alone", "elastic"),
    MenuMethod("elastic", "smoothing, elastic feed-forward", ("bench", "robustness")),
    MenuMethod("elastic-16", "smoothing of 16 ms, elastic feed-forward", ("bench", "robustness")),
    MenuMethod("elastic-position", "smoothing, elastic feed-forward without torques", ("bench",)),
    MenuMethod("elastic-auto", "auto, smoothing, elastic feed-forward", ("bench", "robustness")),
    MenuMethod("product", "constant mean delay, product of three ZV", ("bench",), "held", modes=3),
    MenuMethod(UNSHAPED, "waiting, unshaped"),
    # Variants of the shapers above, which need no place in a menu.
    *(MenuMethod(name, f"TVIST-{name.upper()}, lowest mode")
      for name in ("um_zv", "um_zvd", "ei_exact", "si", "zvdd", "ei2_exact", "zvddd", "ei3_exact")),
)  # fmt: skip
"""All methods in the order of tables."""


def rows(menu: Menu | None = None) -> list[MenuMethod]:
    """Return the rows of a menu, or all; shapers without a row come last."""
    known = {row.name for row in ROWS}
    more = [
        MenuMethod(name, f"TVIST-{name.upper()}, lowest mode", SHOWN)
        for name in BUILT_IN.names()
        if name not in known
    ]
    return [row for row in (*ROWS, *more) if menu is None or menu in row.menus]


def row(name: str) -> MenuMethod:
    """Return a method's row; a filter name with a parameter, such as `elastic-20`, needs none of its own."""
    known = next((one for one in rows() if one.name == name), None)
    if known is None:
        BUILT_IN.check(name)
        known = MenuMethod(name, name)
    return known


def names(menu: Menu) -> tuple[str, ...]:
    """Return the names of the methods in a menu."""
    return tuple(row.name for row in rows(menu))
