"""Names and units of a log's columns: convert the names given by users, vendors and UR to RTDE's."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from tvist_lab.recordings.checks import ACCELEROMETER, GYROSCOPE, PERIODS, TIME, LogError
from tvist_lab.recordings.recording import Floats
from tvist_protocol.errors import quoted

SHORT = {
    "time": TIME,
    "q": "actual_q",
    "qd": "actual_qd",
    "accelerometer": ACCELEROMETER,
    "gyroscope": GYROSCOPE,
    "pose": "actual_TCP_pose",
}  # RTDE's names of the most important columns, by short name
AXES = {"x": 0, "y": 1, "z": 2}  # letters that may replace the number in the name of a vector's column
SI = {
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "rad": 1.0, "deg": np.pi / 180.0, "m/s2": 1.0, "mm/s2": 1e-3,
    "g": 9.80665, "mg": 9.80665e-3, "rad/s": 1.0, "deg/s": np.pi / 180.0,
}  # fmt: skip
WIDEST = 7.0  # if half of an arm's joints exceed this angle, the unit must be degrees [rad]
GRAVITY_IN_G = (0.8, 1.2)  # range of the median length of an accelerometer's vector in units of gravity

TIMES = (TIME, "time", "t")
REALTIME = {
    "q_target": "target_q",
    "qd_target": "target_qd",
    "qdd_target": "target_qdd",
    "M_target": "target_moment",
    "q_actual": "actual_q",
    "qd_actual": "actual_qd",
    "tool_vector_actual": "actual_TCP_pose",
    "TCP_speed_actual": "actual_TCP_speed",
    "tool_accelerometer": "actual_tool_accelerometer",
}  # RTDE's names for those of UR's real-time interface
VENDORS = {
    # franka::logToCSV, github.com/frankaemika/libfranka, src/log.cpp
    "Franka's libfranka": "q=state.q[{}]:rad,target_q=state.q_d[{}]:rad,qd=state.dq[{}],target_qd=state.dq_d[{}]",
    # AccelQueryHelper.write_to_file, github.com/Klipper3d/klipper, klippy/extras/adxl345.py
    "Klipper's accelerometers": "time=time,accelerometer=accel_{}:mm/s2",
    # abb::egm::EGMLogger, github.com/ros-industrial/abb_libegm, src/egm_logger.cpp: feedback and planned
    "ABB's abb_libegm": "q=R_FB_POS_RJ{}:deg,target_q=R_PL_POS_RJ{}:deg,qd=R_FB_VEL_RJ{}:deg/s,"
    "target_qd=R_PL_VEL_RJ{}:deg/s",
    # github.com/rpiRobotics/abb_motion_program_exec, robot/HOME/motion_program_logger.mod
    "abb_motion_program_exec": "q=J{}:deg",
    # ClientApplication.collect_data, github.com/lbr-stack/pyfri, doc/examples.rst: measured and interpolated
    "KUKA's FRI (pyfri)": "q=mp{}:rad,target_q=ip{}:rad",
    # Tags and axes of KUKA.Ethernet RSI XML 1.1, joined by points as RSIPI (pypi.org/project/RSIPI) logs them
    "KUKA's RSI": "time=IPOC,q=AIPos.A{}:deg,target_q=ASPos.A{}:deg",
    "KUKA's RSI (RSIPI)": "time=Receive.IPOC,q=Receive.AIPos.A{}:deg,target_q=Receive.ASPos.A{}:deg",
    # RobotStateRt.msg of dsr_msgs2, github.com/doosan-robotics/doosan-robot2; numbered like RTDE's, or in brackets
    "Doosan's RobotStateRt": "time=time_stamp,q=actual_joint_position_{}:deg,qd=actual_joint_velocity_{}:deg/s,"
    "target_q=target_joint_position_{}:deg,target_qd=target_joint_velocity_{}:deg/s",
    "Doosan's RobotStateRt (brackets)": "time=time_stamp,q=actual_joint_position[{}]:deg,"
    "qd=actual_joint_velocity[{}]:deg/s,target_q=target_joint_position[{}]:deg,target_qd=target_joint_velocity[{}]:deg/s",
}
"""Columns each program writes, in the form of `_given`; its joint angles or accelerometer identify a program.

Only names found in the source of a program that writes them are listed: xArm, Fanuc and others document what
their controllers send, but no file with a header.
"""

_SPAN = re.compile(r"(\d{1,6})(?:-(\d{1,6}))?", re.ASCII)


def rtde_names(
    path: Path, header: Sequence[str], columns: str | None
) -> tuple[list[str], dict[str, str], tuple[str, ...]]:
    """Return RTDE's names of a header's columns (empty for others), known units, and a note naming the vendor.

    If `columns` is None, names in `VENDORS` and `REALTIME` are recognised; other names stay.
    """
    if columns is not None:
        return *_given(path, columns, header), ()
    own = [_own_name(name, header) for name in header]
    if (known := _vendor_of(header)) is None:
        return own, {}, ()
    vendor, there = known
    names, units = _given(path, there, header)
    names = [name or ("" if other in names else other) for name, other in zip(names, own, strict=True)]
    return names, units, (f"the columns have the names of {vendor}",)


def found_columns(names: Sequence[str], but: int | None = None) -> str:
    """List the names of a file's columns for an error message, without the column at index `but`."""
    there = [name for place, name in enumerate(names) if name and place != but]
    return f"its columns are {', '.join(there[:24])}{', …' if len(there) > 24 else ''}"


def _own_name(name: str, names: Sequence[str]) -> str:
    if name.lower() in TIMES and TIME not in names:
        return TIME
    stem, _, index = name.rpartition("_")
    return f"{REALTIME[stem]}_{index}" if stem in REALTIME else name


def _vendor_of(header: Sequence[str]) -> tuple[str, str] | None:
    """Return a header's vendor, and the map of its columns that exist; None if unknown."""
    for vendor, columns in VENDORS.items():
        entries = {one: _entry_of(one.partition("=")[2].partition(":")[0]) for one in columns.split(",")}
        there = [item for item, entry in entries.items() if any(map(entry.fullmatch, header))]
        if any(item.startswith(("q=", "accelerometer=")) for item in there):
            return vendor, ",".join(there)
    return None


def _given(path: Path, columns: str, header: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Parse names and units from a text such as `time=t:ms,q=joint_{}:deg,accelerometer=a{}:g`, or `time=1,q=2-7`."""
    # A short name or RTDE's is followed by the header's name, with `{}` for the number or letter x, y, z of
    # an entry, or by a position counted from 1, and by a colon and the unit if it is not SI.
    names, units = [""] * len(header), dict[str, str]()
    for item in columns.split(","):
        key, _, value = (part.strip() for part in item.partition("="))
        pattern, _, unit = value.partition(":")
        rtde = SHORT.get(key, key)
        if not key.isidentifier() or not pattern or (unit and unit not in SI):
            raise LogError(
                f"{path}: columns has {quoted(item)}: write NAME=COLUMN or NAME=COLUMN:UNIT, as in q=joint_{{}}:deg or "
                f"q=2-7:deg, with a unit of {', '.join(SI)}"
            )
        several = "{}" in pattern or "-" in pattern
        for index, at in enumerate(_places(path, key, pattern, header)):
            names[at] = f"{rtde}_{index}" if several else rtde
        if unit:
            units[rtde] = unit
    return names, units


def _entry_of(pattern: str) -> re.Pattern[str]:
    """Return the pattern for the names of one column, or of the entries of a vector."""
    before, braces, after = pattern.partition("{}")
    return re.compile(re.escape(before) + (r"(\d{1,6}|[xyz])" if braces else "") + re.escape(after))


def _places(path: Path, key: str, pattern: str, header: Sequence[str]) -> list[int]:
    """Return the indices of one column, or of the entries of a vector in their order."""
    entry, braces = _entry_of(pattern), "{}" in pattern
    hits = [(at, found) for at, name in enumerate(header) if (found := entry.fullmatch(name))]
    if not hits and (span := _SPAN.fullmatch(pattern)):
        first, last = int(span[1]), int(span[2] or span[1])
        if 1 <= first <= last <= len(header):
            return list(range(first - 1, last))
        raise LogError(f"{path}: {key}={pattern} are no columns: must be 1 to {len(header)}, as in {key}=2-7")
    if not hits:
        raise LogError(f"{path} has no column {quoted(pattern)} for {key}; {found_columns(header)}")
    hits.sort(key=lambda hit: int(AXES.get(hit[1][1], hit[1][1])) if braces else 0)
    return [at for at, _ in hits]


def in_si(names: Sequence[str], values: Floats, given: Mapping[str, str]) -> tuple[Floats, tuple[str, ...]]:
    """Convert numbers to SI; return notes about units that were inferred from the numbers."""
    # Infer: times in ms, µs or ns, from their step; joint angles in degrees, if most joints exceed 7;
    # and an accelerometer in g, if it reads about 1 at rest.
    places: dict[str, list[int]] = {}
    for at, name in enumerate(names):
        places.setdefault(re.sub(r"_\d+$", "", name), []).append(at)
    units, notes = dict(given), list[str]()
    for name, what, unit_of in (
        (TIME, "grows by {:.4g} from row to row", _unit_of_time),
        ("actual_q", "reaches {:.4g}", _unit_of_angles),
        ("target_q", "reaches {:.4g}", _unit_of_angles),
        ("actual_tool_accelerometer", "has a length of {:.2g} at the median", _unit_of_gravity),
    ):
        if name in places and name not in given:
            seen, units[name] = unit_of(values[:, places[name]])
            if SI[units[name]] != 1.0:
                notes.append(f"{name} {what.format(seen)}: it is taken as {units[name]}")
                for rate in (f"{name}d", f"{name}dd") if units[name] == "deg" else ():
                    units.setdefault(rate, "deg/s")
    if all(SI[one] == 1.0 for one in units.values()):
        return values, ()
    scale = np.ones(len(names))
    for name, one in units.items():
        scale[places.get(name, [])] = SI[one]
    return values * scale, tuple(notes)


def _unit_of_time(time: Floats) -> tuple[float, str]:
    step = float(np.nanmedian(np.diff(time[:, 0]))) if np.isfinite(time[:, 0]).sum() > 1 else 0.0
    fitting = (unit for unit in ("s", "ms", "us", "ns") if PERIODS[0] <= step * SI[unit] <= PERIODS[1])
    return step, next(fitting, "s")


def _unit_of_angles(q: Floats) -> tuple[float, str]:
    largest = np.max(np.abs(np.nan_to_num(q)), axis=0)
    return float(np.max(largest)), "deg" if np.median(largest) > WIDEST else "rad"


def _unit_of_gravity(force: Floats) -> tuple[float, str]:
    with np.errstate(over="ignore", invalid="ignore"):  # numbers of no robot are refused later, by their line
        length = float(np.median(np.linalg.norm(np.nan_to_num(force), axis=1)))
    return length, "g" if GRAVITY_IN_G[0] < length < GRAVITY_IN_G[1] else "m/s2"
