"""Built-in functions of numbers."""

import math
from collections.abc import Callable
from random import Random

from tvist_urscript.errors import Fault
from tvist_urscript.values import HIGHEST, LOWEST, Value, number


def _real(name: str, of: Callable[[float], float], where: str) -> Callable[[Value], float]:
    def function(f: Value) -> float:
        x = number(f, f"the argument of {name}")
        try:
            return of(x)
        except (ValueError, OverflowError):
            raise Fault(f"{name} takes {where}, not {x:g}") from None

    return function


sin = _real("sin", math.sin, "a finite angle")
cos = _real("cos", math.cos, "a finite angle")
tan = _real("tan", math.tan, "a finite angle")
asin = _real("asin", math.asin, "a number from -1 to 1")
acos = _real("acos", math.acos, "a number from -1 to 1")
atan = _real("atan", math.atan, "a number")
sqrt = _real("sqrt", math.sqrt, "a number that is not negative")


def d2r(d: Value) -> float:
    """Convert an angle from degrees to radians."""
    return math.radians(number(d, "the argument of d2r"))


def r2d(r: Value) -> float:
    """Convert an angle from radians to degrees."""
    return math.degrees(number(r, "the argument of r2d"))


def atan2(x: Value, y: Value) -> float:
    """Return the angle [rad] whose opposite side is the first argument and whose adjacent side is the second."""
    return math.atan2(number(x, "the first argument of atan2"), number(y, "the second argument of atan2"))


def power(base: Value, exponent: Value) -> float:
    """Return base to the power of exponent."""
    a, b = number(base, "the base of pow"), number(exponent, "the exponent of pow")
    try:
        return math.pow(a, b)
    except (ValueError, OverflowError):
        raise Fault(f"pow has no value for the base {a:g} and the exponent {b:g}") from None


def log(b: Value, f: Value) -> float:
    """Return the logarithm of f to the base b."""
    a, x = number(b, "the base of log"), number(f, "the second argument of log")
    try:
        return math.log(x) / math.log(a)
    except (ValueError, ZeroDivisionError):
        raise Fault(f"log has no value for the base {a:g} and the number {x:g}") from None


def _integer(name: str, of: Callable[[float], int]) -> Callable[[Value], int]:
    def function(f: Value) -> int:
        x = number(f, f"the argument of {name}")
        if LOWEST <= x <= HIGHEST:
            return of(x)
        raise Fault(f"{name} has no integer of 32 bits for {x:g}")

    return function


floor, ceil = _integer("floor", math.floor), _integer("ceil", math.ceil)


def generator() -> Callable[[], float]:
    """Return a new program's function `random`: numbers from 0 to below 1, the same sequence in each run."""
    dice = Random(0)  # noqa: S311  nothing secret
    return lambda: dice.random()  # noqa: PLW0108  its signature can be read
