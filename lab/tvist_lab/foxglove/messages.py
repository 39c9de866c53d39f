"""Messages of the added channels, in the well-known JSON schemas of Foxglove where there is one.

Fields that these messages do not use are left out of the schemas; viewers know a schema by its name.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from tvist_lab.foxglove.arm import PAYLOAD, Arm
from tvist_lab.metrics.errors import NotMeasurableError
from tvist_lab.metrics.vibration import amplitude, best_tool_acceleration
from tvist_lab.recordings import Floats, Recording, RecordingError
from tvist_plant.robot_tables import Body
from tvist_protocol.geometry import Capsule
from tvist_protocol.recorded import TICK_NS

PICTURE_TICKS = 10
"""Ticks between two messages about the frames: 50 a second show a vibration of 10 Hz, and viewers interpolate."""
DIGITS = 9
"""Decimals of places [m] and quaternions, which shorten the file by a third."""
LIGHT, DARK = (0.85, 0.87, 0.89), (0.36, 0.40, 0.44)
"""Colours of the arm's links, and of its base and payload: red, green, blue."""

Stamped = tuple[int, bytes]
"""Time of a message [ns], and the message."""


def scene(arm: Arm) -> dict[str, Any]:
    """Return the `foxglove.SceneUpdate` that draws the arm; its bodies move with their frames."""
    return {"entities": [_entity(arm, body) for body in arm.bodies]}


def _entity(arm: Arm, body: Capsule | Body) -> dict[str, Any]:
    start, end = np.array(body.start), np.array(body.end)
    axis, wide = end - start, 2.0 * body.radius
    red, green, blue = DARK if body.link < 0 or body.name == PAYLOAD else LIGHT
    color = {"r": red, "g": green, "b": blue, "a": 1.0}
    length = float(np.linalg.norm(axis))
    return {
        "timestamp": _stamp(0),
        "frame_id": arm.frames[body.link + 1],
        "id": body.name,
        "lifetime": _stamp(0),  # for ever
        "frame_locked": True,
        "spheres": [
            {"pose": _pose(place, (0.0, 0.0, 0.0, 1.0)), "size": _vector((wide,) * 3), "color": color}
            for place in (start, end)[: 2 if length else 1]
        ],
        "cylinders": [
            {
                "pose": _pose((start + end) / 2.0, _from_z(axis / length)),
                "size": _vector((wide, wide, length)),
                "bottom_scale": 1.0,
                "top_scale": 1.0,
                "color": color,
            }
        ]
        if length
        else [],
    }


def _from_z(direction: Floats) -> tuple[float, float, float, float]:
    """Quaternion x y z w of a rotation that takes the z axis to a direction."""
    x, y, z = direction.tolist()
    if z < -1.0 + 1e-12:
        return 1.0, 0.0, 0.0, 0.0
    size = np.sqrt(2.0 * (1.0 + z))
    return float(-y / size), float(x / size), 0.0, float(size / 2.0)


@dataclass(frozen=True)
class Angles:
    """How the arm stood at some ticks of a recording."""

    ticks: Floats
    """Shape (T,)."""
    q: Floats
    """Joint angles on the link side, shape (T, n) [rad]."""
    bends: Floats
    """Two angles per link that bends, shape (T, 2 · links) [rad]."""


def angles(recording: Recording, arm: Arm) -> tuple[Angles, list[str]]:
    """Return the arm's angles every `PICTURE_TICKS` rows, and what is missing, in sentences.

    They are the true ones where they were recorded, else those that the robot measured, without bent links.
    """
    rows = slice(None, None, PICTURE_TICKS)
    q = recording["actual_q"][rows]
    bends = np.zeros((len(q), 2 * len(arm.bending)))
    notes: list[str] = []
    if "truth_motor_q" not in recording:
        notes.append(
            "holds no truth (tvist serve --truth): the arm is drawn stiff, where its joints were measured"
        )
    else:
        true = recording["truth_motor_q"][rows] + recording["truth_gear_deflection"][rows]
        bent: Floats = recording["truth_link_deflection"][rows] if arm.bending else bends
        if true.shape != q.shape or bent.shape != bends.shape:
            notes.append("holds a truth of another arm: the arm is drawn stiff")
        else:
            known = np.asarray(np.isfinite(np.hstack([true, bent])).all(axis=1))
            q, bends = np.where(known[:, None], true, q), np.where(known[:, None], bent, 0.0)
            if not known.all():
                notes.append(
                    f"lacks the truth of {100.0 * np.mean(~known):.0f} % of its ticks: the arm is drawn stiff there"
                )
    here = np.isfinite(q).all(axis=1)
    return Angles(recording["tick"][rows][here], q[here], bends[here]), notes


def transforms(arm: Arm, stood: Angles) -> Iterator[Stamped]:
    """Yield a `foxglove.FrameTransforms` for each tick."""
    places, quaternions = (np.round(values, DIGITS).tolist() for values in arm.steps(stood.q, stood.bends))
    names = list(zip(arm.frames, arm.frames[1:], strict=False))
    for tick, shifts, turns in zip(stood.ticks.astype(int).tolist(), places, quaternions, strict=True):
        stamp = _stamp(tick * TICK_NS)
        content = [
            {
                "timestamp": stamp,
                "parent_frame_id": parent,
                "child_frame_id": child,
                "translation": _vector(shift),
                "rotation": _quaternion(turn),
            }
            for (parent, child), shift, turn in zip(names, shifts, turns, strict=True)
        ]
        yield tick * TICK_NS, msgspec.json.encode({"transforms": content})


CURVES = {
    "alpha": "|α|: acceleration of the tool without gravity [m/s²]",
    "before_shaper": "Largest acceleration of a joint, of the reference before the shaper [rad/s²]",
    "after_shaper": "Largest acceleration of a joint, of the shaped reference [rad/s²]",
}
"""Fields of `tvist.curves`."""


def curves(recording: Recording) -> tuple[Iterator[Stamped], list[str]]:
    """Yield a message `tvist.curves` for each tick; return also what is missing in them, in sentences."""
    shaped, unshaped = recording["target_qdd"], recording["unshaped_qdd"]
    found, notes = {"after_shaper": _largest(shaped)}, []
    if np.any(recording["shaper_delay"] > 0.0) and np.any(shaped) and np.array_equal(unshaped, shaped):
        notes.append("does not tell the reference before the shaper, as older servers: it has no curve")
    else:
        found["before_shaper"] = _largest(unshaped)
    try:
        found["alpha"] = amplitude(best_tool_acceleration(recording))
    except (NotMeasurableError, RecordingError) as error:
        notes.append(f"has no curve of |α|: {error}")
    return _curves(recording["tick"], found), notes


def _curves(ticks: Floats, found: dict[str, Floats]) -> Iterator[Stamped]:
    columns = [np.round(found[name], 6).tolist() for name in CURVES if name in found]
    names = [name for name in CURVES if name in found]
    for tick, *values in zip(ticks.astype(int).tolist(), *columns, strict=True):
        content = {name: value for name, value in zip(names, values, strict=True) if math.isfinite(value)}
        yield tick * TICK_NS, msgspec.json.encode(content)


def _largest(values: Floats) -> Floats:
    return np.asarray(np.abs(values).max(axis=1))


def schema_of(example: Any) -> dict[str, Any]:
    """Return the JSON Schema of messages like an example; the longest entry of a list stands for all."""
    match example:
        case dict():
            return {"type": "object", "properties": {name: schema_of(part) for name, part in example.items()}}
        case [*entries]:
            return {
                "type": "array",
                "items": schema_of(max(entries, key=_content)) if entries else {"type": "object"},
            }
        case bool():
            return {"type": "boolean"}
        case int():
            return {"type": "integer", "minimum": 0}
        case float():
            return {"type": "number"}
    return {"type": "string"}


def _content(example: Any) -> int:
    """Number of values in a message."""
    parts = example.values() if isinstance(example, dict) else example if isinstance(example, list) else ()
    return 1 + sum(map(_content, parts))


def _stamp(time: int) -> dict[str, int]:
    return {"sec": time // 10**9, "nsec": time % 10**9}


def _vector(values: Any) -> dict[str, float]:
    return dict(zip("xyz", map(float, values), strict=True))


def _quaternion(values: Any) -> dict[str, float]:
    return dict(zip("xyzw", map(float, values), strict=True))


def _pose(place: Any, turn: Any) -> dict[str, Any]:
    return {"position": _vector(place), "orientation": _quaternion(turn)}
