"""Export a recording for viewers: the recorded messages, three channels computed from them, and a layout.

The arm is drawn as frames and bodies: the pose of each link on its predecessor, and its shape.
"""

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from heapq import merge
from importlib import resources
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import IO, Any

import numpy as np
from mcap.records import Channel, Message, Metadata, Schema
from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import LIBRARY_IDENTIFIER, Writer
from scipy.spatial.transform import Rotation

from tvist_lab.metrics.vibration import NotMeasurableError, amplitude, best_tool_acceleration
from tvist_lab.recordings import Floats, Recording, RecordingError
from tvist_lab.recordings.export import FOXGLOVE, ExportError, written_by
from tvist_lab.recordings.mcap_file import RecordingFile
from tvist_lab.recordings.mcap_records import DAMAGE, all_records, opened
from tvist_lab.whole_file import whole_file
from tvist_plant.description import RobotDescription
from tvist_plant.model import link_frame
from tvist_plant.robot_checks import check
from tvist_plant.robot_tables import Body
from tvist_plant.user_file import UserFileError
from tvist_protocol.content import checked
from tvist_protocol.errors import ProtocolError
from tvist_protocol.recorded import END_METADATA, TICK_NS, topics
from tvist_protocol.stream import State

_, Y, Z = np.eye(3)
BASE, PAYLOAD = "world", "payload"
THIN = 0.04  # radius of a link of unknown shape, relative to the arm's reach [-]
PICTURE_TICKS = 10  # ticks between two frames messages, since viewers interpolate
DIGITS = 9  # decimals of positions [m] and quaternions; rounding makes the file a third smaller
LIGHT, DARK = (0.85, 0.87, 0.89), (0.36, 0.40, 0.44)
"""Colours of the arm's links, and of its base and payload: red, green, blue."""
SCHEMAS = {"frames": "foxglove.FrameTransforms", "arm": "foxglove.SceneUpdate", "curves": "tvist.curves"}
"""Schema of each channel, by the end of its topic; viewers know those of Foxglove by name."""

_Entry = tuple[int, str, Schema | None, Any]  # time [ns], topic, schema, and message


@dataclass(frozen=True)
class FoxgloveArm:
    """An arm of n joints; the frame of a link is at the link's far end, the last frame is the flange."""

    frames: tuple[str, ...]  # names of the frames: the base, and one for each link
    turns: Rotation  # rotation of each link's frame relative to its joint at angle 0, n of them
    shifts: Floats  # position of each link's frame in that of its joint, shape (n, 3) [m]
    bending: tuple[int, ...]  # links that bend in their middle, about y and then z
    bodies: tuple[Body, ...]  # bodies to draw, each in the frame of its link, or -1 for the base

    def steps(self, q: Floats, bends: Floats) -> tuple[Floats, Floats]:
        """Return each link's position, shape (T, n, 3) [m], and quaternion x y z w in the frame of the link before.

        `q` [rad] of the link side has shape (T, n); `bends` has two angles for each bending link.
        """
        places, quaternions = [], []
        for joint, (angle, shift) in enumerate(zip(q.T, self.shifts, strict=True)):
            turn = rest = _about(Z, angle)
            place = np.tile(shift, (len(q), 1))
            if joint in self.bending:
                about_y, about_z = bends[:, 2 * self.bending.index(joint) :][:, :2].T
                bend = _about(Y, about_y) * _about(Z, about_z)
                middle = shift * (0.5, 0.0, 1.0)  # half the link's length along x, its whole offset along z
                place, rest = middle + bend.apply(shift - middle), turn * bend
            places.append(turn.apply(place))
            quaternions.append((rest * self.turns[joint]).as_quat())
        return np.stack(places, axis=1), np.stack(quaternions, axis=1)


def _about(axis: Floats, angles: Floats) -> Rotation:
    return Rotation.from_rotvec(np.outer(angles, axis))


def arm_of(content: RecordingFile) -> FoxgloveArm:
    """Return the arm of a recording from its robot file, which servers record."""
    if "description" not in (content.start or {}):
        raise RecordingError(
            f"{content.path} does not describe its robot: record it with tvist serve --record"
        )
    try:
        robot = checked((content.start or {})["description"], RobotDescription)
        check(robot)
    except (ProtocolError, UserFileError) as error:
        raise RecordingError(f"{content.path} holds a robot that cannot be drawn: {error}") from error
    if content.recording.joints != robot.joints:
        raise RecordingError(
            f"{content.path} holds states of {content.recording.joints} joints: must be {robot.joints}"
        )
    links = [link_frame(robot, number) for number in range(robot.joints)]
    bodies = robot.collision.bodies or _sticks(robot, np.array([link.actInv(np.zeros(3)) for link in links]))
    if content.info is not None and content.info.payload.mass > 0.0:
        x, y, z = (2.0 * place for place in content.info.payload.com)
        radius = robot.collision.payload_radius
        bodies += (
            Body(name=PAYLOAD, link=robot.joints - 1, start=(0.0, 0.0, 0.0), end=(x, y, z), radius=radius),
        )
    return FoxgloveArm(
        frames=(BASE, *(f"{joint}_link" for joint in robot.robot.joints[:-1]), "flange"),
        turns=Rotation.from_matrix([link.rotation for link in links]),
        shifts=np.array([link.translation for link in links]),
        bending=tuple(sorted(robot.link_flexibility.links)),
        bodies=bodies,
    )


def _sticks(robot: RobotDescription, joints: Floats) -> tuple[Body, ...]:
    """Return a thin body from each joint to the end of its link, for a URDF arm of unknown shape."""
    radius = THIN * float(np.linalg.norm(joints, axis=1).sum())
    return tuple(
        Body(name=name, link=link, start=(x, y, z), end=(0.0, 0.0, 0.0), radius=radius)
        for link, (name, (x, y, z)) in enumerate(zip(robot.robot.joints, joints.tolist(), strict=True))
    )


def export(content: RecordingFile, path: Path) -> list[str]:
    """Write a recording with channels for viewers, and a layout, replacing both files; return notes on what is missing.

    The channels are `frames` (`foxglove.FrameTransforms`, 50 a second), `arm` (`foxglove.SceneUpdate`, once)
    and `curves` (every tick), each behind `tvist/<robot>/`.
    """
    arm, above = arm_of(content), topics(content.robot)[State].removesuffix("state")
    (stood, stiff), (drawn, lacking) = _stood(content, arm), _curves(content.recording)
    # A viewer first shows the messages at the file's first time, so the arm must be there.
    ticks = [
        int(content.recording["tick"][0]),
        *(one[0].tick for one in (content.journal, content.events) if one),
    ]
    first = min(ticks) * TICK_NS
    own = [
        [(first, f"{above}arm", None, {"entities": [_entity(arm, body) for body in arm.bodies]})],
        ((time, f"{above}frames", None, frames) for time, frames in _transforms(arm, first, *stood)),
        ((time, f"{above}curves", None, values) for time, values in drawn),
    ]
    try:
        with whole_file(path) as stream:
            _write(merge(*own, _recorded(content, above), key=itemgetter(0)), stream)
        with whole_file(written_by(path, FOXGLOVE)[1]) as stream:
            stream.write(_layout(content.robot, arm).encode())
    except OSError as error:
        raise ExportError(f"{path} cannot be written: {error.strerror or error}") from error
    return [*stiff, *lacking]


def _layout(robot: str, arm: FoxgloveArm) -> str:
    text = resources.files("tvist_lab.foxglove").joinpath("layout.json").read_text("utf-8")
    layout = json.loads(text.replace("tvist/ROBOT/", f"tvist/{robot}/"))
    view, reach = layout["configById"]["3D!arm"], float(np.linalg.norm(arm.shifts, axis=1).sum())
    view["cameraState"] |= {"distance": 2.4 * reach, "targetOffset": [0, 0, 0.3 * reach]}
    view["layers"]["grid"]["size"] = 4.0 * reach
    view["transforms"] = {f"frame:{name}": {"visible": False} for name in arm.frames}
    return json.dumps(layout, indent=1, ensure_ascii=False)


def _write(entries: Iterator[_Entry], stream: IO[bytes]) -> None:
    writer = Writer(stream, enable_data_crcs=True)
    writer.start(library=f"tvist {LIBRARY_IDENTIFIER}")
    channels: dict[str, int] = {}
    for time, topic, schema, message in entries:
        if isinstance(message, Metadata):
            writer.add_metadata(message.name, message.metadata)
            continue
        if topic not in channels:
            name = SCHEMAS.get(topic.rpartition("/")[2], "") if schema is None else schema.name
            content = (
                json.dumps({"title": name} | _schema_of(message)).encode() if schema is None else schema.data
            )
            number = writer.register_schema(name, SchemaEncoding.JSONSchema, content)
            channels[topic] = writer.register_channel(topic, MessageEncoding.JSON, number)
        data = message.data if isinstance(message, Message) else json.dumps(message).encode()
        writer.add_message(channels[topic], time, data, time)
    writer.finish()  # type: ignore[no-untyped-call]


def _recorded(content: RecordingFile, above: str) -> Iterator[_Entry]:
    """Yield the records of a recording up to the first damage, without the channels of an earlier export."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple[str, Schema | None]] = {}
    told = {END_METADATA}
    time = 0
    with suppress(*DAMAGE), opened(content.files) as streams:
        for record in all_records(streams):
            match record:
                case Schema(id=number):
                    schemas[number] = record
                case Channel(id=number, topic=topic) if topic.removeprefix(above) not in SCHEMAS:
                    channels[number] = topic, schemas.get(record.schema_id)
                case Message(channel_id=number, log_time=time) if number in channels:
                    yield time, *channels[number], record
                case Metadata(name=name) if name not in told:  # that of the first segment counts
                    told.add(name)
                    yield time, "", None, record
    if content.dropped is not None:
        counts = {kind: str(count) for kind, count in content.dropped.items()}
        yield time, "", None, Metadata(name=END_METADATA, metadata=counts)


def _schema_of(example: Any) -> dict[str, Any]:
    """Return the JSON Schema of messages like an example; the longest entry of a list stands for all."""
    if isinstance(example, dict):
        return {"type": "object", "properties": {name: _schema_of(part) for name, part in example.items()}}
    if isinstance(example, list):
        return {"type": "array", "items": _schema_of(max(example, key=lambda one: len(str(one)), default={}))}
    return {"type": {bool: "boolean", int: "integer", float: "number"}.get(type(example), "string")}


def _entity(arm: FoxgloveArm, body: Body) -> dict[str, Any]:
    start, end = np.array(body.start), np.array(body.end)
    length, wide = float(np.linalg.norm(end - start)), 2.0 * body.radius
    shade = DARK if body.link < 0 or body.name == PAYLOAD else LIGHT
    colour = dict(zip("rgba", (*shade, 1.0), strict=True))
    turn, _ = Rotation.align_vectors((end - start)[None] if length else Z[None], Z[None])
    ends = [start, end] if length else [start]
    spheres = [
        {"pose": _pose(at, Rotation.identity()), "size": _named([wide] * 3), "color": colour} for at in ends
    ]
    around = {"pose": _pose((start + end) / 2.0, turn), "size": _named([wide, wide, length]), "color": colour}
    return {
        "timestamp": _stamp(0),
        "frame_id": arm.frames[body.link + 1],
        "id": body.name,
        "lifetime": _stamp(0),  # for ever
        "frame_locked": True,
        "spheres": spheres,
        "cylinders": [around | {"bottom_scale": 1.0, "top_scale": 1.0}] if length else [],
    }


def _stood(content: RecordingFile, arm: FoxgloveArm) -> tuple[tuple[Floats, Floats, Floats], list[str]]:
    """Return ticks, joint angles and bends of one row for every ten ticks, and notes on what is missing."""
    # Take the truth if it was recorded, otherwise the measured angles without bending.
    recording = content.recording
    rows = np.flatnonzero(np.diff(recording["tick"] // PICTURE_TICKS, prepend=-1.0))
    ticks, q = recording["tick"][rows], recording["actual_q"][rows]
    bends, notes = np.zeros((len(q), 2 * len(arm.bending))), []
    if "truth_motor_q" not in recording:
        notes.append(
            "holds no truth (tvist serve --truth): the arm is drawn stiff, where its joints were measured"
        )
    else:
        true = recording["truth_motor_q"][rows] + recording["truth_gear_deflection"][rows]
        bent = recording["truth_link_deflection"][rows] if arm.bending else bends
        if true.shape != q.shape or bent.shape != bends.shape:
            raise RecordingError(f"{content.path} has a truth of another arm")
        known = np.asarray(np.isfinite(np.hstack([true, bent])).all(axis=1))
        q, bends = np.where(known[:, None], true, q), np.where(known[:, None], bent, 0.0)
        if share := 100.0 * np.mean(~known):
            notes.append(f"lacks the truth of {share:.0f} % of its ticks: the arm is drawn stiff there")
    here = np.isfinite(q).all(axis=1)
    return (ticks[here], q[here], bends[here]), notes


def _transforms(
    arm: FoxgloveArm, first: int, ticks: Floats, q: Floats, bends: Floats
) -> Iterator[tuple[int, dict[str, Any]]]:
    places, turns = (np.round(values, DIGITS) for values in arm.steps(q, bends))
    names = list(pairwise(arm.frames))
    for number, tick in enumerate(ticks.astype(int).tolist()):
        time = tick * TICK_NS if number else first
        yield (
            time,
            {
                "transforms": [
                    {"timestamp": _stamp(time), "parent_frame_id": parent, "child_frame_id": child}
                    | {"translation": _named(place), "rotation": _named(turn)}
                    for (parent, child), place, turn in zip(names, places[number], turns[number], strict=True)
                ]
            },
        )


def _curves(recording: Recording) -> tuple[Iterator[tuple[int, dict[str, float]]], list[str]]:
    """Return |α| [m/s²], largest unshaped and shaped joint acceleration [rad/s²] by tick, and notes."""
    before, after = (np.abs(recording[f"{name}_qdd"]).max(axis=1) for name in ("unshaped", "target"))
    found, notes = {"after_shaper": after}, []
    if np.any(recording["shaper_delay"] > 0.0) and np.any(after) and np.array_equal(before, after):
        notes.append("does not tell the reference before the shaper, as older servers: it has no curve")
    else:
        found["before_shaper"] = before
    try:
        found["alpha"] = amplitude(best_tool_acceleration(recording))
    except (NotMeasurableError, RecordingError) as error:
        notes.append(f"has no curve of |α|: {error}")
    columns = (np.round(values, 6).tolist() for values in found.values())
    rows = zip(recording["tick"].astype(int).tolist(), *columns, strict=True)
    return ((tick * TICK_NS, dict(zip(found, values, strict=True))) for tick, *values in rows), notes


def _stamp(time: int) -> dict[str, int]:
    return {"sec": time // 10**9, "nsec": time % 10**9}


def _named(values: Any) -> dict[str, float]:
    return dict(zip("xyzw", map(float, values), strict=False))


def _pose(place: Floats, turn: Rotation) -> dict[str, Any]:
    return {"position": _named(place), "orientation": _named(turn.as_quat())}
