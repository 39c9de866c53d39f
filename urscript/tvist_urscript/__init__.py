"""URScript, the language of UR robots: compiled to Python and run tick by tick, without robot, clock or thread."""

from importlib import import_module
from typing import TYPE_CHECKING

from tvist_urscript.costs import costs
from tvist_urscript.errors import Fault, ScriptError
from tvist_urscript.library import PURE
from tvist_urscript.machine import EVALUATIONS, Machine
from tvist_urscript.names import METHOD
from tvist_urscript.script import Script
from tvist_urscript.signatures import (
    REQUIRED,
    Parameter,
    Signature,
    Signatures,
    names,
    parameters,
    signature,
    signatures,
)
from tvist_urscript.values import LONGEST, Array, Pose, Struct, Value, to_str

__all__ = [
    "EVALUATIONS",
    "LONGEST",
    "METHOD",
    "PURE",
    "REQUIRED",
    "Array",
    "Fault",
    "Machine",
    "Parameter",
    "Pose",
    "Script",
    "ScriptError",
    "Signature",
    "Signatures",
    "Struct",
    "Value",
    "check",
    "compile_script",
    "costs",
    "names",
    "parameters",
    "signature",
    "signatures",
    "to_str",
]

if TYPE_CHECKING:
    from tvist_urscript.checker import check
    from tvist_urscript.compiler import compile_script

_PLACES = {"check": "tvist_urscript.checker", "compile_script": "tvist_urscript.compiler"}
"""Modules of names that are imported on first use, so that a robot starts without loading the compiler."""


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(_PLACES[name]), name)
    globals()[name] = value
    return value
