"""Read recordings of this controller, and rosbag2 recordings in MCAP by their message types."""

import io
import re
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Message, Schema
from scipy.spatial.transform import Rotation

from tvist_lab.recordings import mcap_file
from tvist_lab.recordings.checks import ACCELEROMETER, GYROSCOPE, TIME, LogError
from tvist_lab.recordings.mcap_records import DAMAGE, MAGIC, records
from tvist_lab.recordings.recording import Floats, Recording
from tvist_lab.recordings.table import LogTable, reader
from tvist_protocol.errors import quoted

READ = {
    "sensor_msgs/msg/JointState": "JointState",
    "sensor_msgs/msg/Imu": "Imu",
    "control_msgs/msg/JointTrajectoryControllerState": "JointTrajectoryControllerState",
    "geometry_msgs/msg/PoseStamped": "PoseStamped",
}
"""Message types that are read, and their short names."""
ROWS = ("Imu", "JointState", "JointTrajectoryControllerState")  # types that can give the rows, the best first
ORDER = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""Joints of a UR robot from base to tool; ROS lists them in any order."""

Decoder = Callable[[bytes], Any]
MOST_JOINTS = 100  # largest accepted number of joints in a message; a robot with a gripper has some ten


@dataclass
class _Topic:
    """Messages of one topic as numbers."""

    kind: str
    decode: Decoder
    times: list[float] = field(default_factory=list)
    columns: dict[str, list[tuple[float, list[float]]]] = field(default_factory=dict)
    """Times and values of the messages that have each column."""
    joints: tuple[str, ...] = ()
    unstamped: int = 0

    def at(self, times: Floats) -> Iterator[tuple[str, Floats]]:
        """Yield each column at some times; NaN outside its own range."""
        for name, rows in sorted(self.columns.items()):
            if len(rows) == len(times) and self.times == times.tolist():
                yield name, np.array([values for _, values in rows])
                continue
            rows.sort(key=itemgetter(0))
            own, values = (np.array(part) for part in zip(*rows, strict=True))
            axes = [np.interp(times, own, axis, left=np.nan, right=np.nan) for axis in values.T]
            yield name, np.column_stack(axes)


@reader(".mcap", MAGIC)
def read_mcap(path: Path) -> Recording | LogTable:
    """Read a file, or the segments that a folder or pattern names."""
    try:
        content = mcap_file.read_checked(path)
    except mcap_file.RecordingFileError as error:
        if not path.is_file() or not has_ros(path):
            raise error from None
        return read_rosbag(path)
    recording = content.recording
    return recording if content.note is None else recording.noted(content.note.removeprefix(f"{path} "))


def read_rosbag(path: Path) -> LogTable:
    """Read a rosbag2 recording: `JointState`, `Imu`, `JointTrajectoryControllerState` and the TCP's `PoseStamped`."""
    # Of each type, the topic with the most messages is used. Times are from the headers; rows are those of
    # the accelerometer, with interpolated joint angles.
    topics, notes = _topics(path)
    chosen: dict[str, _Topic] = {}
    for name, topic in sorted(topics.items(), key=lambda item: -len(item[1].times)):
        if topic.times and topic.kind in chosen:
            notes.append(f"{name} has fewer messages than another topic of {topic.kind} and was not read")
        elif topic.times:
            chosen[topic.kind] = topic
            if topic.unstamped:
                notes.append(
                    f"{topic.unstamped} messages of {name} have no time in their header: the time of recording counts"
                )
    there = f"messages of {' and '.join(READ)} are read; it has {', '.join(sorted(topics)) or 'none of them'}"
    base = next((chosen[kind] for kind in ROWS if kind in chosen), None)
    if base is None:
        raise LogError(f"{path} cannot be measured: {there}")
    times = np.array(base.times)
    columns: dict[str, Floats] = {}
    for topic in chosen.values():
        for name, values in topic.at(times):
            columns.setdefault(name, values)
    names = [TIME, *(f"{name}_{at}" for name, values in columns.items() for at in range(values.shape[1]))]
    order = np.argsort(times, kind="stable")
    table = np.column_stack([times, *columns.values()])[order]
    places = order + np.float64(1.0)
    return LogTable(path, names, table, places, "message", notes=tuple(notes), rtde=True, there=there)


def has_ros(path: Path) -> bool:
    """Return whether an MCAP file contains ROS 2 messages of any type."""
    try:
        with path.open("rb") as stream:
            return any(
                isinstance(record, Channel) and record.message_encoding == "cdr" for record in records(stream)
            )
    except DAMAGE:
        return False


def _topics(path: Path) -> tuple[dict[str, _Topic], list[str]]:
    """Return messages by topic, and what is wrong with the file."""
    from mcap_ros2.decoder import DecoderFactory

    schemas: dict[int, Schema] = {}
    by_channel: dict[int, _Topic] = {}
    topics: dict[str, _Topic] = {}
    decoder_for = DecoderFactory().decoder_for
    try:
        with path.open("rb") as stream:
            for record in records(stream):
                match record:
                    case Schema():
                        schemas[record.id] = record
                    case Channel():
                        schema = schemas.get(record.schema_id)
                        if schema is not None and (kind := READ.get(schema.name)) is not None:
                            new = _Topic(kind, _decoder(path, decoder_for, record, schema))
                            by_channel[record.id] = topics.setdefault(record.topic, new)
                    case Message() if (topic := by_channel.get(record.channel_id)) is not None:
                        _take(path, topic, record)
    except LogError:
        raise
    except DAMAGE as error:
        why = f"{path} was not closed or is damaged ({type(error).__name__}); it was read up to there"
        return topics, [why]
    return topics, []


def _decoder(
    path: Path, decoder_for: Callable[[str, Schema], Decoder | None], channel: Channel, schema: Schema
) -> Decoder:
    try:
        with redirect_stderr(io.StringIO()):  # the parser also prints the errors that it raises
            decode = decoder_for(channel.message_encoding, schema)
    except Exception as error:
        raise LogError(f"{path}: the schema of {channel.topic} is damaged: {quoted(error)}") from error
    if decode is None:
        raise LogError(
            f"{path}: {channel.topic} is written as {channel.message_encoding} with a schema in {schema.encoding}: "
            "must be cdr with ros2msg"
        )
    return decode


def _take(path: Path, topic: _Topic, record: Message) -> None:
    try:
        message = topic.decode(record.data)
        stamp = message.header.stamp
        time = float(stamp.sec + 1e-9 * stamp.nanosec)
        row = _row(topic, message)
    except Exception as error:  # the schema is the file's own, so that fields can be missing or of any kind
        raise LogError(
            f"{path}: a message of type {topic.kind} cannot be decoded: {quoted(error)}"
        ) from error
    if time == 0.0:
        topic.unstamped += 1
        time = 1e-9 * record.log_time
    topic.times.append(time)
    for name, values in row.items():
        topic.columns.setdefault(name, []).append((time, values))


def _row(topic: _Topic, message: Any) -> dict[str, list[float]]:
    match topic.kind:
        case "JointState":
            found = {"actual_q": message.position, "actual_qd": message.velocity}
            return _joints(topic, message.name, found)
        case "JointTrajectoryControllerState":
            wanted = getattr(message, "reference", None) or message.desired
            found = {"target_q": wanted.positions, "target_qd": wanted.velocities}
            return _joints(topic, message.joint_names, found)
        case "Imu":
            row = {ACCELEROMETER: _xyz(message.linear_acceleration)}
            turning = _xyz(message.angular_velocity)
            return row | ({GYROSCOPE: turning} if any(turning) else {})  # only zeros: there is no gyroscope
        case _:
            turn = message.pose.orientation
            vector = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_rotvec()
            return {"actual_TCP_pose": [*_xyz(message.pose.position), *vector]}


def _xyz(vector: Any) -> list[float]:
    return [float(vector.x), float(vector.y), float(vector.z)]


def _joints(topic: _Topic, names: list[str], columns: dict[str, Any]) -> dict[str, list[float]]:
    """Sort values of columns with one entry per joint in the order of the joints."""
    if len(names) > MOST_JOINTS:
        raise ValueError(f"it has {len(names)} joints: must be at most {MOST_JOINTS}")
    topic.joints = topic.joints or tuple(sorted(names, key=_place))
    row = {}
    for column, values in columns.items():
        if names and len(values) == len(names):
            by_name = dict(zip(names, values, strict=True))
            row[column] = [float(by_name.get(name, np.nan)) for name in topic.joints]
    return row


def _place(name: str) -> tuple[int, list[int | str]]:
    """Return a joint's sort key: UR robots from base to tool, others by the numbers in their names."""
    known = [place for place, joint in enumerate(ORDER) if joint in name]
    digits = re.findall(r"\d{1,9}", name)
    return (known[0] if known else len(ORDER), [*map(int, digits), name] if not known else [])
