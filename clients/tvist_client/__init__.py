"""The Python client: asyncio here, and a blocking version in `tvist_client.blocking`."""

from tvist_client.arm import Arm
from tvist_client.errors import (
    AnswerTimeoutError,
    ArgumentError,
    ClientError,
    MisuseError,
    MotionStoppedError,
    NotConnectedError,
    ProtectiveStopError,
    StreamStoppedError,
    UnexpectedReplyError,
)
from tvist_client.motion import Motion
from tvist_client.payload import make_payload
from tvist_client.robot import Robot
from tvist_client.servo import Servo
from tvist_client.stepper import Stepper
from tvist_client.stream import Stream
from tvist_client.transports import InProcessRobot, LoopbackTransport, Transport, ZenohTransport
from tvist_protocol.errors import ProtocolError, RefusedError, TvistError
from tvist_protocol.info import Info
from tvist_protocol.motions import ArcSegment, JointSegment, LineSegment, ProcessSegment
from tvist_protocol.stream import Event, State, Telemetry, Truth
from tvist_protocol.values import Payload

__all__ = [
    "AnswerTimeoutError",
    "ArcSegment",
    "ArgumentError",
    "Arm",
    "ClientError",
    "Event",
    "InProcessRobot",
    "Info",
    "JointSegment",
    "LineSegment",
    "LoopbackTransport",
    "MisuseError",
    "Motion",
    "MotionStoppedError",
    "NotConnectedError",
    "Payload",
    "ProcessSegment",
    "ProtectiveStopError",
    "ProtocolError",
    "RefusedError",
    "Robot",
    "Servo",
    "State",
    "Stepper",
    "Stream",
    "StreamStoppedError",
    "Telemetry",
    "Transport",
    "Truth",
    "TvistError",
    "UnexpectedReplyError",
    "ZenohTransport",
    "make_payload",
]
