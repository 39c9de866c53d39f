"""Methods that send one command; arguments and descriptions come from the message's fields."""

import inspect
import re
from collections.abc import Awaitable, Callable, Coroutine
from functools import cached_property
from inspect import Parameter, Signature, cleandoc
from textwrap import fill
from types import CoroutineType, MethodType
from typing import Any, Protocol, cast, get_type_hints

from msgspec import Struct

from tvist_client.arguments import arguments, built
from tvist_client.errors import UnexpectedReplyError
from tvist_client.motion import Motion, MotionsByNumber
from tvist_client.values import positive
from tvist_protocol import Accepted, Command, Done, Posture, ToolPose
from tvist_protocol.channels import tag
from tvist_protocol.schema import field_docs

TICK = 0.002  # control period [s]
Answer = Accepted | Done | Posture | ToolPose  # replies to a command that was not refused
_ANSWER = re.compile(r"; (it is )?answered (as|by) [^.]*")
"""Part of a message's description that is about the answer; users get the method's result instead."""


class CommandSender(Protocol):
    """The methods of a robot that commands use."""

    motions: MotionsByNumber

    async def request(self, command: Command, timeout_s: float = ...) -> Answer:
        """Send a command."""
        ...

    async def pass_time(self, ticks: int) -> None:
        """Let ticks pass."""
        ...

    async def rest(self) -> object:
        """Wait until the arm is at rest."""
        ...


class Leased:
    """Control or the clock of a robot, a right that is proved by a token."""

    robot: CommandSender
    token: str
    """Token of the right, sent with every command."""


class Described:
    """An attribute that acts as a method; its docstring is built when `help` asks for it."""

    __name__: str

    def __set_name__(self, owner: type, name: str) -> None:
        self.__name__, self.__qualname__ = name, f"{owner.__qualname__}.{name}"
        self.__module__ = owner.__module__

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        return self if instance is None else MethodType(self, instance)  # type: ignore[arg-type]


class Sent(Described):
    """A method that sends one command; fields without a default are positional arguments."""

    def __init__(
        self,
        kind: type[Struct],
        carry_out: Callable[..., Awaitable[Any]],  # sends it; its other arguments become the method's
        positional: int | None = None,  # number of positional arguments
        returns: Any = None,  # type of the result, if `carry_out` does not annotate it
    ) -> None:
        self._kind, self._carry_out, self._positional, self._returns = kind, carry_out, positional, returns

    def __call__(self, owner: Any, *values: Any, **named: Any) -> Coroutine[Any, Any, Any]:
        """Return a coroutine to send the command; it has this method's name, which Python's warnings show."""
        try:
            given = self.__signature__.bind(owner, *values, **named).arguments
        except TypeError as error:
            raise TypeError(f"{self.__name__}(): {error}") from None
        sent = cast("CoroutineType[Any, Any, Any]", self._sent(owner, given))
        sent.__name__, sent.__qualname__ = self.__name__, self.__qualname__
        return sent

    async def _sent(self, owner: Any, given: dict[str, Any]) -> Any:
        of_message = {name: given[name] for name in arguments(self._kind) if name in given}
        extra = {name: given[name] for name in self._extra if name in given}
        known = {"token": owner.token} if "token" in self._kind.__struct_fields__ else {}
        return await self._carry_out(owner, built(self._kind, of_message, **known), **extra)

    @cached_property
    def _extra(self) -> dict[str, Parameter]:
        return dict(list(inspect.signature(self._carry_out).parameters.items())[2:])

    @cached_property
    def __signature__(self) -> Signature:
        taken = arguments(self._kind).values()
        required = sum(field.required for field, _ in taken)
        positional = required if self._positional is None else self._positional
        found = [Parameter("self", Parameter.POSITIONAL_OR_KEYWORD)]
        for place, (field, kind) in enumerate(taken):
            how = Parameter.POSITIONAL_OR_KEYWORD if place < positional else Parameter.KEYWORD_ONLY
            default = Parameter.empty if field.required else field.default
            found.append(Parameter(field.name, how, default=default, annotation=kind))
        returned = self._returns or inspect.signature(self._carry_out).return_annotation
        return Signature([*found, *self._extra.values()], return_annotation=returned)

    def _description(self) -> str:
        """Return a docstring composed of those of the message, its fields and `carry_out`, and the errors."""
        docs, taken, extra = field_docs(self._kind), arguments(self._kind), self._extra
        lines = [f"{name}: {docs[name]}" for name in taken] + [f"{name}: {_EXTRA[name]}" for name in extra]
        errors = ["RefusedError: The robot refused it, which changed nothing."]
        errors += (
            ["ArgumentError: An argument is invalid for every robot; nothing was sent."] if lines else []
        )
        errors += ["MotionStoppedError: The motion ended before its target."] if "wait" in extra else []
        text = _ANSWER.sub("", cleandoc(self._kind.__doc__ or ""))
        text += "" if self._carry_out.__doc__ is None else f"\n\n{self._carry_out.__doc__}"
        for title, listed in (("Args", lines), ("Raises", errors)):
            text += "".join([f"\n\n{title}:", *map(_filled, listed)]) if listed else ""
        return re.sub(r"\bnull\b", "None", text)

    __doc__ = property(_description)


def asking(kind: type[Struct], answer: type[Struct], positional: int | None = None) -> Sent:
    """Return a method that sends a question and returns the only field of the answer."""
    (name,) = answer.__struct_fields__

    async def ask(robot: CommandSender, command: Command) -> Any:
        reply = await robot.request(command)
        if not isinstance(reply, answer):
            raise UnexpectedReplyError(f"{tag(kind)} was answered by {reply}, without {name}")
        return getattr(reply, name)

    return Sent(kind, ask, positional, returns=get_type_hints(answer)[name])


_EXTRA = {
    "wait": "Whether to wait for the end; in lockstep and free, time is stepped until then.",
    "duration": "Time after which this returns [s]; None for at once. In lockstep and free, time is stepped.",
}
"""Descriptions of arguments that are not fields of the message."""


async def send(arm: Leased, command: Command) -> None:  # noqa: D103  help would show it for each command
    await arm.robot.request(command)


async def send_and_date(arm: Leased, command: Command) -> int | None:
    """The result is the tick at which it was carried out."""
    reply = await arm.robot.request(command)
    return reply.tick if isinstance(reply, Done) else None


async def come_to_rest(arm: Leased, command: Command) -> None:
    """This returns when the arm is at rest."""
    await arm.robot.request(command)
    await arm.robot.rest()


async def begin(arm: Leased, command: Command) -> Motion:
    """The result is the motion, which `end_force_mode`, a stop or the end of control ends."""
    reply = await arm.robot.request(command)
    if not isinstance(reply, Accepted) or reply.id is None:
        raise UnexpectedReplyError(
            f"{tag(type(command))} was answered by {reply}, without the id of a motion"
        )
    motion = arm.robot.motions.motion(reply.id)
    motion.limited = reply.limited
    return motion


async def move(arm: Leased, command: Command, *, wait: bool = True) -> Motion:
    """The result is the motion; its `started` and `done` are ticks once they are known."""
    motion = await begin(arm, command)
    return await motion.wait() if wait else motion


async def guide(arm: Leased, command: Command, *, duration: float | None = None) -> Motion:
    """The arm keeps its speed, also after `duration`; such commands share one motion until the arm rests."""
    seconds = None if duration is None else positive(duration, "duration")
    motion = await begin(arm, command)
    if seconds is not None:
        await arm.robot.pass_time(max(round(seconds / TICK), 1))
    return motion


def _filled(line: str) -> str:
    return "\n" + fill(line, 100, initial_indent=" " * 4, subsequent_indent=" " * 8)
