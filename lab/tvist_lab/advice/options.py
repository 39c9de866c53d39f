"""Candidate shapers, judged on stops that were not used to find their modes, and alternatives to shaping."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from statistics import median
from typing import Any

import numpy as np
from scipy.optimize import minimize

from tvist_lab.advice.stops import ResidualVibration, StopWithRest, followed
from tvist_lab.metrics import NotMeasurableError
from tvist_lab.metrics.ring_down import decay_rate
from tvist_lab.recordings import Floats
from tvist_shaping import SHAPERS, Impulses, ShapingError, product, residual

Modes = tuple[tuple[float, float], ...]  # (f_d, ζ) of each mode, the lowest first [Hz, -]
BEGIN = (0.05, 0.2)  # damping ratios from which a search starts [-]
DAMPED = (0.005, 0.4)  # range of damping ratios in a search [-]
BESIDE = (0.7, 1.4)  # range of a search, relative to the lowest and the highest fitted mode [-]
ANY = (5.0, 25.0)  # range of frequencies in a search if no modes are known [Hz]
TRIALS = 60  # largest number of search steps for each mode
ENOUGH = 12  # number of stops from which modes are found; if there are more, the loudest count
ONE, EACH, ROBOT = "one for all", "each its own", "the robot's calibration"
"""Scope of the modes: one set for all motions, one for each motion, or the robot's own estimate."""
COPIES = 48  # number of copies of the reference that approximate a running mean


@dataclass(frozen=True)
class Aim:
    """Modes for which a shaper is designed, by motion."""

    scope: str  # `ONE`, `EACH` or `ROBOT`
    modes: Mapping[int, Modes]  # modes to use from now on, by number of the motion
    judged: Mapping[StopWithRest, Modes]
    """Modes for judging the shaper on each stop; if there are repetitions, found without this stop."""
    optimistic: frozenset[StopWithRest] = frozenset()
    """Stops that had to be judged by modes found in the same stop, since no other was recorded."""


@dataclass(frozen=True)
class Option:
    """A shaper designed for some modes."""

    shaper: str
    aim: Aim
    left: Mapping[StopWithRest, ResidualVibration]
    """Predicted vibration after each stop, by convolution."""
    by_modes: Mapping[StopWithRest, float]
    """Predicted share of each stop's vibration that is left, as root of the energy of its modes [-]; only for
    stops with known modes."""
    added: Mapping[StopWithRest, float]
    """Time by which each motion ends later [s]."""

    @property
    def count(self) -> int:
        """Number of modes."""
        return len(next(iter(self.aim.modes.values())))

    @property
    def name(self) -> str:
        """Name of the shaper, with the number of modes."""
        return f"{self.shaper}, {self.count} mode{'' if self.count == 1 else 's'}"

    @cached_property
    def percent(self) -> Mapping[StopWithRest, float]:
        """Vibration left after each stop, rms over that without a shaper [%]."""
        return {stop: 100.0 * left.rms / stop.unshaped.rms for stop, left in self.left.items()}

    @property
    def left_percent(self) -> float:
        """Median of the vibration left [%]."""
        return median(self.percent.values())

    @property
    def modes_percent(self) -> float | None:
        """Median of the vibration left according to the modes [%]; None if no modes are known."""
        return 100.0 * median(self.by_modes.values()) if self.by_modes else None

    @property
    def added_s(self) -> float:
        """Median of the added time [s]."""
        return median(self.added.values())

    @property
    def still_s(self) -> float:
        """Median settling time after the unshaped stop [s]; infinite if the recorded rests are too short."""
        return median(left.still for left in self.left.values())

    @property
    def keeps_limits(self) -> bool:
        """Whether the shaped motion keeps the velocity and acceleration limits of the unshaped one."""
        return SHAPERS[self.shaper].peak <= 1.0


def impulses_of(shaper: str, modes: Modes) -> Impulses:
    """Return the impulses of a shaper of the catalogue for some modes."""
    return product([SHAPERS[shaper].function(f_d, zeta) for f_d, zeta in modes])


def options(stops: Sequence[StopWithRest]) -> list[Option]:
    """Judge each catalogue shaper on stops with vibration; leave out shapers that cannot be judged on all."""
    return [
        option
        for aim in _aims(stops)
        if not any(
            f_d in ANY for modes in aim.judged.values() for f_d, _ in modes
        )  # the search ended at its limit
        for name in SHAPERS
        if name != "none" and (option := _judged(name, aim)) is not None
    ]


def _judged(name: str, aim: Aim) -> Option | None:
    left, by_modes, added = {}, {}, {}
    for stop, modes in aim.judged.items():
        try:
            impulses = impulses_of(name, modes)
            left[stop] = stop.left(impulses)
        except (NotMeasurableError, ShapingError):
            return None  # leave out a shaper that cannot be judged on every stop
        added[stop] = float(impulses.tau[-1])
        if (share := left_of_modes(stop, partial(residual, impulses=impulses))) is not None:
            by_modes[stop] = share
    return Option(name, aim, left, by_modes, added)


def left_of_modes(stop: StopWithRest, left: Callable[[float, float], Any]) -> float | None:
    """Return the share left of a stop's vibration, as root of its modes' energy [-]; None without modes.

    `left` is a function from a mode's f_d [Hz] and ζ to the share of its amplitude that is left [-].
    """
    before = after = 0.0
    for mode in stop.result.modes:
        f_d, zeta = mode["f_d_hz"], mode["zeta"]
        energy = mode["amplitude"] ** 2 / decay_rate(f_d, zeta)
        before += energy
        after += energy * float(left(f_d, zeta)) ** 2
    return math.sqrt(after / before) if before > 0.0 else None


def smoothed(stop: StopWithRest, added: float) -> float | None:
    """Return the vibration left if a running mean as long as `added` [s] smooths the reference [%].

    The mean lowers the jerk, and the motion ends later by `added`. None if too little rest was recorded.
    """
    try:
        left = stop.left(Impulses(np.full(COPIES, 1.0 / COPIES), np.linspace(0.0, added, COPIES)))
    except NotMeasurableError:
        return None
    return 100.0 * left.rms / stop.unshaped.rms


def slowed(stop: StopWithRest, added: float) -> float | None:
    """Return the share of a stop's vibration that is left if the whole motion takes `added` [s] longer [%].

    A mode with poles λ is left with an amplitude in proportion to |∫ v(t) exp(λ* (t - T)) dt|, where v is the
    speed of the reference and T its end. For a motion slowed by a factor k, this is the same integral with k
    λ. None if no modes or no joint angles are known.
    """
    time, speed = _speed(stop)
    if time[-1] <= time[0]:
        return None
    slower = 1.0 + added / float(time[-1] - time[0])

    def excited(f_d: float, zeta: float, slowness: float) -> float:
        pole = slowness * complex(decay_rate(f_d, zeta), 2.0 * math.pi * f_d)
        return float(abs(np.trapezoid(speed * np.exp(pole * (time - time[-1])), time)))

    share = left_of_modes(stop, lambda f_d, zeta: excited(f_d, zeta, slower) / excited(f_d, zeta, 1.0))
    return None if share is None else 100.0 * share


def _speed(stop: StopWithRest) -> tuple[Floats, Floats]:
    """Return times until the reference stops [s], and the speed of the joint that moves farthest [rad/s]."""
    recording, motion = stop.measured.recording, stop.motion
    rows = slice(motion.start, motion.reference_stop + 2)
    q, time = recording[followed(recording)][rows], recording.time[rows]
    joint = int(np.argmax(np.ptp(q, axis=0)))
    return time, np.asarray(np.gradient(q[:, joint], time))


def _aims(stops: Sequence[StopWithRest]) -> list[Aim]:
    groups = {group: [one for one in stops if one.group == group] for group in {one.group for one in stops}}
    aims = []
    for count in (1, 2):
        aims.append(Aim(ONE, dict.fromkeys(groups, best_modes(stops, count)), *_held_out(stops, count)))
        if len(groups) > 1:
            parts = [_held_out(of_one, count) for of_one in groups.values()]
            judged = {stop: modes for part, _ in parts for stop, modes in part.items()}
            own = {group: best_modes(of_one, count) for group, of_one in groups.items()}
            aims.append(Aim(EACH, own, judged, frozenset().union(*(few for _, few in parts))))
    if all("estimated_f_d" in one.measured.recording for one in stops):
        told = {stop: _estimated(stop) for stop in stops}
        if all(told.values()):
            aims.append(Aim(ROBOT, {one.group: modes for one, modes in told.items()}, told))
    return aims


def _estimated(stop: StopWithRest) -> Modes:
    """Return the modes that the robot itself estimated at the end of a motion; none without a calibration."""
    recording, row = stop.measured.recording, stop.motion.shaped_stop
    f_d, zeta = (recording[name][row] for name in ("estimated_f_d", "estimated_zeta"))
    info = recording.info
    known = np.isfinite(f_d).all() and (info is None or getattr(info, "calibration", "") is not None)
    return tuple(zip(f_d.tolist(), zeta.tolist(), strict=True)) if known else ()


def _held_out(
    stops: Sequence[StopWithRest], count: int
) -> tuple[dict[StopWithRest, Modes], frozenset[StopWithRest]]:
    """Return modes to judge each stop, from the other half of stops, and stops judged by their own modes."""
    if len(stops) == 1:
        return {stops[0]: best_modes(stops, count)}, frozenset(stops)
    ordered = sorted(stops, key=lambda one: one.group)  # so that each half has its share of the repetitions
    halves = {stop: place % 2 for place, stop in enumerate(ordered)}
    found = [best_modes([one for one in stops if halves[one] != half], count) for half in (0, 1)]
    return {stop: found[halves[stop]] for stop in stops}, frozenset()


def best_modes(stops: Sequence[StopWithRest], count: int) -> Modes:
    """Find the modes with which ZV shapers would leave least vibration after stops, ordered by frequency."""
    # These modes suit shaping better than fitted ones: if an arm has more modes than a shaper, the best aim lies
    # between them.
    loudest = sorted(stops, key=lambda one: -one.unshaped.rms)[:ENOUGH]
    before = sum(one.unshaped.rms**2 for one in loudest)

    def cost(modes: Modes) -> float:
        try:
            impulses = impulses_of("zv", modes)
            return sum(one.left(impulses, gears=False).rms ** 2 for one in loudest) / before
        except NotMeasurableError:
            return 1.0

    seen = [mode["f_d_hz"] for one in loudest for mode in one.result.modes]
    low, high = (
        (share * end for share, end in zip(BESIDE, (min(seen), max(seen)), strict=True)) if seen else ANY
    )
    grid = [(float(f_d), zeta) for f_d in np.geomspace(low, high, 20) for zeta in BEGIN]
    found: Modes = ()
    for _ in range(count):
        first = min(grid, key=lambda mode: cost((*found, mode)))
        found = _refined((*found, first), cost, (low, high))
    return tuple(sorted(found))


def _refined(start: Modes, cost: Callable[[Modes], float], between: tuple[float, float]) -> Modes:
    def modes(x: Floats) -> Modes:
        f_d = np.clip(np.exp(x[::2]), *between)
        return tuple(zip(f_d.tolist(), np.clip(x[1::2], *DAMPED).tolist(), strict=True))

    first = np.array([value for f_d, zeta in start for value in (math.log(f_d), zeta)])
    simplex = np.vstack([first, first + np.diag(np.tile([0.05, 0.03], len(start)))])
    search = {"maxfev": TRIALS * len(start), "initial_simplex": simplex}
    return modes(minimize(lambda x: cost(modes(x)), first, method="Nelder-Mead", options=search).x)
