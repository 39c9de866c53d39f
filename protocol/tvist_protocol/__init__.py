"""The contract between robot and clients: messages, codec, keys. No I/O, no clock, no numerical library."""

from tvist_protocol.codec import (
    MAX_BYTES,
    Message,
    check,
    decode,
    decode_command,
    decode_reply,
    encode,
    refusal,
)
from tvist_protocol.commands import (
    Command,
    Forget,
    HandOver,
    KeepAlive,
    MoveJ,
    Pause,
    PowerOff,
    PowerOn,
    ReleaseClock,
    ReleaseControl,
    RestartSafety,
    Resume,
    ServoStart,
    ServoStop,
    SetEstimator,
    SetPayload,
    Setpoint,
    SetShaper,
    SetSpeed,
    Stop,
    TakeClock,
    TakeControl,
    UnlockProtectiveStop,
)
from tvist_protocol.errors import ProtocolError, RefusedError, TvistError
from tvist_protocol.forces import EndForceMode, ForceMode, Freedrive, SetExternalWrench, ZeroFtsensor
from tvist_protocol.info import CalibrationInfo, Clock, Info, Limits, Stopping, StopReason
from tvist_protocol.io import Bank, Io, Registers, SetIo, SetRegisters, SetTcp, SimulationSetInputs
from tvist_protocol.kinematics import ForwardKinematics, InverseKinematics
from tvist_protocol.modes import RobotMode, RuntimeState, SafetyMode
from tvist_protocol.motions import (
    ArcSegment,
    JointSegment,
    LineSegment,
    MoveC,
    MoveL,
    MovePath,
    MoveTrajectory,
    ProcessSegment,
    Segment,
    ServoJ,
    SpeedJ,
    SpeedL,
    StopJ,
    StopL,
    TrajectoryPoint,
)
from tvist_protocol.programs import (
    Interpreter,
    ProgramClosePopup,
    ProgramInterpret,
    ProgramLabel,
    ProgramLoad,
    ProgramPause,
    ProgramPlay,
    ProgramRun,
    ProgramSkip,
    ProgramState,
    ProgramStop,
)
from tvist_protocol.replies import CODE_MEANINGS, Accepted, Code, Done, Posture, Refused, Reply, ToolPose
from tvist_protocol.simulation import SimulationInject, SimulationReset, SimulationStep, StepSetpoint
from tvist_protocol.stream import EVENT_MEANINGS, Event, EventKind, State, Telemetry, Truth
from tvist_protocol.values import PROTOCOL_VERSION, Payload

__all__ = [
    "CODE_MEANINGS", "EVENT_MEANINGS", "MAX_BYTES", "PROTOCOL_VERSION", "Accepted", "ArcSegment", "Bank",
    "CalibrationInfo", "Clock", "Code", "Command", "Done", "EndForceMode", "Event", "EventKind", "ForceMode",
    "Forget", "ForwardKinematics", "Freedrive", "HandOver", "Info", "Interpreter", "InverseKinematics", "Io",
    "JointSegment", "KeepAlive", "Limits", "LineSegment", "Message", "MoveC", "MoveJ", "MoveL", "MovePath",
    "MoveTrajectory", "Pause", "Payload", "Posture", "PowerOff", "PowerOn", "ProcessSegment", "ProgramClosePopup",
    "ProgramInterpret", "ProgramLabel", "ProgramLoad", "ProgramPause", "ProgramPlay", "ProgramRun", "ProgramSkip",
    "ProgramState", "ProgramStop", "ProtocolError", "Refused", "RefusedError", "Registers", "ReleaseClock",
    "ReleaseControl", "Reply", "RestartSafety", "Resume", "RobotMode", "RuntimeState", "SafetyMode", "Segment",
    "ServoJ", "ServoStart", "ServoStop", "SetEstimator", "SetExternalWrench", "SetIo", "SetPayload",
    "SetRegisters", "SetShaper", "SetSpeed", "SetTcp", "Setpoint", "SimulationInject", "SimulationReset",
    "SimulationSetInputs", "SimulationStep", "SpeedJ", "SpeedL", "State", "StepSetpoint", "Stop", "StopJ",
    "StopL", "StopReason", "Stopping", "TakeClock", "TakeControl", "Telemetry", "ToolPose", "TrajectoryPoint",
    "Truth", "TvistError", "UnlockProtectiveStop", "ZeroFtsensor", "check", "decode", "decode_command",
    "decode_reply", "encode", "refusal",
]  # fmt: skip
