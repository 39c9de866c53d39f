"""What can be wrong, one class a condition; each keeps its data as attributes beside a readable sentence.

ShapingError
├── ImpulseError          A and τ are no impulse train
├── ParameterError        a parameter is out of its range
│   ├── ShaperRangeError  f_d or ζ no shaper is defined for
│   ├── DesignError       a parameter of a shaper's design is wrong
│   └── EstimatorError    an estimator's parameter is wrong
├── UnknownShaperError    a name that is not in the catalogue
├── ShaperFailureError    a shaper's function fails, or breaks what its shaper declares
├── ConvergenceError      a design has no solution
├── DelayError            a delay the line does not hold
└── FilterError           shaper, estimator and delay line do not fit each other
"""

from collections.abc import Sequence


class ShapingError(ValueError):
    """Root of what this package raises on purpose."""


class ImpulseError(ShapingError):
    """Amplitudes and times that are no impulse train with unit sum."""


class ParameterError(ShapingError):
    """A parameter that is out of its range.

    Attributes:
        field: The parameter's name.
        value: What was given.
        limit: What is allowed, in words.
    """

    def __init__(self, field: str, value: object, limit: str) -> None:
        super().__init__(f"{field} is {value!r}, but must be {limit}")
        self.field = field
        self.value = value
        self.limit = limit


class ShaperRangeError(ParameterError):
    """A mode no shaper is defined for.

    Attributes:
        field: The parameter's name, `f_d` or `zeta`.
        value: What was given, f_d in [Hz], zeta in [-].
        limit: The range it leaves, in words.
    """


class UnknownShaperError(ShapingError):
    """A name that is not in the catalogue.

    Attributes:
        name: What was asked for.
        known: The names there are.
        nearest: The known name most like it, None where none is.
    """

    def __init__(self, name: str, known: Sequence[str], nearest: str | None) -> None:
        hint = f" (did you mean {nearest!r}?)" if nearest else ""
        super().__init__(f"no shaper is called {name!r}{hint}; there are {', '.join(known)}")
        self.name = name
        self.known = tuple(known)
        self.nearest = nearest


class DesignError(ParameterError):
    """A parameter of a shaper's design is wrong."""


class ShaperFailureError(ShapingError):
    """A shaper's function raises, gives no weights, or gives others than its shaper declares.

    Attributes:
        name: The shaper's name.
        why: What is wrong, and for which modes.
    """

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"shaper {name!r} {why}")
        self.name = name
        self.why = why


class ConvergenceError(ShapingError):
    """Equations that define a shaper and have no solution that was found."""


class DelayError(ShapingError):
    """A delay outside what the delay line holds.

    Attributes:
        delay: What was asked for [ticks].
        limit: The longest delay the line holds [ticks].
    """

    def __init__(self, delay: float, limit: float) -> None:
        super().__init__(f"delay is {delay!r} ticks, but this line holds 0 to {limit!r} ticks")
        self.delay = delay
        self.limit = limit


class EstimatorError(ParameterError):
    """A parameter of an estimator is wrong."""


class FilterError(ShapingError):
    """Shaper, estimator and delay line do not fit each other; the message says which and what to do.

    Attributes:
        field: What does not fit: `duration` [s], `zeta_max` [-], `period` [s], `max_delay` [s] or `joints`.
        value: What it is.
        limit: What it would have to be, in words.
    """

    def __init__(self, field: str, value: float, limit: str, advice: str = "") -> None:
        super().__init__(f"{field} is {value!r}, but must be {limit}{'; ' if advice else ''}{advice}")
        self.field = field
        self.value = value
        self.limit = limit
