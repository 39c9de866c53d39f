"""Where the time of a tick goes, box by box, for several filters."""

import gc
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from msgspec import Struct

from tvist_controller.api import BOXES, Box, Instruments, LoopbackHost, Place, Report, Setup
from tvist_lab.benchmark.box_sampler import sampled_shares
from tvist_lab.benchmark.box_timer import BoxError, BoxTimer
from tvist_lab.benchmark.figure import Figure, Floats, Run, figure, in_alternation
from tvist_lab.benchmark.machine import Machine, this_machine
from tvist_lab.benchmark.moving import TICKS, MovingRobot, StreamingRobot, mujoco_tick
from tvist_lab.benchmark.published import Published, published
from tvist_lab.in_process import free_setup

SHAPERS = ("zv", "ei", "auto", "planned", "elastic")
"""Filters of the profile."""
STREAM = f"{SHAPERS[0]}, set-points"
"""Name of the run that follows a stream of set-points."""
READ = f"{SHAPERS[0]}, read"
"""Name of the run whose states are published over Zenoh, and read by the instruments of UR's interfaces."""
REPETITIONS = 12
"""Number of runs of each robot untouched, wrapped once and wrapped twice, in turn."""
SAMPLES = 500
"""Number of samples of each robot."""
RUN = "run"
ALL: tuple[Box, ...] = (
    Box(RUN, None, "between the ticks", (Place(MovingRobot, "go"),)),
    BOXES[0]._replace(within=RUN),
    *BOXES[1:],
    Box("publishing", BOXES[0].name, "", (Place(Published, "put"),)),
)
"""Boxes of a run: those of the controller, what is around the ticks, and Zenoh."""


class BoxTime(Struct, frozen=True):
    """Time that a tick spends in a box."""

    name: str
    within: str | None
    """Box that it is a part of."""
    calls: float
    """Calls per tick."""
    us: float
    """Time in the box itself, without its parts [µs per tick]."""
    share: float
    """Share of the tick, which the shares of all boxes add up to [-]."""
    sampled: float | None
    """The same share by samples of the untouched program; None for a box in compiled code, which counts as a part of
    the one around it there.
    """


class TickProfile(Struct, frozen=True):
    """The boxes of one robot."""

    boxes: list[BoxTime]
    us: float
    """Sum of the boxes [µs per tick]."""
    check: Figure
    """Sum of the boxes, compared with the untouched tick in the same run."""
    wrapper_us: float
    """What a wrapper costs in a call, which was subtracted [µs]."""
    mujoco: Figure
    """The untouched tick, compared with MuJoCo's of the same arm."""


class Profiles(Struct, frozen=True):
    """Profiles of several robots."""

    machine: Machine
    ticks: dict[str, TickProfile]
    """Name of the filter to the boxes."""


def tick_profile(shapers: Sequence[str], tell: Callable[[str], None]) -> Profiles:
    """Measure the boxes of a tick in motion.

    Args:
        shapers: Names of filters besides `SHAPERS`.
        tell: Called with a description of each measurement before it starts.

    Raises:
        BoxError: A function of a box does not exist, or a box is never reached.
    """
    machine, timer = this_machine(), BoxTimer(ALL)
    tell("preparing the robots")
    with published() as publishing:
        setup = free_setup(truth=False, shaper=SHAPERS[0])
        robots = {name: MovingRobot.with_shaper(name) for name in dict.fromkeys((*SHAPERS, *shapers))}
        robots[STREAM] = StreamingRobot(LoopbackHost(setup))
        robots[READ] = MovingRobot(_ReadRobot(setup, publishing))
        with timer.attached():  # says at once what is missing
            pass
        mujoco = mujoco_tick()
        found: dict[str, TickProfile] = {}
        for name, robot in robots.items():
            tell(f"the boxes with {name}")
            found[name] = _profile(robot, timer, mujoco)
    _check_reached(found)
    return Profiles(machine, found)


class _ReadRobot(LoopbackHost):
    """A robot whose states are published, and read by the instruments of UR's interfaces, as those of a served one."""

    def __init__(self, setup: Setup, publishing: Published) -> None:
        self._instruments = Instruments(setup.description)
        super().__init__(setup)
        self._io = self.controller.io()
        self.subscribe("state", lambda data: publishing.put(data))  # noqa: PLW0108  looked up when it is called

    def report(self, report: Report) -> None:
        super().report(report)
        self._instruments.snapshot(report.state, self._io)


def _profile(robot: MovingRobot, timer: BoxTimer, mujoco: Run) -> TickProfile:
    own: dict[bool, list[Floats]] = {False: [], True: []}

    def untouched() -> float:
        robot.begin()
        gc.collect()
        began = time.perf_counter_ns()
        robot.go()
        return 1e-3 * (time.perf_counter_ns() - began) / TICKS

    def timed(twice: bool) -> float:
        robot.begin()
        gc.collect()
        timer.clear()
        with timer.attached(twice=twice):
            robot.go()
        own[twice].append(1e-3 / TICKS * np.array(timer.own_times()))
        return float(own[twice][-1].sum())

    runs = {
        "untouched": untouched,
        "once": lambda: timed(False),
        "twice": lambda: timed(True),
        "mujoco": mujoco,
    }
    taken = in_alternation(runs, REPETITIONS)
    calls = np.array(timer.calls) / TICKS
    once, twice = (np.array(own[wrapped][1:]) for wrapped in (False, True))  # the first ones only warm up
    times = np.maximum(np.median(once, axis=0) - np.median(twice - once, axis=0), 0.0)
    sums = (2.0 * once - twice).sum(axis=1)
    whole = float(times.sum())
    shares = sampled_shares(robot, timer, SAMPLES)
    boxes = [
        BoxTime(box.name, box.within, float(count), float(us), float(us) / whole, share)
        for box, count, us, share in zip(timer.boxes, calls, times, shares, strict=True)
        if count > 0.0
    ]
    untouched_us = taken["untouched"]
    return TickProfile(
        boxes=boxes,
        us=whole,
        check=figure("sum of the boxes", "µs", sums.tolist(), "the untouched tick", untouched_us),
        wrapper_us=float(np.median((twice - once).sum(axis=1)) / calls.sum()),
        mujoco=figure("the untouched tick", "µs", untouched_us, "MuJoCo's tick", taken["mujoco"]),
    )


def _check_reached(found: dict[str, TickProfile]) -> None:
    reached = {box.name for profile in found.values() for box in profile.boxes}
    for box in ALL:
        if box.name not in reached:
            names = " and ".join(f"{place.owner.__name__}.{place.name}" for place in box.places)
            raise BoxError(
                f"the box {box.name!r} was never reached from {box.within!r}: {names} no longer does its work there, "
                "so name the function that does in tvist_controller/boxes.py"
            )


def parts_of(
    boxes: Sequence[BoxTime], within: str | None = None, depth: int = 0
) -> Iterator[tuple[int, BoxTime]]:
    """Return the boxes with their depths, each followed by its parts."""
    for box in boxes:
        if box.within == within:
            yield depth, box
            yield from parts_of(boxes, box.name, depth + 1)
