"""Operators for numbers, vectors and matrices (lists and lists of lists), and access to elements of lists."""

import math
import operator
from collections.abc import Callable, Iterable
from functools import reduce
from itertools import repeat
from typing import Any, TypeAlias

from tvist_urscript.errors import Fault
from tvist_urscript.values import (
    HIGHEST,
    LISTS,
    LOWEST,
    NUMBERS,
    Array,
    Pose,
    Struct,
    Value,
    integer,
    kind,
    number,
    only_numbers,
    whole,
)

MOST_PRODUCTS = 2744  # largest number of multiplications in a product of matrices: two of 14 by 14

Number: TypeAlias = int | float
Work: TypeAlias = Callable[[int], None]  # charges for the number of elements about to be computed


def _with_overflow(of: Callable[[Any, Any], Number]) -> Callable[[Any, Any], Number]:
    def result(a: Number, b: Number) -> Number:
        c = of(a, b)
        return c if type(c) is float else whole(c)  # type: ignore[arg-type]

    return result


total, difference, _product = map(_with_overflow, (operator.add, operator.sub, operator.mul))


def quotient(a: Number, b: Number) -> Number:
    """Return a / b, which is a float."""
    if b == 0:
        raise Fault("division by zero")
    return a / b


def combine(of: Callable[[Any, Any], Value], a: Value, b: Value, done: str, work: Work) -> Value:
    """Apply a function to two numbers, two lists elementwise, or a number and each element of a list."""
    if type(a) is Array and type(b) is Array:
        return _elementwise(of, a, b, done, work)
    if type(a) in NUMBERS:
        if type(b) in NUMBERS:
            return of(a, b)
        if type(b) is Array:
            return _scaled(b, a, of, work, turned=True)  # type: ignore[arg-type]
    elif type(a) is Array and type(b) in NUMBERS:
        return _scaled(a, b, of, work)  # type: ignore[arg-type]
    if done == "divided":
        raise Fault(f"{kind(a)} cannot be divided by {kind(b)}")
    advice = ""
    if type(a) is Pose and type(b) is Pose:
        advice = ": use pose_add or pose_trans" if done == "added" else ": use pose_sub"
    elif type(a) is str or type(b) is str:
        advice = ": use str_cat"
    raise Fault(f"{kind(a)} and {kind(b)} cannot be {done}{advice}")


def _elementwise(of: Callable[[Any, Any], Value], a: Array, b: Array, done: str, work: Work) -> Array:
    if len(a.items) != len(b.items):
        raise Fault(f"lists of {len(a.items)} and {len(b.items)} elements cannot be {done}")
    work(len(a.items))
    if of in _PLAIN and of is not quotient and only_numbers(a) and only_numbers(b):
        return _whole(map(_PLAIN[of], a.items, b.items))
    return Array(
        of(x, y) if type(x) in NUMBERS and type(y) in NUMBERS else combine(of, x, y, done, work)
        for x, y in zip(a.items, b.items, strict=True)
    )


def multiply(a: Value, b: Value, work: Work) -> Value:
    """Return a * b of numbers, a number and a list, lists of equal length (elementwise), matrices and vectors."""
    if type(a) in NUMBERS:
        if type(b) in NUMBERS:
            return _product(a, b)
        if type(b) is Array:
            return _scaled(b, a, _product, work)  # type: ignore[arg-type]
    elif type(a) is Array:
        if type(b) in NUMBERS:
            return _scaled(a, b, _product, work)  # type: ignore[arg-type]
        if type(b) is Array:
            return _list_product(a, b, work)
    raise Fault(f"{kind(a)} and {kind(b)} cannot be multiplied")


def rest(a: Number, b: Number) -> Number:
    """Return a % b with the sign of a."""
    if b == 0:
        raise Fault("division by zero")
    if type(a) is int and type(b) is int:
        left = abs(a) % abs(b)
        return left if a >= 0 else -left
    return math.nan if math.isinf(a) else math.fmod(a, b)


def negate(a: Value, work: Work) -> Value:
    """Return -a of a number or, elementwise, of a list."""
    if type(a) is float:
        return -a
    if type(a) is int:
        return whole(-a)
    if type(a) is Array:
        return _scaled(a, -1, _product, work)
    raise Fault(f"{kind(a)} cannot be negated")


def _scaled(
    a: Array, by: Number, of: Callable[[Any, Any], Value], work: Work, *, turned: bool = False
) -> Array:
    """Compute `of(x, by)`, or `of(by, x)` if `turned`, for each element x of a list, also in nested lists."""
    work(len(a.items))
    if of in _PLAIN and only_numbers(a) and not (of is quotient and (turned or by == 0)):
        plain, numbers = _PLAIN[of], a.items
        return _whole(map(plain, repeat(by), numbers) if turned else map(plain, numbers, repeat(by)))
    return Array(
        (of(by, x) if turned else of(x, by))
        if type(x) in NUMBERS
        else _scaled(x, by, of, work, turned=turned)
        if type(x) is Array
        else of(number(x, "an element of the list"), by)
        for x in a.items
    )


def _list_product(a: Array, b: Array, work: Work) -> Value:
    rows, columns = matrix(a), matrix(b)
    if rows is None and columns is None:
        return _elementwise(_product, a, b, "multiplied", work)
    left = rows if rows is not None else [_numbers(a)]
    right = columns if columns is not None else [[x] for x in _numbers(b)]
    inner = len(left[0])
    if inner != len(right):
        raise Fault(
            f"a matrix of {len(left)} by {inner} cannot be multiplied with one of {len(right)} by {len(right[0])}"
        )
    if (products := len(left) * inner * len(right[0])) > MOST_PRODUCTS:
        raise Fault(f"these matrices need {products} multiplications: the limit is {MOST_PRODUCTS}")
    work(2 * products // 3)
    result = [[_dot(row, column) for column in zip(*right, strict=True)] for row in left]
    if rows is None:
        return Array(result[0])
    if columns is None:
        return Array(row[0] for row in result)
    return Array(Array(row) for row in result)


def _whole(values: Iterable[Any]) -> Array:
    return Array([x if type(x) is float or LOWEST <= x <= HIGHEST else float(x) for x in values])


def _dot(a: list[Number], b: tuple[Number, ...]) -> Number:
    # Not `sum`, which rounds differently in newer versions of Python.
    dot = reduce(operator.add, map(operator.mul, a, b))
    return whole(dot) if type(dot) is int else dot


def _numbers(a: Array) -> list[Number]:
    if not a.items:
        raise Fault("an empty list cannot be multiplied with a matrix")
    return [number(x, "an element of the list") for x in a.items]


def matrix(a: Array) -> list[list[Number]] | None:
    """Return the rows of a matrix (a list of lists of numbers); None for a list without lists."""
    if LISTS.isdisjoint(map(type, a.items)):
        return None
    rows: list[list[Number]] = []
    for row in a.items:
        if type(row) is not Array or not row.items or len(row.items) != len(rows[0] if rows else row.items):
            raise Fault("the rows of a matrix have to be lists of equal length")
        rows.append([number(x, "an element of a matrix") for x in row.items])
    return rows


_PLAIN: dict[Any, Callable[[Any, Any], Any]] = {
    total: operator.add, difference: operator.sub, _product: operator.mul, quotient: operator.truediv
}  # fmt: skip
"""Python's operator for each of these functions; integer results beyond 32 bits need the function itself."""


def element(value: Value, index: Any) -> Value:
    """Return value[index]."""
    items = _array(value).items
    if type(index) is int and 0 <= index < len(items):
        return items[index]
    return items[_place(index, value)]  # type: ignore[arg-type]


def element_of_matrix(value: Value, row: Any, column: Any) -> Value:
    """Return value[row, column]."""
    return element(element(value, row), column)


def member(value: Value, name: str) -> Value:
    """Return value.name."""
    return _struct(value).items[_named(name, value)]  # type: ignore[arg-type]


def replaced(new: Value, indices: tuple[Any, ...], value: Value, work: Work) -> Array:
    """Return a copy of a list with another value for the element at these indices.

    Copying four elements costs one evaluation.
    """
    step = indices[0]
    if type(step) is tuple:  # a member's name
        whole: Array = _struct(value)
        place = _named(step[0], whole)  # type: ignore[arg-type]
    else:
        whole = _array(value)
        place = _place(step, whole)
    inner = new if len(indices) == 1 else replaced(new, indices[1:], whole.items[place], work)
    work(len(whole.items) // 4)
    items = list(whole.items)
    if type(whole) is Pose:
        items[place] = number(inner, "an element of a pose")
        return Pose(items)
    items[place] = inner
    return Struct(whole.names, items) if type(whole) is Struct else Array(items)


def _array(value: Value) -> Array:
    if isinstance(value, Array):
        return value
    raise Fault(f"{kind(value)} has no elements")


def _struct(value: Value) -> Struct:
    if type(value) is Struct:
        return value
    raise Fault(f"{kind(value)} has no members")


def _named(name: str, value: Struct) -> int:
    try:
        return value.names.index(name)
    except ValueError:
        raise Fault(f"the struct has no member {name}: it has {', '.join(value.names)}"[:200]) from None


def _place(index: Any, value: Array) -> int:
    place = integer(index, "a list index")
    length = len(value.items)
    what = "pose" if type(value) is Pose else "struct" if type(value) is Struct else "list"
    has = f"the {what} has {length} element{'' if length == 1 else 's'}"
    if place < 0:
        raise Fault(f"list index {place} is negative: {has}")
    if place >= length:
        raise Fault(f"list index {place} is beyond the end: {has}")
    return place
