"""`python -m tvist_shaping.reference`: generates docs/reference/shaping-library.md from this package's docstrings."""

import inspect
from pathlib import Path
from typing import Any

import tvist_shaping

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "shaping-library.md"
"""Path of the page in a checkout."""
HEAD = """# The shaping library

For whoever calls `tvist_shaping`: everything that it exports; anything else may change without notice. The
[README](../../shaping/README.md) introduces the library with examples, and another page shows
[how to make a shaper of your own](../how-to/change-a-shaper.md). `python -m tvist_shaping.reference` makes this page.

"""
PARTS: dict[str, tuple[str, ...]] = {
    "Filters": ("make_filter", "Filter", "TvistFilter", "SteadyFilter", "AimedFilter", "Fade", "DelayLine"),
    "Where the modes come from": (
        "Estimator",
        "Fixed",
        "Polynomial",
        "terms",
        "FlexibleJoint",
        "flexible_joint",
        "Modal",
        "Drivetrain",
    ),
    "Shapers by name": ("SHAPERS", "shaper", "DESIGNS", "Registry", "BUILT_IN"),
    "Shapers of your own": (
        *("Shaper", "shaper_of", "custom", "FirShaper", "check_shaper", "mzv_of", "ei_of", "si_of"),
    ),
    "Designs of constant mean delay": ("Design", "ShortDesign", "FirDesign", "ProductDesign"),
    "Impulses": (
        *("Impulses", "product", "none", "um_zv", "zv", "mzv", "um_zvd", "zvd", "ei", "ei_exact", "zvdd"),
        *("ei2", "ei2_exact", "zvddd", "ei3", "ei3_exact"),
    ),
    "What is left of a vibration": ("residual", "band"),
    "Errors": (
        *(
            "ShapingError",
            "ImpulseError",
            "ParameterError",
            "ShaperRangeError",
            "DesignError",
            "EstimatorError",
        ),
        *("UnknownShaperError", "ShaperFailureError", "ConvergenceError", "DelayError", "FilterError"),
    ),
}
VALUES = {
    "SHAPERS": "The catalogue: every `Shaper` that comes with the package, by its name, shortest first.",
    "DESIGNS": "Constructors of designs with names: `auto`, `short`, `auto-target`, `elastic-auto`.",
    "BUILT_IN": "The `Registry` of the shapers and designs that come with the package.",
}
"""Exported values, with descriptions, since values have no docstrings at run time."""


def page() -> str:
    """Return the page."""
    return HEAD + "\n".join(_part(title, names) for title, names in PARTS.items())


def _part(title: str, names: tuple[str, ...]) -> str:
    return "\n".join([f"## {title}\n", *(_entry(name, getattr(tvist_shaping, name)) for name in names)])


def _entry(name: str, value: Any) -> str:
    if name in VALUES:
        return f"### `{name}`\n\n{VALUES[name]}\n"
    told = [f"{name}{_signature(value)}", "", _doc(value)]
    if inspect.isclass(value):
        for member, what in vars(value).items():
            function = what.fget if isinstance(what, property) else what
            if not inspect.isfunction(function) or not _doc(function) or _private(member, value):
                continue
            called = member if isinstance(what, property) else f"{member}{_signature(function)}"
            told += ["", called, *(f"    {line}".rstrip() for line in _doc(function).splitlines())]
    return "\n".join([f"### `{name}`\n", "```text", *told, "```\n"])


def _private(member: str, value: type) -> bool:
    """Return whether to omit a method: a private one, or a constructor that repeats its class's docstring."""
    return member.startswith("_") and not (member == "__init__" and not issubclass(value, Exception))


def _doc(value: Any) -> str:
    own = value.__doc__ if inspect.isclass(value) or inspect.isfunction(value) else None
    return inspect.cleandoc(own) if own else ""


def _signature(value: Any) -> str:
    """Format parameters with their defaults but without types, since docstrings give these with shapes and units."""
    if inspect.isclass(value) and issubclass(value, Exception):
        return ""
    parameters = [
        parameter.replace(annotation=inspect.Parameter.empty)
        for parameter in inspect.signature(value).parameters.values()
        if parameter.name != "self"
    ]
    return str(inspect.Signature(parameters))


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
