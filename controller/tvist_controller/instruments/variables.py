"""Types of the values, by RTDE's words for them: a property that returns one of these is an output variable of RTDE."""

from collections.abc import Callable
from typing import Annotated, Any, Generic, Self, TypeAlias, TypeVar, get_origin, overload

T = TypeVar("T")

Double: TypeAlias = Annotated[float, "DOUBLE"]
Vector3D: TypeAlias = Annotated[list[float], "VECTOR3D"]
Vector6D: TypeAlias = Annotated[list[float], "VECTOR6D"]
Vector6Int32: TypeAlias = Annotated[list[int], "VECTOR6INT32"]
Int32: TypeAlias = Annotated[int, "INT32"]
Uint8: TypeAlias = Annotated[int, "UINT8"]
Uint32: TypeAlias = Annotated[int, "UINT32"]
Uint64: TypeAlias = Annotated[int, "UINT64"]


def variables(*values: type) -> dict[str, str]:
    """Return RTDE's word for the type of each output variable, by name, in the order of classes and their properties.

    Args:
        values: The classes whose own properties are looked at.
    """
    found: dict[str, str] = {}
    for name, value in (item for each in values for item in vars(each).items()):
        read = getattr(value, "fget", None) or getattr(value, "func", None)  # of a property, or a cached one
        returned: Any = getattr(read, "__annotations__", {}).get("return")
        if get_origin(returned) is Annotated:
            found[name] = returned.__metadata__[0]
    return found


class computed_once(Generic[T]):  # noqa: N801  it stands for a property
    """A property that is computed when it is first read; `cached_property` of Python 3.11 takes a lock as well."""

    def __init__(self, func: Callable[[Any], T]) -> None:
        self.func, self.__doc__ = func, func.__doc__

    @overload
    def __get__(self, of: None, owner: type) -> Self: ...
    @overload
    def __get__(self, of: object, owner: type) -> T: ...
    def __get__(self, of: object | None, owner: type) -> Self | T:
        if of is None:
            return self
        value = of.__dict__[self.func.__name__] = self.func(of)
        return value
