"""All methods of studies, and the sets in which each is used by default."""

from dataclasses import dataclass
from typing import Literal

from tvist_shaping.named import BUILT_IN

MethodSet = Literal["bench", "robustness", "baselines", "lesson"]
"""Where methods are used by default: bench, robustness, baselines of moves, or the lessons in notebooks."""
Kind = Literal[
    "filter", "for target", "for payload", "for workspace", "held", "longer", "as long as", "jerk of a period",
    "shaped alone",
]  # fmt: skip
UNSHAPED = "none"  # name of the unshaped motion on the bench, made by the same control line as all others


@dataclass(frozen=True)
class ListedMethod:
    """A method."""

    name: str  # name in JSON and on the command line
    label: str  # name for display
    sets: tuple[MethodSet, ...] = ()
    kind: Kind = "filter"
    of: str = ""  # name of its shaper, or of the method with the same duration; empty if equal to `name`
    modes: int = 1  # number of modes; more than one needs a modal calibration


UNLISTED: tuple[MethodSet, ...] = ("bench", "lesson")  # sets of library shapers that are not listed
METHODS = (
    ListedMethod("equal_duration_double_s", "longer double S", ("baselines",), "longer"),
    ListedMethod("double_s_of_one_period", "double S whose jerk lasts a period", ("baselines",), "jerk of a period"),
    ListedMethod("double_s_as_zv", "double S as long as zv", ("bench",), "as long as", "zv"),
    ListedMethod("double_s_as_auto", "double S as long as auto", ("bench",), "as long as", "auto"),
    ListedMethod("zv_frozen_at_end", "ZV for the end pose", ("baselines", "bench"), "for target", "zv"),
    ListedMethod(
        "zv_3_modes_frozen_at_end", "ZV of three modes for the end pose", ("baselines", "bench", "robustness"),
        "for target", "zv", 3,
    ),
    ListedMethod("mzv_for_payload", "fixed MZV for the declared payload", ("baselines", "bench"), "for payload", "mzv"),
    ListedMethod("ei_for_payload", "fixed EI for the declared payload", ("baselines", "bench"), "for payload", "ei"),
    ListedMethod(
        "ei3_for_payload", "fixed EI3 for the declared payload", ("baselines", "bench", "robustness"), "for payload",
        "ei3",
    ),
    ListedMethod("fixed_mzv", "fixed MZV", ("baselines", "bench"), "for workspace", "mzv"),
    ListedMethod("fixed_ei2", "fixed EI2", ("baselines", "bench"), "for workspace", "ei2"),
    ListedMethod("fixed_ei3", "fixed EI3", ("baselines", "bench"), "for workspace", "ei3"),
    ListedMethod("zv", "TVIST-ZV, lowest mode", ("bench", "robustness", "lesson")),
    ListedMethod("zv_3_modes", "TVIST-ZV, three modes", ("bench",), of="zv", modes=3),
    ListedMethod("mzv", "TVIST-MZV, lowest mode", ("lesson",)),
    ListedMethod("zvd", "TVIST-ZVD, lowest mode", ("bench", "lesson")),
    ListedMethod("ei", "TVIST-EI, lowest mode", ("bench", "lesson")),
    ListedMethod("ei2", "TVIST-EI2, lowest mode", ("lesson",)),
    ListedMethod("ei3", "TVIST-EI3, lowest mode", ("lesson",)),
    ListedMethod("auto", "constant mean delay, auto", ("bench", "robustness")),
    ListedMethod("auto-target", "ZV of three modes for the end of each move", ("bench", "robustness")),
    ListedMethod("short", "constant mean delay, short", ("bench",)),
    ListedMethod("smoothing", "smoothing of elastic alone", ("bench", "robustness"), "shaped alone", "elastic"),
    ListedMethod("elastic", "smoothing, elastic feed-forward", ("bench", "robustness")),
    ListedMethod("elastic-16", "smoothing of 16 ms, elastic feed-forward", ("bench", "robustness")),
    ListedMethod("elastic-position", "smoothing, elastic feed-forward without torques", ("bench",)),
    ListedMethod("elastic-auto", "auto, smoothing, elastic feed-forward", ("bench", "robustness")),
    ListedMethod("product", "constant mean delay, product of three ZV", ("bench",), "held", modes=3),
    ListedMethod(UNSHAPED, "waiting, unshaped"),
    # Variants of the shapers above; they are in no set.
    *(ListedMethod(name, f"TVIST-{name.upper()}, lowest mode")
      for name in ("um_zv", "um_zvd", "ei_exact", "si", "zvdd", "ei2_exact", "zvddd", "ei3_exact")),
)  # fmt: skip
"""All methods in the order of tables."""


def methods_in(wanted: MethodSet | None = None) -> list[ListedMethod]:
    """Return the methods of a set, or all; shapers of the library that are not listed come last."""
    listed = {one.name for one in METHODS}
    more = [
        ListedMethod(name, f"TVIST-{name.upper()}, lowest mode", UNLISTED)
        for name in BUILT_IN.names()
        if name not in listed
    ]
    return [one for one in (*METHODS, *more) if wanted is None or wanted in one.sets]


def listed_method(name: str) -> ListedMethod:
    """Return a method by its name; a filter with a parameter, such as `elastic-20`, need not be listed."""
    known = next((one for one in methods_in() if one.name == name), None)
    if known is None:
        BUILT_IN.check(name)
        known = ListedMethod(name, name)
    return known


def names(wanted: MethodSet) -> tuple[str, ...]:
    """Return the names of the methods in a set."""
    return tuple(one.name for one in methods_in(wanted))
