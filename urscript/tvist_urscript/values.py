"""The values of a script: Python's own numbers, booleans, strings and None; lists and poses as immutable arrays.

Since no value can change, assignments and arguments are by value without a copy; an assignment to an element
gives the variable a new list.
"""

from collections.abc import Iterable, Iterator
from typing import Any, TypeAlias, TypeVar

from tvist_urscript.costs import costs
from tvist_urscript.errors import Fault

LONGEST = 1000
"""Most elements of a list."""
LARGEST = 4000  # most elements of a list, including those of nested lists
DEEPEST = 20  # most levels of nested lists
LONGEST_TEXT = 1023  # longest string, in bytes of UTF-8
LOWEST, HIGHEST = -(2**31), 2**31 - 1
"""Range of integers, which have 32 bits; a result outside it is a float."""


class Array:
    """A list.

    Attributes:
        items: Its elements.
        size: Number of its elements, including those of nested lists.
        depth: Levels of nesting, 1 for a list without lists.

    Raises:
        Fault: It has more than LONGEST elements, more than LARGEST with nested ones, or more than DEEPEST
            levels.
    """

    __slots__ = ("depth", "items", "size")
    depth: int
    items: tuple["Value", ...]
    size: int

    def __init__(self, items: Iterable["Value"]) -> None:
        self.items = tuple(items)
        size = len(self.items)
        depth = 0
        if size > LONGEST:
            raise Fault(f"a list of {size} elements is too long: the limit is {LONGEST}")
        if not LISTS.isdisjoint(map(type, self.items)):
            for item in self.items:
                if isinstance(item, Array):
                    size += item.size
                    depth = max(depth, item.depth)
        check_size(size)
        if depth >= DEEPEST:
            raise Fault(f"lists are nested too deep: the limit is {DEEPEST}")
        self.size = size
        self.depth = depth + 1

    def __len__(self) -> int:
        return len(self.items)

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator["Value"]:
        return iter(self.items)

    def __getitem__(self, index: int) -> "Value":
        return self.items[index]

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self.items == other.items

    def __hash__(self) -> int:
        return hash(self.items)

    def __repr__(self) -> str:
        return to_str(self)


class Pose(Array):
    """A position [m] and a rotation vector [rad].

    Raises:
        Fault: It does not consist of six numbers.
    """

    __slots__ = ()

    def __init__(self, items: Iterable["Value"]) -> None:
        items = tuple(items)
        if len(items) != 6:
            raise Fault(f"a pose consists of 6 numbers, not of {len(items)}")
        super().__init__(float(number(item, "an element of a pose")) for item in items)

    @property
    def numbers(self) -> tuple[float, ...]:
        """Its elements: x, y, z [m] and the rotation vector [rad]."""
        return self.items  # type: ignore[return-value]


class Struct(Array):
    """Values with names, which can also be accessed by index.

    Attributes:
        names: Names of its elements.

    Raises:
        Fault: As for a list.
    """

    __slots__ = ("names",)
    names: tuple[str, ...]

    def __init__(self, names: tuple[str, ...], items: Iterable["Value"]) -> None:
        super().__init__(items)
        self.names = names

    def __eq__(self, other: object) -> bool:
        return type(other) is Struct and self.names == other.names and self.items == other.items

    def __hash__(self) -> int:
        return hash((self.names, self.items))


LISTS = frozenset((Array, Pose, Struct))
NUMBERS = frozenset((int, float))
T = TypeVar("T")
Value: TypeAlias = int | float | bool | str | Array | None

KINDS: dict[type, str] = {
    int: "an integer",
    float: "a float",
    bool: "a boolean",
    str: "a text",
    Array: "a list",
    Pose: "a pose",
    Struct: "a struct",
    type(None): "None",
}


def kind(value: object) -> str:
    """Name the type of a value, for messages."""
    return KINDS.get(type(value), "a value of the controller")


def number(value: Any, what: str) -> int | float:
    """Return the value if it is a number; raise Fault, which names `what`, otherwise."""
    if type(value) is float or type(value) is int:
        return value
    raise Fault(f"{what} has to be a number, not {kind(value)}")


def integer(value: Any, what: str) -> int:
    """Return an integer, or a whole float such as 3.0 (`/` gives floats) as an integer; else raise Fault."""
    if type(value) is int:
        return value
    if type(value) is float and value.is_integer() and LOWEST <= value <= HIGHEST:
        return int(value)
    if type(value) is float:
        raise Fault(f"{what} has to be an integer, not {to_str(value)}")
    raise Fault(f"{what} has to be an integer, not {kind(value)}")


def exactly(wanted: type[T], value: Any, what: str) -> T:
    """Return a value if its type is exactly `wanted` (a pose, for example, is no list); else raise Fault."""
    if type(value) is wanted:
        return value
    raise Fault(f"{what} has to be {KINDS[wanted]}, not {kind(value)}")


def vector(value: Any, what: str) -> tuple[float, ...]:
    """Return the elements of a list of numbers or of a pose; else raise Fault."""
    if not isinstance(value, Array):
        raise Fault(f"{what} has to be a list of numbers, not {kind(value)}")
    if only_numbers(value):
        return tuple(map(float, value.items))  # type: ignore[arg-type]
    return tuple(float(number(item, f"an element of {what}")) for item in value.items)


def check_size(size: int) -> None:
    """Raise Fault for too many elements, including those of nested lists."""
    if size > LARGEST:
        raise Fault(
            f"a list with {size} elements, those of its lists included, is too large: the limit is {LARGEST}"
        )


def only_numbers(value: Array) -> bool:
    """Return whether a list contains only numbers, which need no individual checks."""
    return NUMBERS.issuperset(map(type, value.items))


def whole(value: int) -> int | float:
    """Return an integer unchanged if it fits into 32 bits, else as a float."""
    return value if LOWEST <= value <= HIGHEST else float(value)


def short(value: str) -> str:
    """Return a string; raise Fault if it is too long."""
    size = len(value) if value.isascii() else len(to_bytes(value))
    if size > LONGEST_TEXT:
        raise Fault(f"a text of {size} bytes is too long: the limit is {LONGEST_TEXT}")
    return value


def to_bytes(value: str) -> bytes:
    """Encode a string as UTF-8; surrogates for bytes of incomplete characters become these bytes."""
    try:
        return value.encode(errors="surrogateescape")
    except UnicodeEncodeError:
        return value.encode(errors="replace")


def to_text(value: bytes) -> str:
    """Decode UTF-8; bytes of incomplete characters become surrogates."""
    return value.decode(errors="surrogateescape")


@costs(20)
def to_str(val: Value) -> str:
    """Format a value as the controller does: floats with up to six decimals, without trailing zeros.

    Raises:
        Fault: The string is too long.
    """
    return short(_written(val))


def _written(value: Value) -> str:
    if type(value) is str:
        return value
    if type(value) is float:
        written = f"{value:.6f}"
        if "." in written:
            written = written.rstrip("0").rstrip(".")
        return "0" if written == "-0" else written
    if isinstance(value, Array):
        parts: list[str] = []
        length = 0
        names = [f"{name}=" for name in value.names] if type(value) is Struct else [""] * len(value.items)
        for name, item in zip(names, value.items, strict=True):
            parts.append(name + _written(item))
            length += len(parts[-1]) + 2
            if length > LONGEST_TEXT + 8:
                raise Fault(f"a list is too long as a text: the limit is {LONGEST_TEXT} bytes")
        if type(value) is Struct:
            return f"struct({', '.join(parts)})"
        return f"{'p' if type(value) is Pose else ''}[{', '.join(parts)}]"
    return str(value)
