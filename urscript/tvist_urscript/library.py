"""The built-in functions of the language, which need no robot."""

from collections.abc import Callable, Mapping
from types import MappingProxyType, ModuleType
from typing import Any

from tvist_urscript import lists, numbers, poses, texts, values
from tvist_urscript.signatures import Signature, signature

_NAMES: dict[ModuleType, str] = {
    numbers: "acos asin atan atan2 ceil cos d2r floor log r2d sin sqrt tan",
    lists: "binary_list_to_integer get_list_length integer_to_binary_list inv length make_list norm normalize size "
    "transpose",
    poses: "interpolate_pose point_dist pose_add pose_dist pose_inv pose_sub pose_trans rotvec2rpy rpy2rotvec "
    "wrench_trans",
    texts: "str_at str_cat str_empty str_find str_len str_sub to_num",
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(module, name) for module, names in _NAMES.items() for name in names.split()},
    "assert": texts.check,
    "pow": numbers.power,
    "random": numbers.generator(),
    "to_str": values.to_str,
}

WEIGHTS = {
    "binary_list_to_integer": 1, "inv": 9, "make_list": 0, "norm": 1, "normalize": 1, "size": 1, "str_cat": 3,
    "to_str": 3, "transpose": 1,
}  # fmt: skip
"""Cost per element of list arguments, for the functions whose cost depends on these."""

ANEW: Mapping[str, Callable[[], Callable[..., Any]]] = MappingProxyType({"random": numbers.generator})
"""Functions with a state, each with a factory that creates one function per program."""

PURE: Mapping[str, tuple[Signature, Callable[..., Any]]] = MappingProxyType(
    {name: (signature(function, linear=name in WEIGHTS), function) for name, function in _FUNCTIONS.items()}
)
"""Signature and function of each name; the machine adds these functions to the controller's."""
