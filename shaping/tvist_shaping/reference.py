"""`python -m tvist_shaping.reference`: docs/reference/shaping-library.md, made of this package's docstrings."""

import inspect
from pathlib import Path
from typing import Any

import tvist_shaping

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "shaping-library.md"
"""Path of the page in a checkout."""
HEAD = """# The shaping library

What `tvist_shaping` exports, made of its docstrings by `python -m tvist_shaping.reference`; a test compares. The
[README](../../shaping/README.md) says what it is for, with examples, and another page
[how to make a shaper of your own](../how-to/change-a-shaper.md). Everything that is not listed here may change without
notice.

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
    "SHAPERS": "The catalogue, shortest first: every `Shaper` that comes with the package, by its name.",
    "DESIGNS": "What makes each `Design` that goes by a name as a shaper does: `auto`, `short`, `auto-target`.",
    "BUILT_IN": "The `Registry` of what comes with the package alone.",
}
"""Exported values, which have no docstring at run time."""


def page() -> str:
    """The page."""
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
    """Whether a method is none that a user calls; a constructor that only says what its class says is not listed."""
    return member.startswith("_") and not (member == "__init__" and not issubclass(value, Exception))


def _doc(value: Any) -> str:
    own = value.__doc__ if inspect.isclass(value) or inspect.isfunction(value) else None
    return inspect.cleandoc(own) if own else ""


def _signature(value: Any) -> str:
    """Parameters with their defaults, without types: docstrings say these with shapes and units."""
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
