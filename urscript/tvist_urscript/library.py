"""The built-in functions of the language, which need no robot."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from tvist_urscript import lists, numbers, poses, texts, values
from tvist_urscript.signatures import Signature, signature

_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "acos": numbers.acos,
    "asin": numbers.asin,
    "assert": texts.check,
    "atan": numbers.atan,
    "atan2": numbers.atan2,
    "binary_list_to_integer": lists.binary_list_to_integer,
    "ceil": numbers.ceil,
    "cos": numbers.cos,
    "d2r": numbers.d2r,
    "floor": numbers.floor,
    "get_list_length": lists.get_list_length,
    "integer_to_binary_list": lists.integer_to_binary_list,
    "interpolate_pose": poses.interpolate_pose,
    "inv": lists.inv,
    "length": lists.length,
    "log": numbers.log,
    "make_list": lists.make_list,
    "norm": lists.norm,
    "normalize": lists.normalize,
    "point_dist": poses.point_dist,
    "pose_add": poses.pose_add,
    "pose_dist": poses.pose_dist,
    "pose_inv": poses.pose_inv,
    "pose_sub": poses.pose_sub,
    "pose_trans": poses.pose_trans,
    "pow": numbers.power,
    "r2d": numbers.r2d,
    "random": numbers.generator(),
    "rotvec2rpy": poses.rotvec2rpy,
    "rpy2rotvec": poses.rpy2rotvec,
    "sin": numbers.sin,
    "size": lists.size,
    "sqrt": numbers.sqrt,
    "str_at": texts.str_at,
    "str_cat": texts.str_cat,
    "str_empty": texts.str_empty,
    "str_find": texts.str_find,
    "str_len": texts.str_len,
    "str_sub": texts.str_sub,
    "tan": numbers.tan,
    "to_num": texts.to_num,
    "to_str": values.to_str,
    "transpose": lists.transpose,
    "wrench_trans": poses.wrench_trans,
}

WEIGHTS = {
    "binary_list_to_integer": 1,
    "inv": 9,
    "make_list": 0,
    "norm": 1,
    "normalize": 1,
    "size": 1,
    "str_cat": 3,
    "to_str": 3,
    "transpose": 1,
}
"""Functions whose cost depends on their list arguments: cost per element."""

ANEW: Mapping[str, Callable[[], Callable[..., Any]]] = MappingProxyType({"random": numbers.generator})
"""Functions with state: factories that create one for each program."""

PURE: Mapping[str, tuple[Signature, Callable[..., Any]]] = MappingProxyType(
    {name: (signature(function, linear=name in WEIGHTS), function) for name, function in _FUNCTIONS.items()}
)
"""Each function with its signature; the machine adds them to the functions of the controller."""
