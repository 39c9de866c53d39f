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
    from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment, TrajectoryPoint
    from tvist_protocol.stream import Event, State, Telemetry, Truth
    from tvist_protocol.values import Payload


__all__ = [
    "AnswerTimeoutError", "ArcSegment", "ArgumentError", "Arm", "ClientError", "DeniedError", "Event",
    "InProcessRobot", "Info", "JointSegment", "LineSegment", "LoopbackTransport", "MisuseError", "Motion",
    "MotionStoppedError", "NotConnectedError", "Payload", "ProcessSegment", "ProtectiveStopError",
    "ProtocolError", "RefusedError", "Robot", "Servo", "State", "Stepper", "Stream", "StreamStoppedError",
    "Telemetry", "TrajectoryPoint", "Transport", "Truth", "TvistError", "UnexpectedReplyError", "ZenohTransport",
    "make_payload",
]  # fmt: skip

_NAMES = {
    "tvist_client.arguments": "make_payload",
    "tvist_client.arm": "Arm",
    "tvist_client.errors": "AnswerTimeoutError ArgumentError ClientError DeniedError MisuseError "
    "MotionStoppedError NotConnectedError ProtectiveStopError StreamStoppedError UnexpectedReplyError",
    "tvist_client.feed": "Stream",
    "tvist_client.motion": "Motion",
    "tvist_client.robot": "Robot Stepper",
    "tvist_client.servo": "Servo",
    "tvist_client.transports": "InProcessRobot LoopbackTransport Transport ZenohTransport",
    "tvist_protocol.errors": "ProtocolError RefusedError TvistError",
    "tvist_protocol.info": "Info",
    "tvist_protocol.motions": "ArcSegment JointSegment LineSegment ProcessSegment TrajectoryPoint",
    "tvist_protocol.stream": "Event State Telemetry Truth",
    "tvist_protocol.values": "Payload",
}
"""Names by module. A module is imported on first use of one of its names, so a program pays only for what it uses."""
_PLACES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> object:
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(_PLACES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
