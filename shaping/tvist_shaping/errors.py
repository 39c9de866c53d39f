"""Errors, one class for each condition; each has its data as attributes and a readable message.

ShapingError
├── ImpulseError          A and τ are not an impulse train
├── ParameterError        a parameter is out of its range
│   ├── ShaperRangeError  f_d or ζ is outside the range of a shaper
│   ├── DesignError       a parameter of a shaper's design is invalid
│   ├── EstimatorError    an estimator's parameter is invalid
│   └── FilterError       shaper, estimator and delay line do not fit together
├── UnknownShaperError    a name is not in the catalogue
├── ShaperFailureError    a shaper's function fails, or violates its shaper's declaration
├── ConvergenceError      a design has no solution
└── DelayError            a delay exceeds the delay line
"""

import math
from collections.abc import Sequence


class ShapingError(ValueError):
    """Base class of all errors that this package raises deliberately."""


class ImpulseError(ShapingError):
    """Amplitudes and times are not an impulse train with unit sum."""


class ParameterError(ShapingError):
    """A parameter is out of its range.

    Attributes:
        field: Name of the parameter.
        value: Given value.
        limit: Permitted range, in words.
    """

    def __init__(self, field: str, value: object, limit: str, advice: str = "") -> None:
        super().__init__(f"{field} is {value!r}: must be {limit}{'; ' if advice else ''}{advice}")
        self.field = field
        self.value = value
        self.limit = limit


def check_positive(error: type[ParameterError], unit: str = "", **values: float) -> None:
    """Raise an error for the first value that is not finite and above 0."""
    for field, value in values.items():
        if not 0.0 < value < math.inf:
            raise error(field, value, f"a finite number{unit and f' of {unit}'} above 0")


class ShaperRangeError(ParameterError):
    """A mode is outside the range of a shaper: `field` is `f_d` [Hz] or `zeta` [-]; see `ParameterError`."""


class UnknownShaperError(ShapingError):
    """A name is not in the catalogue.

    Attributes:
        name: Given name.
        known: Available names.
        nearest: The most similar available name; None if none is similar.
    """

    def __init__(self, name: str, known: Sequence[str], nearest: str | None) -> None:
        hint = f" (did you mean {nearest!r}?)" if nearest else ""
        super().__init__(f"no shaper is called {name!r}{hint}; there are {', '.join(known)}")
        self.name = name
        self.known = tuple(known)
        self.nearest = nearest


class DesignError(ParameterError):
    """A parameter of a shaper's design is invalid."""


class ShaperFailureError(ShapingError):
    """A shaper's function raises an exception, returns no weights, or returns weights that violate the declaration.

    Attributes:
        name: Name of the shaper.
        why: What is wrong, and for which modes.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"shaper {name!r} {why}")
        self.name = name
        self.why = why


class ConvergenceError(ShapingError):
    """No solution was found for the equations that define a shaper."""


class DelayError(ShapingError):
    """A delay exceeds the delay line.

    Attributes:
        delay: Given delay [ticks].
        limit: Longest delay of the line [ticks].
    """

    def __init__(self, delay: float, limit: float) -> None:
        super().__init__(
            f"delay is {delay!r} ticks: must be 0 to {limit!r} ticks, which the delay line holds"
        )
        self.delay = delay
        self.limit = limit


class EstimatorError(ParameterError):
    """A parameter of an estimator is invalid."""


class FilterError(ParameterError):
    """Shaper, estimator and delay line do not fit together; the message says what to change.

    `field` is the value that does not fit: `duration` [s], `zeta_max` [-], `period` [s], `max_delay` [s] or `joints`.
    """
