"""The functions of the language that need no robot."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from tvist_urscript import lists, numbers, poses, texts, values
from tvist_urscript.signatures import Signature, signature

_TABLE: list[tuple[str, str, Callable[..., Any]]] = [
    ("acos", "f", numbers.acos),
    ("asin", "f", numbers.asin),
    ("assert", "condition", texts.check),
    ("atan", "f", numbers.atan),
    ("atan2", "x, y", numbers.atan2),
    ("binary_list_to_integer", "l", lists.binary_list_to_integer),
    ("ceil", "f", numbers.ceil),
    ("cos", "f", numbers.cos),
    ("d2r", "d", numbers.d2r),
    ("floor", "f", numbers.floor),
    ("get_list_length", "v", lists.get_list_length),
    ("integer_to_binary_list", "x", lists.integer_to_binary_list),
    ("interpolate_pose", "p_from, p_to, alpha", poses.interpolate_pose),
    ("inv", "m", lists.inv),
    ("length", "v", lists.length),
    ("log", "b, f", numbers.log),
    ("make_list", "length, initial_value", lists.make_list),
    ("norm", "a", lists.norm),
    ("normalize", "v", lists.normalize),
    ("point_dist", "p_from, p_to", poses.point_dist),
    ("pose_add", "p_1, p_2", poses.pose_add),
    ("pose_dist", "p_from, p_to", poses.pose_dist),
    ("pose_inv", "p_from", poses.pose_inv),
    ("pose_sub", "p_to, p_from", poses.pose_sub),
    ("pose_trans", "p_from, p_from_to", poses.pose_trans),
    ("pow", "base, exponent", numbers.power),
    ("r2d", "r", numbers.r2d),
    ("rotvec2rpy", "rotation_vector", poses.rotvec2rpy),
    ("rpy2rotvec", "rpy_vector", poses.rpy2rotvec),
    ("sin", "f", numbers.sin),
    ("size", "v", lists.size),
    ("sqrt", "f", numbers.sqrt),
    ("str_at", "src, index", texts.str_at),
    ("str_cat", "op1, op2", texts.str_cat),
    ("str_empty", "str", texts.str_empty),
    ("str_find", "src, target, start_from=0", texts.str_find),
    ("str_len", "str", texts.str_len),
    ("str_sub", "src, index, len=-1", texts.str_sub),
    ("tan", "f", numbers.tan),
    ("to_num", "str", texts.to_num),
    ("to_str", "val", values.to_str),
    ("transpose", "m", lists.transpose),
    ("wrench_trans", "T_from_to, w_from", poses.wrench_trans),
]

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
"""Functions that take the elements of the lists they are given from the budget, and how often each counts."""
_COSTS = {
    "inv": 80,
    "integer_to_binary_list": 20,
    "interpolate_pose": 40,
    "point_dist": 5,
    "pose_add": 30,
    "pose_dist": 5,
    "pose_inv": 25,
    "pose_sub": 30,
    "pose_trans": 30,
    "rotvec2rpy": 20,
    "rpy2rotvec": 20,
    "str_cat": 10,
    "to_str": 10,
    "wrench_trans": 30,
}
"""Evaluations of functions that take many times as long as an operator: each in proportion to its time."""

PURE: Mapping[str, tuple[Signature, Callable[..., Any]]] = MappingProxyType(
    {
        name: (signature(text, cost=_COSTS.get(name, 1), linear=name in WEIGHTS), function)
        for name, text, function in _TABLE
    }
)
"""Each with its signature. The machine adds them to the functions of the controller."""
