"""Derives blocking classes from asynchronous ones: the caller's thread waits for each result."""

import inspect
from collections.abc import AsyncIterator, Iterator
from contextlib import AbstractAsyncContextManager, AbstractContextManager, contextmanager
from functools import cached_property
from inspect import get_annotations
from types import FunctionType, TracebackType
from typing import Any, Generic, Self, TypeVar, get_args, get_origin, get_type_hints

from tvist_client import feed
from tvist_client import robot as asynchronous
from tvist_client.command import Described
from tvist_client.portal import Portal
from tvist_client.robot import ENDPOINT, NAME
from tvist_client.transports.base import Transport
from tvist_client.transports.certificates import Folder
from tvist_protocol.schema import field_docs

M = TypeVar("M")


class BlockingMethod(Described):
    """A blocking method, with the arguments and the description of the asynchronous method that it wraps."""

    def __init__(self, of: Any) -> None:
        self._of = of

    def __call__(self, owner: "BlockingBase", *values: Any, **named: Any) -> Any:
        """Run the wrapped method on the loop, and wait for the result."""
        method, portal = getattr(owner._inner, self.__name__), owner._portal  # noqa: SLF001  its methods
        result = portal.call(lambda: method(*values, **named))
        return owner if result is owner._inner else _twin(portal, result)  # noqa: SLF001

    @cached_property
    def __signature__(self) -> inspect.Signature:
        found = inspect.signature(self._of)
        return found.replace(return_annotation=_result(found.return_annotation))

    def _description(self) -> str:
        return (inspect.getdoc(self._of) or "").replace("async with", "with")

    __doc__ = property(_description)


class Attribute:
    """An attribute or a property of an asynchronous class, for its blocking counterpart."""

    def __init__(self, of: type, name: str) -> None:
        self._name = name
        self._part = next(part for part in of.__mro__ if name in vars(part) | get_annotations(part))
        self._getter = getattr(vars(self._part).get(name), "fget", None)
        """None for an attribute that is only declared."""

    def __get__(self, owner: Any, kind: type | None = None) -> Any:
        return self if owner is None else getattr(owner._inner, self._name)  # noqa: SLF001  its attribute

    def __set__(self, owner: object, value: object) -> None:
        raise AttributeError(f"{self._name} is read-only")

    @property
    def kind(self) -> Any:
        """Type of the attribute."""
        if self._getter is not None:
            return get_type_hints(self._getter)["return"]
        return get_type_hints(self._part)[self._name]

    def _description(self) -> str:
        own = inspect.getdoc(self._getter) if self._getter is not None else None
        return own or field_docs(self._part)[self._name]

    __doc__ = property(_description)


_TWINS: dict[Any, Any] = {}  # blocking classes, by their asynchronous ones


class BlockingBase:
    """Base of the blocking classes."""

    def __init__(self, portal: Portal, inner: Any) -> None:
        self._portal, self._inner = portal, inner


def without_await(of: type, *internal: str, base: type[BlockingBase] = BlockingBase) -> Any:
    """Return the blocking counterpart of a class: its public members except those named in `internal`."""
    members: dict[str, Any] = {
        "__module__": "tvist_client.blocking",
        "__doc__": inspect.cleandoc(of.__doc__ or "").partition("\n\nArgs:")[0],
    }
    for name in dict.fromkeys(name for part in of.__mro__ for name in get_annotations(part) | vars(part)):
        if not (name.startswith("_") or name in internal or hasattr(base, name)):
            member = inspect.getattr_static(of, name, None)
            members[name] = BlockingMethod(member) if callable(member) else Attribute(of, name)
    twin = _TWINS[of] = type(of.__name__, (base,), members)
    return twin


class Stream(BlockingBase, Iterator[M], Generic[M]):
    """Messages as an iterator; see `tvist_client.Stream`."""

    @property
    def dropped(self) -> int:
        """Number of messages dropped because the reader was too slow."""
        dropped: int = self._inner.dropped
        return dropped

    def __next__(self) -> M:
        try:
            message: M = self._portal.call(self._inner.__anext__)
        except StopAsyncIteration:
            raise StopIteration from None
        return message


_TWINS[feed.Stream] = Stream


class BlockingConnection(BlockingBase):
    """Opens and closes the connection to a robot."""

    @classmethod
    def connect(
        cls,
        endpoint: str = ENDPOINT,
        name: str = NAME,
        *,
        security: Folder | None = None,
        namespace: str = "",
    ) -> Self:
        """Connect over Zenoh and check that the robot answers; see `tvist_client.Robot.connect`."""
        portal = Portal()
        try:
            robot = portal.call(
                lambda: asynchronous.Robot.connect(endpoint, name, security=security, namespace=namespace)
            )
        except BaseException:
            portal.close()
            raise
        return cls(portal, robot)

    @classmethod
    def over(cls, transport: Transport) -> Self:
        """Use a robot over a transport that is not yet bound to an event loop, such as the loopback's."""
        portal = Portal()
        return cls(portal, portal.call(lambda: asynchronous.Robot.over(transport)))

    def close(self) -> None:
        """Close the connection and end the loop's thread; a second call does nothing."""
        if not self._portal.closed:
            try:
                self._portal.call(self._inner.close)
            finally:
                self._portal.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _result(kind: Any) -> Any:
    origin, parts = get_origin(kind), get_args(kind)
    if origin is AsyncIterator:
        return AbstractContextManager[_result(parts[0])]  # type: ignore[misc]
    return _TWINS[origin][parts] if origin in _TWINS else _TWINS.get(kind, kind)


def _twin(portal: Portal, result: Any) -> Any:
    """Return a result's blocking counterpart."""
    if (twin := _TWINS.get(type(result))) is not None:
        return twin(portal, result)
    if isinstance(result, AbstractAsyncContextManager):
        return _entered(portal, result)
    if isinstance(result, FunctionType):  # a function that ends a subscription
        return lambda: portal.call(result)
    return result


@contextmanager
def _entered(portal: Portal, context: AbstractAsyncContextManager[Any]) -> Iterator[Any]:
    with portal.enter(context) as value:
        yield _twin(portal, value)
