"""rosbag2 recordings in MCAP: joint states, an accelerometer, and a controller's target, by message type."""

import io
import re
from collections.abc import Callable
from contextlib import redirect_stderr
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mcap.records import Channel, Message, Schema
from mcap_ros2.decoder import DecoderFactory
from scipy.spatial.transform import Rotation

from tvist_lab.recordings.checks import ACCELEROMETER as SENSOR
from tvist_lab.recordings.checks import GYROSCOPE, LogError
from tvist_lab.recordings.log_columns import ROBOT, Needs, Rows, recording_of
from tvist_lab.recordings.mcap_records import DAMAGE, records
from tvist_lab.recordings.recording import Floats, Recording
from tvist_protocol.errors import quoted

JOINTS, ACCELEROMETER, TARGET, POSE = "JointState", "Imu", "JointTrajectoryControllerState", "PoseStamped"
READ = {f"{package}/msg/{name}": name for package, name in (
    ("sensor_msgs", JOINTS), ("sensor_msgs", ACCELEROMETER), ("control_msgs", TARGET), ("geometry_msgs", POSE),
)}  # fmt: skip
"""Types of messages that are read, and their short names."""
ORDER = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
"""Joints of a UR robot from base to tool; ROS lists them in any order."""

MOST_JOINTS = 100
"""Largest number of joints of a message; a robot with a gripper has some ten."""


@dataclass
class _Topic:
    """Messages of one topic as numbers."""

    kind: str
    decode: Callable[[bytes], Any]
    times: list[float] = field(default_factory=list)
    rows: list[dict[str, list[float]]] = field(default_factory=list)
    joints: tuple[str, ...] | None = None
    unstamped: int = 0


def read_rosbag(path: Path, needs: Needs = ROBOT) -> Recording:
    """Read a rosbag2 recording: `JointState`, `Imu`, `JointTrajectoryControllerState` and the TCP's `PoseStamped`.

    Of each type the topic with the most messages counts. Times are those of the headers. The rows are those of the
    accelerometer; joint angles between two messages are interpolated.

    Raises:
        LogError: There are no joint states, or messages that cannot be decoded; or see `recording_of`.
        OSError: The file cannot be read.
    """
    topics, damage = _topics(path)
    notes = [damage] if damage else []
    chosen: dict[str, _Topic] = {}
    for name, topic in sorted(topics.items(), key=lambda item: -len(item[1].rows)):
        if not topic.rows:
            continue
        if topic.kind in chosen:
            notes.append(f"{name} has fewer messages than another topic of {topic.kind} and was not read")
            continue
        chosen[topic.kind] = topic
        if topic.unstamped:
            notes.append(
                f"{topic.unstamped} messages of {name} have no time in their header: the time of recording counts"
            )
    kinds = {"actual_q": JOINTS, "target_q": TARGET, SENSOR: ACCELEROMETER}
    wanted, *others = (kind for column, kind in kinds.items() if column in needs.columns)
    if not any(kind in chosen for kind in (wanted, *others)):
        there = ", ".join(sorted(topics)) or "nothing that is read"
        raise LogError(f"{path} has no sensor_msgs/msg/{wanted}; it has {there}")
    base = chosen.get(ACCELEROMETER) or chosen.get(JOINTS) or chosen[TARGET]
    columns = _columns(chosen, base)
    names, values = ["timestamp"], [np.array(base.times)[:, None]]
    for name, column in columns.items():
        names += [f"{name}_{index}" for index in range(column.shape[1])]
        values.append(column)
    order = np.argsort(base.times, kind="stable")
    table = np.hstack(values)[order]
    return recording_of(Rows(path, names, table, order + np.float64(1.0), "message", tuple(notes), needs))


def has_ros(path: Path) -> bool:
    """Return whether an MCAP file has messages of ROS 2, whatever their types."""
    try:
        with path.open("rb") as stream:
            return any(
                isinstance(record, Channel) and record.message_encoding == "cdr" for record in records(stream)
            )
    except DAMAGE:
        return False


def _topics(path: Path) -> tuple[dict[str, _Topic], str | None]:
    """Messages by topic, and what is wrong with the file."""
    schemas: dict[int, Schema] = {}
    by_channel: dict[int, _Topic] = {}
    topics: dict[str, _Topic] = {}
    factory = DecoderFactory()
    try:
        with path.open("rb") as stream:
            for record in records(stream):
                match record:
                    case Schema():
                        schemas[record.id] = record
                    case Channel():
                        schema = schemas.get(record.schema_id)
                        kind = None if schema is None else READ.get(schema.name)
                        if kind is None:
                            continue
                        decode = _decoder(path, factory, record, schema)
                        by_channel[record.id] = topics.setdefault(record.topic, _Topic(kind, decode))
                    case Message() if (topic := by_channel.get(record.channel_id)) is not None:
                        _take(path, topic, record)
    except LogError:
        raise
    except DAMAGE as error:
        return (
            topics,
            f"{path} was not closed or is damaged ({type(error).__name__}); it was read up to there",
        )
    return topics, None


def _decoder(
    path: Path, factory: DecoderFactory, channel: Channel, schema: Schema | None
) -> Callable[[bytes], Any]:
    try:
        with redirect_stderr(io.StringIO()):  # the parser prints what it raises
            decode = factory.decoder_for(channel.message_encoding, schema)
    except Exception as error:
        raise LogError(f"{path}: the schema of {channel.topic} is damaged: {quoted(error)}") from error
    if decode is None:
        raise LogError(
            f"{path}: {channel.topic} is written as {channel.message_encoding} with a schema in "
            f"{schema.encoding if schema else 'no language'}; cdr with ros2msg is read"
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
    topic.rows.append(row)


def _row(topic: _Topic, message: Any) -> dict[str, list[float]]:
    """Numbers of a message by column."""
    match topic.kind:
        case "JointState":
            row = _joints(topic, message.name, message.position, "actual_q")
            row |= _joints(topic, message.name, message.velocity, "actual_qd")
        case "JointTrajectoryControllerState":
            wanted = getattr(message, "reference", None) or message.desired
            row = _joints(topic, message.joint_names, wanted.positions, "target_q")
            row |= _joints(topic, message.joint_names, wanted.velocities, "target_qd")
        case "Imu":
            force = message.linear_acceleration
            row = {"actual_tool_accelerometer": list(map(float, (force.x, force.y, force.z)))}
            turning = message.angular_velocity
            if any(
                speed := list(map(float, (turning.x, turning.y, turning.z)))
            ):  # all zero: it has no gyroscope
                row[GYROSCOPE] = speed
        case _:
            pose = message.pose
            turn = pose.orientation
            vector = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_rotvec()
            place = map(float, (pose.position.x, pose.position.y, pose.position.z))
            row = {"actual_TCP_pose": [*place, *vector]}
    return row


def _joints(topic: _Topic, names: list[str], values: Any, column: str) -> dict[str, list[float]]:
    """Values in the order of the joints; nothing if the message has none, or not one for each joint.

    Raises:
        ValueError: There are more than `MOST_JOINTS`.
    """
    if len(names) > MOST_JOINTS:
        raise ValueError(f"{len(names)} joints, at most {MOST_JOINTS} are read")
    if len(values) != len(names) or not len(names):
        return {}
    if topic.joints is None:
        topic.joints = tuple(sorted(names, key=_place))
    by_name = dict(zip(names, values, strict=True))
    return {column: [float(by_name.get(name, np.nan)) for name in topic.joints]}


def _place(name: str) -> tuple[int, list[int | str]]:
    """Sort key of a joint: a UR robot's from base to tool, others by the numbers in their names."""
    known = [place for place, joint in enumerate(ORDER) if joint in name]
    digits = re.findall(r"\d{1,9}", name)
    return (known[0] if known else len(ORDER), [*map(int, digits), name] if not known else [])


def _columns(chosen: dict[str, _Topic], base: _Topic) -> dict[str, Floats]:
    """Each topic's values at the times of one of them; NaN outside of its own time."""
    columns: dict[str, Floats] = {}
    at = np.array(base.times)
    for topic in chosen.values():
        for name in sorted({name for row in topic.rows for name in row}):
            rows = [
                (time, row[name]) for time, row in zip(topic.times, topic.rows, strict=True) if name in row
            ]
            rows.sort(key=lambda row: row[0])
            time = np.array([row[0] for row in rows])
            values = np.array([row[1] for row in rows], dtype=np.float64)
            if topic is base and len(rows) == len(at):
                columns.setdefault(name, np.array([row[name] for row in topic.rows], dtype=np.float64))
                continue
            columns.setdefault(
                name,
                np.column_stack([np.interp(at, time, axis, left=np.nan, right=np.nan) for axis in values.T]),
            )
    return columns
