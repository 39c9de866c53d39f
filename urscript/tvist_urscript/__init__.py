"""URScript, the language of UR robots: compiled to Python and run tick by tick, without robot, clock or thread."""

from tvist_urscript.checker import check
from tvist_urscript.compiler import compile_script
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
