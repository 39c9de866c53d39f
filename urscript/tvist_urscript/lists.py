"""Built-in functions of lists, vectors and matrices."""

import math

from tvist_urscript.arithmetic import MOST_PRODUCTS, matrix
from tvist_urscript.costs import costs
from tvist_urscript.errors import Fault
from tvist_urscript.poses import pose_inv
from tvist_urscript.values import (
    LONGEST,
    Array,
    Pose,
    Value,
    check_size,
    exactly,
    integer,
    kind,
    to_bytes,
    vector,
)

_BITS = 32


def get_list_length(v: Value) -> int:
    """Return the number of elements of a list."""
    if isinstance(v, Array):
        return len(v.items)
    raise Fault(f"{kind(v)} has no length")


def length(v: Value) -> int:
    """Return the number of elements of a list, or of bytes of a text."""
    return len(to_bytes(v)) if type(v) is str else get_list_length(v)


def size(v: Value) -> Value:
    """Return the number of elements of a list, or the rows and columns of a matrix."""
    if type(v) is Array and (rows := matrix(v)) is not None:
        return Array((len(rows), len(rows[0])))
    return length(v)


def norm(a: Value) -> float:
    """Return the absolute value of a number, or the Euclidean length of a list of numbers."""
    if type(a) is int or type(a) is float:
        return abs(a)
    return math.hypot(*vector(a, "the argument of norm"))


def normalize(v: Value) -> Array:
    """Return a list of numbers divided by its Euclidean length."""
    numbers = vector(v, "the argument of normalize")
    whole = math.hypot(*numbers)
    if whole == 0:
        raise Fault("a vector of length 0 has no direction")
    return Array(x / whole for x in numbers)


@costs(20)
def integer_to_binary_list(x: Value) -> Array:
    """Return the 32 bits of an integer, the lowest first."""
    bits = integer(x, "the argument of integer_to_binary_list")
    return Array(bool(bits >> place & 1) for place in range(_BITS))


def binary_list_to_integer(l: Value) -> int:
    """Return the integer of at most 32 bits, the lowest first; 32 bits are a signed number."""
    bits = exactly(Array, l, "the argument of binary_list_to_integer").items
    if len(bits) > _BITS:
        raise Fault(f"an integer has at most {_BITS} bits, not {len(bits)}")
    result = sum(1 << place for place, bit in enumerate(bits) if bit)
    return result - (1 << _BITS) if result >= 1 << _BITS - 1 else result


def make_list(length: Value, initial_value: Value) -> Array:
    """Return a list of this many equal elements."""
    count = integer(length, "the length of make_list")
    if count < 0:
        raise Fault("a list cannot have a negative length")
    if count > LONGEST:
        raise Fault(f"a list of {count} elements is too long: the limit is {LONGEST}")
    check_size(count * (1 + initial_value.size if isinstance(initial_value, Array) else 1))
    return Array([initial_value] * count)


def transpose(m: Value) -> Array:
    """Return a matrix with its rows as columns."""
    rows = _matrix(m, "transpose")
    return Array(Array(column) for column in zip(*rows, strict=True))


@costs(80)
def inv(m: Value) -> Array:
    """Return the inverse of a pose or of a square matrix, by Gauss-Jordan elimination with pivoting."""
    if type(m) is Pose:
        return pose_inv(m)
    rows = _matrix(m, "inv")
    n = len(rows)
    if len(rows[0]) != n:
        raise Fault(f"a matrix of {n} by {len(rows[0])} has no inverse")
    if n**3 > MOST_PRODUCTS:
        raise Fault(f"a matrix of {n} by {n} is too large for inv")
    work, swaps = [list(map(float, row)) for row in rows], []
    for column in range(n):
        pivot = max(range(column, n), key=lambda i: abs(work[i][column]))
        if work[pivot][column] == 0:
            raise Fault("a singular matrix has no inverse")
        work[column], work[pivot] = work[pivot], work[column]
        swaps.append((column, pivot))
        divisor, work[column][column] = work[column][column], 1.0  # the inverse grows in place of the matrix
        top = work[column] = [x / divisor for x in work[column]]
        for i, row in enumerate(work):
            if i != column and (factor := row[column]) != 0:
                row[column] = 0.0
                work[i] = [x - factor * y for x, y in zip(row, top, strict=True)]
    for column, pivot in reversed(swaps):
        for row in work:
            row[column], row[pivot] = row[pivot], row[column]
    return Array(map(Array, work))


def _matrix(value: Value, name: str) -> list[list[int | float]]:
    rows = matrix(exactly(Array, value, f"the argument of {name}"))
    if rows is None:
        raise Fault(f"the argument of {name} has to be a matrix")
    return rows
