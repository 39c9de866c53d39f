"""The Python client: asyncio here, and a blocking version in `tvist_client.blocking`."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tvist_client.arguments import make_payload
    from tvist_client.arm import Arm
    from tvist_client.errors import (
        AnswerTimeoutError,
        ArgumentError,
        ClientError,
        DeniedError,
        MisuseError,
        MotionStoppedError,
        NotConnectedError,
        ProtectiveStopError,
        StreamStoppedError,
        UnexpectedReplyError,
    )
    from tvist_client.feed import Stream
    from tvist_client.motion import Motion
    from tvist_client.robot import Robot, Stepper
    from tvist_client.servo import Servo
    from tvist_client.transports import InProcessRobot, LoopbackTransport, Transport, ZenohTransport
    from tvist_protocol.errors import ProtocolError, RefusedError, TvistError
    from tvist_protocol.info import Info
    from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment
    from tvist_protocol.stream import Event, State, Telemetry, Truth
    from tvist_protocol.values import Payload


__all__ = [
    "AnswerTimeoutError", "ArcSegment", "ArgumentError", "Arm", "ClientError", "DeniedError", "Event",
    "InProcessRobot", "Info", "JointSegment", "LineSegment", "LoopbackTransport", "MisuseError", "Motion",
    "MotionStoppedError", "NotConnectedError", "Payload", "ProcessSegment", "ProtectiveStopError",
    "ProtocolError", "RefusedError", "Robot", "Servo", "State", "Stepper", "Stream", "StreamStoppedError",
    "Telemetry", "Transport", "Truth", "TvistError", "UnexpectedReplyError", "ZenohTransport", "make_payload",
]  # fmt: skip

_PLACES = {
    "AnswerTimeoutError": "tvist_client.errors",
    "ArcSegment": "tvist_protocol.motions",
    "ArgumentError": "tvist_client.errors",
    "Arm": "tvist_client.arm",
    "ClientError": "tvist_client.errors",
    "DeniedError": "tvist_client.errors",
    "Event": "tvist_protocol.stream",
    "InProcessRobot": "tvist_client.transports",
    "Info": "tvist_protocol.info",
    "JointSegment": "tvist_protocol.motions",
    "LineSegment": "tvist_protocol.motions",
    "LoopbackTransport": "tvist_client.transports",
    "MisuseError": "tvist_client.errors",
    "Motion": "tvist_client.motion",
    "MotionStoppedError": "tvist_client.errors",
    "NotConnectedError": "tvist_client.errors",
    "Payload": "tvist_protocol.values",
    "ProcessSegment": "tvist_protocol.motions",
    "ProtectiveStopError": "tvist_client.errors",
    "ProtocolError": "tvist_protocol.errors",
    "RefusedError": "tvist_protocol.errors",
    "Robot": "tvist_client.robot",
    "Servo": "tvist_client.servo",
    "State": "tvist_protocol.stream",
    "Stepper": "tvist_client.robot",
    "Stream": "tvist_client.feed",
    "StreamStoppedError": "tvist_client.errors",
    "Telemetry": "tvist_protocol.stream",
    "Transport": "tvist_client.transports",
    "Truth": "tvist_protocol.stream",
    "TvistError": "tvist_protocol.errors",
    "UnexpectedReplyError": "tvist_client.errors",
    "ZenohTransport": "tvist_client.transports",
    "make_payload": "tvist_client.arguments",
}
"""Module of each name, which is imported when the name is first used: a program pays only for what it uses."""


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(_PLACES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
