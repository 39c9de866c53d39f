"""The modes that the laboratory finds, beside those of matrix pencils and those that made-up stops have."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from proof.ringing.course import changes, overshoot
from proof.ringing.made_up import SPEEDS, made_up
from proof.ringing.matrix_pencil import Found, matrix_pencil
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.felt import felt
from tvist_lab.metrics.motion import MotionRows, motions
from tvist_lab.metrics.ring_down import RingDown
from tvist_lab.metrics.table import ring_down_of
from tvist_lab.recordings import Recording, RecordingError, read

RECORDED = Path(__file__).parents[2] / "tests" / "lab" / "data" / "ur5_stops.csv.gz"
"""Stops of a real UR5."""
FAST = 2.0
"""Speed of a joint from which on a motion is fast [rad/s]."""
RIGHT = 0.03
"""Largest difference of f_d [-]."""
AS_STRONG = 0.85
"""Smallest amplitude over the largest one with which a mode is about as strong [-]."""
MADE_UP = "made up"
SUMMARY = (
    "stops",
    "judged",
    "refused",
    "strongest %",
    "one as strong %",
    "f_d holds %",
    "ζ holds %",
    "two %",
)
"""Figures of a kind; README.md says what they are."""

COURSE = {
    "overshoot_mrad": "overshoot mrad",
    "swings_s": "until still s",
    "f_d_early": "f_d Hz from .12 s",
    "f_d_late": "f_d Hz from .42 s",
    "zeta_early": "ζ from .12 s",
    "zeta_late": "ζ from .42 s",
}
"""How a stop goes on, and the heads of the columns."""


class Stop(NamedTuple):
    """One stop."""

    where: str
    """Log and time."""
    kind: str
    """Whether it is slow or fast."""
    expected: Sequence[Found]
    """Modes of the other method, or the true ones, the strongest first; none if the other method finds none."""
    fit: RingDown
    course: Mapping[str, float | None]
    """How a recorded stop goes on."""


def files_of(paths: Sequence[Path]) -> list[Path]:
    """Return files, and the files of folders; by default, the recorded stops among the tests.

    Raises:
        FileNotFoundError: There is no such path, or a folder holds no file.
    """
    found = []
    for path in paths or [RECORDED]:
        inside = sorted(one for one in path.iterdir() if one.is_file()) if path.is_dir() else [path]
        if not path.exists() or not inside:
            raise FileNotFoundError(f"there is no log at {path}")
        found += inside
    return found


def of_logs(files: Sequence[Path], tell: Callable[[str], None]) -> list[Stop]:
    """Stops of all logs among some files; what cannot be read or measured is told."""
    stops = []
    for file in files:
        try:
            recording = read(file)
            found = motions(recording)
        except RecordingError as error:
            tell(f"{file.name}: left out: {error}")
            continue
        for motion in found:
            stop = float(recording.time[motion.shaped_stop])
            where = f"{file.name} {stop - recording.origin:.2f} s"
            try:
                time, alpha = felt(recording, motion, slice(motion.shaped_stop, motion.end))
                fit = ring_down_of(recording, motion)
            except NotMeasurableError as error:
                tell(f"{where}: left out: {error}")
                continue
            kind = "fast" if _speed(recording, motion) > FAST else "slow"
            goes_on = dict(changes(time - stop, alpha))
            if (
                "actual_q" in recording
                and np.isfinite(recording["actual_q"][motion.shaped_stop : motion.end]).all()
            ):
                rest = slice(motion.shaped_stop, motion.end)
                goes_on |= overshoot(recording.time[rest] - stop, recording["actual_q"][rest])
            stops.append(Stop(where, kind, matrix_pencil(time - stop, alpha), fit, goes_on))
    return stops


def of_made_up(count: int, seed: int, progress: Callable[[str], None]) -> Iterator[Stop]:
    """Made-up stops, as many of each speed, and their true modes."""
    for name, speed in SPEEDS.items():
        for number in range(seed, seed + count):
            made = made_up(speed, number)
            fits = [ring_down_of(made.recording, motion) for motion in motions(made.recording)]
            progress(f"made-up {name} stop {number}")
            yield Stop(f"seed {number}", f"{MADE_UP}, {name}", made.modes, fits[-1], {})


def report(stops: Sequence[Stop]) -> dict[str, Any]:
    """Figures of each kind of stops, and those of each stop."""
    kinds = dict.fromkeys(stop.kind for stop in stops)
    return {
        "summary": {kind: _summary([stop for stop in stops if stop.kind == kind]) for kind in kinds},
        "stops": [
            {
                "where": stop.where,
                "kind": stop.kind,
                "expected": [mode._asdict() for mode in stop.expected],
                "found": [
                    {"f_d": mode.f_d, "f_d_interval": mode.f_d_interval, "zeta": mode.zeta,
                     "zeta_interval": mode.zeta_interval}
                    for mode in stop.fit.found
                ],
                "reason": stop.fit.reason,
                **stop.course,
            }
            for stop in stops
        ],
    }  # fmt: skip


def tables(result: dict[str, Any]) -> list[tuple[Sequence[str], list[list[str]]]]:
    """Return the table of the figures of each kind, and that of the recorded stops."""
    rows = [
        [kind, *("–" if value is None else f"{value:.4g}" for value in figures.values())]
        for kind, figures in result["summary"].items()
    ]
    stops = [
        [stop["where"], stop["kind"], _words(stop["expected"]), _words(stop["found"]) or stop["reason"]]
        for stop in result["stops"]
        if not stop["kind"].startswith(MADE_UP)
    ]
    found: list[tuple[Sequence[str], list[list[str]]]] = [(("kind", *SUMMARY), rows)]
    if stops:
        found.append((("stop", "kind", "matrix pencils: f_d Hz / ζ", "found: f_d Hz (95 %) / ζ"), stops))
        found.append(
            (("stop", *COURSE.values()), [_course(stop) for stop in result["stops"] if "swings_s" in stop])
        )
    return found


def _summary(stops: Sequence[Stop]) -> dict[str, float | None]:
    judged = [stop for stop in stops if stop.expected]
    fits = [(stop.fit, stop.expected) for stop in judged if stop.fit.ok]
    nearest = [(fit, min(expected, key=lambda one: abs(one.f_d - fit.f_d))) for fit, expected in fits]
    figures = (
        len(stops),
        len(judged),
        len(judged) - len(fits),
        _percent([_right(fit, expected[:1]) for fit, expected in fits], len(judged)),
        _percent([_right(fit, _as_strong(expected)) for fit, expected in fits], len(judged)),
        _percent([_holds(fit.f_d_interval, mode.f_d) for fit, mode in nearest]),
        _percent([_holds(fit.zeta_interval, mode.zeta) for fit, mode in nearest]),
        _percent([len(stop.fit.found) > 1 for stop in judged if len(stop.expected) > 1]),
    )
    return dict(zip(SUMMARY, figures, strict=True))


def _right(fit: RingDown, modes: Sequence[Found]) -> bool:
    """Whether the strongest mode that was found is one of some modes."""
    return any(abs(fit.f_d / mode.f_d - 1.0) <= RIGHT for mode in modes)


def _as_strong(modes: Sequence[Found]) -> list[Found]:
    return [mode for mode in modes if mode.amplitude >= AS_STRONG * modes[0].amplitude]


def _holds(interval: tuple[float, float], value: float) -> bool:
    return interval[0] <= value <= interval[1]


def _percent(true: Sequence[bool], of: int | None = None) -> float | None:
    count = len(true) if of is None else of
    return 100.0 * sum(true) / count if count else None


def _speed(recording: Recording, motion: MotionRows) -> float:
    """Largest speed of a joint from its angles, over 40 ms [rad/s]."""
    q = recording["target_q" if "target_q" in recording else "actual_q"][
        motion.start : motion.arm_stop(recording)
    ]
    time = recording.time[motion.start : motion.start + len(q)]
    rows = max(round(0.04 / recording.period), 1)
    if len(q) <= rows:
        return 0.0
    return float(np.nanmax(np.abs(q[rows:] - q[:-rows]) / (time[rows:] - time[:-rows])[:, None]))


def _course(stop: Mapping[str, Any]) -> list[str]:
    return [stop["where"], *("–" if stop[name] is None else f"{stop[name]:.4g}" for name in COURSE)]


def _words(modes: Sequence[dict[str, Any]]) -> str:
    """The modes of a stop, the strongest first."""
    return ", ".join(
        f"{mode['f_d']:.2f}"
        + ("" if "f_d_interval" not in mode else " ({:.2f}–{:.2f})".format(*mode["f_d_interval"]))
        + f" / {mode['zeta']:.3f}"
        for mode in modes
    )
