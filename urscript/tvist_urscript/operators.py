"""The operators that compiled code calls, by the names that it has for them."""

from collections.abc import Callable, Mapping
from typing import Any

from tvist_urscript import arithmetic, indexing
from tvist_urscript.arithmetic import Work
from tvist_urscript.values import Array, Pose, Struct


def operators(work: Work) -> Mapping[str, Callable[..., Any]]:
    """Return the operators of a machine, which tell it how many elements of lists they work on.

    Two floats, the most frequent case, take the shortest way.
    """

    def add(a: Any, b: Any) -> Any:
        if type(a) is float and type(b) is float:
            return a + b
        return arithmetic.add(a, b, work)

    def subtract(a: Any, b: Any) -> Any:
        if type(a) is float and type(b) is float:
            return a - b
        return arithmetic.subtract(a, b, work)

    def multiply(a: Any, b: Any) -> Any:
        if type(a) is float and type(b) is float:
            return a * b
        return arithmetic.multiply(a, b, work)

    def is_equal(a: Any, b: Any) -> bool:
        if isinstance(a, Array):
            work(a.size // 3)
        return bool(a == b)

    return {
        "add": add,
        "subtract": subtract,
        "multiply": multiply,
        "divide": lambda a, b: arithmetic.divide(a, b, work),
        "remainder": lambda a, b: arithmetic.remainder(a, b, work),
        "negate": lambda a: arithmetic.negate(a, work),
        "is_equal": is_equal,
        "is_unequal": lambda a, b: not is_equal(a, b),
        "element": indexing.element,
        "member": indexing.member,
        "element_of_matrix": indexing.element_of_matrix,
        "replaced": lambda new, indices, value: indexing.replaced(new, indices, value, work),
        "listed": Array,
        "structured": Struct,
        "arranged": lambda order, values: [values[place] for place in order],
        "posed": Pose,
    }
